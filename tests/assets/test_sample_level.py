"""The committed sample level is what its scripts make, and holds what later work needs."""

from __future__ import annotations

import fnmatch
import json
import tomllib
from collections import Counter
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from assets.sample_level.build import build
from assets.sample_level.house import DOORS, FLOOR

FOLDER = Path(__file__).resolve().parents[2] / "assets" / "sample_level"
FILES = ("level.glb", "level.glb.obscura.toml", "regions.json", "planted.json")
CAUSES = {
    "buried-in-geometry",
    "below-plane-rays",
    "normal-against-face",
    "coplanar-twin",
    "starved-of-samples",
    "sliver-overshoot",
    "split-seam",
    "enclosing-shell",
    "true-crevice",
}


class Glb:
    """The level as an independent reader sees it."""

    def __init__(self) -> None:
        pygltflib = pytest.importorskip("pygltflib")
        self.document = pygltflib.GLTF2().load_binary(str(FOLDER / "level.glb"))
        self.blob = self.document.binary_blob()
        self.nodes: dict[str, Any] = {}
        self.placement: dict[str, np.ndarray] = {}
        for root in self.document.scenes[self.document.scene].nodes:
            self._walk(root, "", np.zeros(3))

    def _walk(self, index: int, above: str, origin: np.ndarray) -> None:
        node = self.document.nodes[index]
        path = f"{above}/{node.name}" if above else node.name
        assert path not in self.nodes
        self.nodes[path] = node
        self.placement[path] = origin + (node.translation or [0.0, 0.0, 0.0])
        for child in node.children or []:
            self._walk(child, path, self.placement[path])

    def array(self, index: int) -> np.ndarray:
        """An accessor's content."""
        accessor = self.document.accessors[index]
        view = self.document.bufferViews[accessor.bufferView]
        dtype = {5126: "<f4", 5123: "<u2", 5125: "<u4"}[accessor.componentType]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[accessor.type]
        flat = np.frombuffer(self.blob, dtype, accessor.count * width, (view.byteOffset or 0))
        return flat.reshape(-1, width)

    def triangles(self, path: str) -> np.ndarray:
        """Corners of an object that is only shifted, in world metres, shape (m, 3, 3)."""
        parts = []
        for primitive in self.document.meshes[self.nodes[path].mesh].primitives:
            positions = self.array(primitive.attributes.POSITION).astype(float) + self.placement[path]
            parts.append(positions[self.array(primitive.indices).reshape(-1, 3)])
        return np.concatenate(parts)

    def role(self, path: str) -> str:
        """The role that extras give a node."""
        return (self.nodes[path].extras or {}).get("obscura", {}).get("role", "")


@pytest.fixture(scope="module")
def glb() -> Glb:
    """The committed level."""
    return Glb()


@pytest.fixture(scope="module")
def side_file() -> dict[str, Any]:
    """The committed side file."""
    return tomllib.loads((FOLDER / "level.glb.obscura.toml").read_text())


@pytest.fixture(scope="module")
def planted() -> list[dict[str, Any]]:
    """The planted dark spots."""
    return json.loads((FOLDER / "planted.json").read_text())["spots"]


def test_building_again_gives_the_committed_bytes(tmp_path: Path) -> None:
    """Nothing in the scripts depends on time, machine or order, and nobody edited the files by hand."""
    build(tmp_path)
    for name in FILES:
        assert (tmp_path / name).read_bytes() == (FOLDER / name).read_bytes(), name


def test_size(glb: Glb) -> None:
    """The level stays small enough to commit and to bake in a minute."""
    assert (FOLDER / "level.glb").stat().st_size < 4_000_000
    triangles = sum(
        glb.document.accessors[primitive.indices].count // 3
        for node in glb.nodes.values()
        if node.mesh is not None
        for primitive in glb.document.meshes[node.mesh].primitives
    )
    assert 120_000 < triangles < 200_000


def test_trees_shrubs_grass_and_levels_of_detail(glb: Glb) -> None:
    """14 trees of 2 meshes, 80 shrubs, 400 clumps of one node, 2 lower levels of detail."""
    children = {path: [p for p in glb.nodes if p.rpartition("/")[0] == path] for path in glb.nodes}
    trees = children["Level/Trees"]
    assert len(trees) == 14
    assert len({glb.nodes[path].mesh for path in trees}) == 2
    assert len(children["Level/Shrubs"]) == 80
    (clump,) = children["Level/Grass"]
    instancing = glb.nodes[clump].extensions["EXT_mesh_gpu_instancing"]["attributes"]
    assert {glb.document.accessors[index].count for index in instancing.values()} == {400}
    assert glb.role(clump) == "small"
    assert sum("_LOD" in path for path in glb.nodes) == 3
    assert glb.nodes["Level/Tower/Tower_LOD1"].extras["obscura"]["of"] in glb.nodes


def test_vertex_data_is_sound(glb: Glb) -> None:
    """Indices are in range, normals have unit length, textured parts have coordinates, every vertex is used."""
    for mesh in glb.document.meshes:
        for primitive in mesh.primitives:
            positions = glb.array(primitive.attributes.POSITION)
            indices = glb.array(primitive.indices)
            assert np.isfinite(positions).all()
            assert len(np.unique(indices)) == len(positions) == indices.max() + 1, mesh.name
            lengths = np.linalg.norm(glb.array(primitive.attributes.NORMAL), axis=1)
            assert np.abs(lengths - 1.0).max() < 1e-5, mesh.name
            material = glb.document.materials[primitive.material]
            if material.pbrMetallicRoughness.baseColorTexture is not None:
                assert len(glb.array(primitive.attributes.TEXCOORD_0)) == len(positions)


