from __future__ import annotations

import copy
import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from bake.errors import SceneError
from bake.ground import Ground
from bake.scene import flatten, load_scene
from bake.settings import BakeSettings
from tests.scene.glb_files import QUAD, QUAD_FACES, QUAD_UVS, GltfFile
from tests.scene.test_ply_files import ascii_ply, binary_ply

OBJ = (
    b"mtllib a.mtl\no a\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\ng b\nusemtl m\n"
    b"f 1/1/1 2 3//1 4\nf -1 -2 -3\n"
)
EVERYTHING = BakeSettings(ground=Ground(), alpha_lookup=True)


def rich_file() -> GltfFile:
    """A small file that uses most features."""
    file = GltfFile()
    texture = file.texture(np.arange(16, dtype=np.uint8).reshape(4, 4) * 16)
    transform = {"KHR_texture_transform": {"scale": [2, 2], "offset": [0.5, 0], "rotation": 1.0}}
    colour = {"baseColorTexture": {"index": texture, "extensions": transform}, "baseColorFactor": [1, 1, 1, 0.9]}
    leaf = file.material(name="leaf", alphaMode="MASK", doubleSided=True, pbrMetallicRoughness=colour)
    shaded = file.primitive(QUAD, QUAD_FACES, normals=np.tile([0, 0, 1], (4, 1)), uvs=QUAD_UVS, material=leaf)
    bare = file.primitive(QUAD + 1, [0, 1, 2, 3], mode=5)
    mesh = file.mesh(shaded, bare, name="card")
    rows, values = file.view(np.array([1], "<u2").tobytes()), file.view(np.ones(3, "<f4").tobytes())
    file.document["accessors"][0]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": rows, "componentType": 5123},
        "values": {"bufferView": values},
    }
    instances = {"TRANSLATION": file.accessor([[0, 0, 0], [3, 0, 0]]), "ROTATION": file.accessor([[0, 0, 0, 1]] * 2)}
    child = file.node("grass", root=False, mesh=mesh, extensions={"EXT_mesh_gpu_instancing": {"attributes": instances}})
    file.node("top", children=[child], scale=[-1, 1, 2], extras={"obscura": {"role": "receiver", "offset": 0.1}})
    return file


RICH = rich_file()
GLB = RICH.glb()


def survives(content: bytes, name: str, side_file: bytes | None = None) -> None:
    """Loads and flattens, or is refused in one line; anything else fails the test."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_bytes(content)
        if side_file is not None:
            path.with_suffix(".obscura.toml").write_bytes(side_file)
        try:
            scene = load_scene(path)
            world = flatten(scene, EVERYTHING)
        except SceneError as refusal:
            assert "\n" not in str(refusal)
            return
        assert np.isfinite(world.positions[world.faces]).all()
        assert np.isfinite(world.normals).all()
        assert ((world.face_openness >= 0) & (world.face_openness <= 1)).all()
        assert world.faces.min() >= 0
        assert world.faces.max() < world.vertex_count


def damaged(content: bytes) -> st.SearchStrategy[bytes]:
    """`content` cut off, or with some bytes changed."""
    flips = st.lists(st.tuples(st.integers(0, len(content) - 1), st.integers(0, 255)), min_size=1, max_size=8)

    def flip(changes: list[tuple[int, int]]) -> bytes:
        changed = bytearray(content)
        for place, value in changes:
            changed[place] = value
        return bytes(changed)

    return st.one_of(st.integers(0, len(content)).map(lambda size: content[:size]), flips.map(flip))


def test_the_rich_file_loads() -> None:
    """The file that the fuzz tests damage is itself in order."""
    with tempfile.TemporaryDirectory() as folder:
        world = flatten(load_scene(RICH.write(Path(folder))), EVERYTHING)
    assert world.object_paths == ("top/grass#1", "top/grass#2", "ground")


@settings(max_examples=300, deadline=None)
@given(damaged(GLB))
def test_damaged_glb_is_refused_or_read(content: bytes) -> None:
    """Truncation and changed bytes never end in anything but a refusal."""
    survives(content, "level.glb")


@settings(max_examples=150, deadline=None)
@given(damaged(OBJ))
def test_damaged_obj_is_refused_or_read(content: bytes) -> None:
    """The same for OBJ."""
    survives(content, "level.obj")


@settings(max_examples=150, deadline=None)
@given(st.one_of(damaged(ascii_ply((0, 1, 2, 3), (1, 2, 4))), damaged(binary_ply("<", (0, 1, 2, 3), (1, 2, 4)))))
def test_damaged_ply_is_refused_or_read(content: bytes) -> None:
    """The same for PLY."""
    survives(content, "level.ply")


SIDE_FILE = (
    b'[bake]\nrays = 4\n[[object]]\nmatch = "top/*"\nrole = "tree"\n[[region]]\nname="a"\nmin=[0,0,0]\nmax=[1,1,1]\n'
)


@settings(max_examples=80, deadline=None)
@given(damaged(SIDE_FILE))
def test_damaged_side_file_is_refused_or_read(content: bytes) -> None:
    """The same for the side file."""
    survives(GLB, "level.glb", content)


def places(value: Any, path: tuple = ()) -> list[tuple]:
    """Every place inside a JSON document."""
    members = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path, *(place for key, member in members for place in places(member, (*path, key)))]


DOCUMENT = RICH.document | {"buffers": [{"byteLength": len(RICH.binary)}]}
SCALARS = st.sampled_from(
    [None, True, "text", -1, 0, 1, 2, 7, 2.5, 1e30, 10**20, 5126, [], {}, [1], [[1]], {"a": 1}, "-1"]
)


@settings(max_examples=400, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(places(DOCUMENT)[1:]), SCALARS), min_size=1, max_size=3))
def test_wrong_types_are_refused_or_ignored(changes: list[tuple[tuple, Any]]) -> None:
    """Any value of any type at any place of the document never ends in anything but a refusal."""
    file = copy.deepcopy(RICH)
    for path, value in changes:
        holder = file.document
        try:
            for key in path[:-1]:
                holder = holder[key]
            holder[path[-1]] = copy.deepcopy(value)
        except (KeyError, TypeError, IndexError):
            continue  # an earlier change removed this place
    assert json.dumps(file.document)
    survives(file.glb(), "level.glb")