def test_leaf_textures_decode(glb: Glb) -> None:
    """The embedded PNGs are read by Pillow and hold leaves and holes."""
    image_module = pytest.importorskip("PIL.Image")
    for image in glb.document.images:
        view = glb.document.bufferViews[image.bufferView]
        png = glb.blob[view.byteOffset : view.byteOffset + view.byteLength]
        with image_module.open(BytesIO(png)) as picture:
            alpha = np.asarray(picture.getchannel("A"))
        assert 0.2 < (alpha > 127).mean() < 0.8, image.name


def test_trees_stand_on_the_ground(glb: Glb) -> None:
    """The foot of every trunk lies on the ground's surface, to a centimetre."""
    ground = glb.triangles("Level/Terrain/Ground")
    for path in (p for p in glb.nodes if p.startswith("Level/Trees/")):
        x, y, z = glb.placement[path]
        assert abs(_height(ground, x, z) - y) < 0.01, path


def _height(triangles: np.ndarray, x: float, z: float) -> float:
    flat = triangles[:, :, [0, 2]]
    ab, ac, here = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0], np.array([x, z]) - flat[:, 0]
    area = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
    v = (here[:, 0] * ac[:, 1] - here[:, 1] * ac[:, 0]) / area
    w = (ab[:, 0] * here[:, 1] - ab[:, 1] * here[:, 0]) / area
    inside = np.argmax(np.minimum(np.minimum(v, w), 1 - v - w))
    heights = triangles[inside, :, 1]
    return float(heights @ [1 - v[inside] - w[inside], v[inside], w[inside]])


def test_doorways_let_a_person_through() -> None:
    """A character 1.8 m high and 0.6 m wide passes every doorway."""
    for pair, (_, x0, z0, x1, z1, sill, head) in DOORS.items():
        assert sill == FLOOR
        assert head - sill > 2.0, pair
        assert max(x1 - x0, z1 - z0) > 1.0, pair


def test_every_rule_of_the_side_file_matches(glb: Glb, side_file: dict[str, Any]) -> None:
    """No pattern is left without an object, and what lower levels stand for exists."""
    meshes = [path for path, node in glb.nodes.items() if node.mesh is not None]
    roles = Counter(glb.role(path) for path in meshes)
    for rule in side_file["object"]:
        matched = fnmatch.filter(meshes, rule["match"])
        assert matched, rule
        assert rule.get("of", "Level") in glb.nodes
        roles[rule["role"]] += len(matched)
    assert (roles["tree"], roles["shrub"], roles["small"], roles["lod"]) == (14, 80, 1, 2)


def test_regions_and_links(side_file: dict[str, Any]) -> None:
    """Side file and JSON name the same boxes; links join boxes that lie within a wall's thickness."""
    document = json.loads((FOLDER / "regions.json").read_text())
    assert document["regions"] == side_file["region"]
    boxes = {region["name"]: np.array([region["min"], region["max"]]) for region in document["regions"]}
    assert len(boxes) == len(document["regions"])
    linked = set()
    for link in document["links"]:
        a, b = boxes[link["a"]], boxes[link["b"]]
        gap = np.maximum(np.maximum(a[0] - b[1], b[0] - a[1]), 0.0)
        assert gap.max() < 0.61, link
        linked |= {link["a"], link["b"]}
    assert linked == set(boxes)


def test_planted_spots_lie_on_their_objects(glb: Glb, planted: list[dict[str, Any]]) -> None:
    """Eight causes and one true crevice, each with its object, its label in digits and a spot on its surface."""
    assert {spot["cause"] for spot in planted} == CAUSES
    assert len(planted) == 9
    for number, spot in enumerate(planted, start=1):
        assert spot["label"].startswith(f"{number}_")
        assert f"Level/DarkCorner/{spot['label']}/Label" in glb.nodes
        triangles = glb.triangles(spot["object"])
        assert _distance(np.array(spot["position"]), triangles) < 0.002, spot["label"]
        if "object" in spot["remedy"]:
            assert fnmatch.filter(glb.nodes, spot["remedy"]["object"])


def _distance(point: np.ndarray, triangles: np.ndarray) -> float:
    """From a point to the nearest of many points on the triangles: a fine barycentric grid."""
    steps = np.arange(0, 65) / 64
    u, v = (grid.ravel() for grid in np.meshgrid(steps, steps))
    u, v = u[u + v <= 1], v[u + v <= 1]
    weights = np.stack([u, v, 1 - u - v], axis=1)
    nearest = np.inf
    for triangle in triangles:
        plane = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
        off = abs(np.dot(point - triangle[0], plane)) / max(np.linalg.norm(plane), 1e-12)
        if off < 0.002:
            spread = np.linalg.norm(triangle - triangle[[1, 2, 0]], axis=1).max() / 64
            if np.linalg.norm(weights @ triangle - point, axis=1).min() < spread + 0.002:
                nearest = min(nearest, off)
    return nearest


def test_it_loads_into_the_baker() -> None:
    """The project's own loader takes everything and warns of nothing but what was planted."""
    scene_module = pytest.importorskip("bake.scene")
    scene = scene_module.load_scene(FOLDER / "level.glb")
    roles = Counter(item.role.value for item in scene.objects)
    assert (roles["tree"], roles["shrub"], roles["small"], roles["lod"]) == (14, 80, 400, 2)
    assert len(scene.regions) == 16
    assert [finding for finding in scene.findings if finding.severity == "set-aside"] == []
    warned = {finding.object for finding in scene.findings if finding.severity == "warning"}
    assert {path for path in warned if "/DarkCorner/" not in path} == set()
