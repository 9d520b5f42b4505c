"""A GLB export keeps its source document and adds AO that independent readers find."""

from __future__ import annotations

import copy
import dataclasses
import json
import struct
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_gltf import PIXEL, TRIANGLES, accessor, small_document, split_glb, write_glb, write_gltf
from synthetic_results import build_result

from bake.errors import ResultError
from bake.results.export import export, needs_scene
from bake.scene import flatten, load_scene
from bake.settings import BakeSettings
from bake.types import BakeResult, Scene


def bake_like(path: Path, *, distances: tuple[float, ...] = (2.0, 300.0)) -> tuple[BakeResult, Scene]:
    """A result for the scene at `path` whose AO tells object and vertex apart: (object + vertex / 100) / 10."""
    scene = load_scene(path)
    settings = BakeSettings(distances=distances)
    world = flatten(scene, settings)
    result = build_result(scene_path=path, files=dict(scene.files))
    owner = np.searchsorted(world.first_vertex, np.arange(world.vertex_count), side="right") - 1
    local = np.arange(world.vertex_count) - world.first_vertex[owner]
    ao = ((owner + local / 100) / 10)[:, None] + np.arange(len(distances)) / 1000
    receives = np.array([role.receives_per_vertex for role in world.object_roles])[owner]
    ao[~receives] = np.nan
    field = dataclasses.replace(result.field, ao=ao.astype(np.float32), state=np.where(receives, 0, 3).astype(np.uint8))
    return dataclasses.replace(result, world=world, field=field, settings=settings), scene


def without_additions(document: dict[str, Any], original: dict[str, Any]) -> dict[str, Any]:
    """An exported document less what an export may add."""
    document = copy.deepcopy(document)
    for kind in ("accessors", "bufferViews", "meshes"):
        document[kind] = document[kind][: len(original[kind])]
    for mesh in document["meshes"]:
        for primitive in mesh["primitives"]:
            primitive["attributes"].pop("_AO", None)
    for node, source in zip(document["nodes"], original["nodes"], strict=True):
        if "mesh" in source:
            node["mesh"] = source["mesh"]
    document["nodes"][4]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"].pop("_AO", None)
    document["asset"]["extras"].pop("obscura")
    document["buffers"][0]["byteLength"] = original["buffers"][0]["byteLength"]
    return document


@pytest.fixture
def level(tmp_path: Path) -> Path:
    """The small level as a GLB with a chunk of its own at the end."""
    document, binary = small_document()
    return write_glb(tmp_path / "level.glb", document, binary, trailing=struct.pack("<II", 4, 0x12345678) + b"mine")


def test_the_source_document_is_kept(tmp_path: Path, level: Path) -> None:
    """All JSON values, the binary chunk byte for byte and unknown chunks survive."""
    result, scene = bake_like(level)
    assert needs_scene(result, tmp_path / "out.glb")
    export(result, tmp_path / "out.glb", scene=scene)
    original, source_binary, source_rest = split_glb(level)
    document, binary, rest = split_glb(tmp_path / "out.glb")
    assert list(document) == list(original)
    assert without_additions(document, original) == original
    assert binary[: len(source_binary)] == source_binary
    assert rest == source_rest
    assert document["buffers"][0]["byteLength"] <= len(binary)


def test_every_object_has_its_own_values(tmp_path: Path, level: Path) -> None:
    """Objects that share a mesh get copies of it; a blocker keeps the mesh without AO."""
    result, scene = bake_like(level)
    findings = export(result, tmp_path / "out.glb", scene=scene)
    document, binary, _ = split_glb(tmp_path / "out.glb")
    nodes, meshes = document["nodes"], document["meshes"]
    for node, owner in ((1, 0), (2, 1)):
        primitives = meshes[nodes[node]["mesh"]]["primitives"]
        for number, primitive in enumerate(primitives):
            values = accessor(document, binary, primitive["attributes"]["_AO"])
            span = scene.meshes[scene.objects[owner].mesh].primitives[number]
            begin = result.world.first_vertex[owner] + span.first_vertex
            np.testing.assert_array_equal(values, result.field.ao[begin : begin + 4])
        assert [{**p, "attributes": {k: v for k, v in p["attributes"].items() if k != "_AO"}} for p in primitives] == (
            small_document()[0]["meshes"][0]["primitives"]
        )
    assert len({nodes[1]["mesh"], nodes[2]["mesh"], nodes[3]["mesh"]}) == 3
    assert all("_AO" not in primitive["attributes"] for primitive in meshes[nodes[3]["mesh"]]["primitives"])
    assert [(finding.what, finding.count) for finding in findings] == [("instances-carry-their-mean", 3)]


def test_instances_carry_their_mean(tmp_path: Path, level: Path) -> None:
    """Instances have one value each, in the extension and in a side file by object path."""
    result, scene = bake_like(level)
    export(result, tmp_path / "out.glb", scene=scene)
    document, binary, _ = split_glb(tmp_path / "out.glb")
    attributes = document["nodes"][4]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]
    values = accessor(document, binary, attributes["_AO"])
    assert document["accessors"][attributes["_AO"]]["count"] == 3
    owners = [i for i, name in enumerate(result.world.object_paths) if name.startswith("row")]
    # Both faces of a tile have the same area, so that each of their six corners counts the same.
    means = np.array([result.field.ao[result.world.first_vertex[i] + TRIANGLES].mean(axis=0) for i in owners])
    np.testing.assert_allclose(values, means, atol=1e-6)
    side = json.loads((tmp_path / "out.instances.json").read_text())
    assert list(side["instances"]) == ["row#1", "row#2", "row#3"]
    np.testing.assert_allclose(list(side["instances"].values()), means, atol=1e-6)
    assert side["distances"] == [2.0, 300.0]


def test_pygltflib_reads_it(tmp_path: Path, level: Path) -> None:
    """An independent glTF reader finds the attribute, its type and its values."""
    import pygltflib

    result, scene = bake_like(level)
    export(result, tmp_path / "out.glb", scene=scene)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it warns of the unknown chunk
        read = pygltflib.GLTF2().load(str(tmp_path / "out.glb"))
    attributes = read.meshes[read.nodes[1].mesh].primitives[0].attributes
    item = read.accessors[attributes._AO]
    assert (item.type, item.componentType, item.count) == ("VEC2", 5126, 4)
    view = read.bufferViews[item.bufferView]
    begin = view.byteOffset + item.byteOffset
    blob = read.binary_blob()
    rows = [struct.unpack_from("<2f", blob, begin + view.byteStride * row) for row in range(4)]
    np.testing.assert_array_equal(np.float32(rows), result.field.ao[:4])


def test_trimesh_reads_it(tmp_path: Path, level: Path) -> None:
    """Another independent reader sees the same shapes as in the source, and the attribute."""
    import trimesh

    result, scene = bake_like(level)
    export(result, tmp_path / "out.glb", scene=scene)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        before, after = trimesh.load_scene(level), trimesh.load_scene(tmp_path / "out.glb")
    assert np.allclose(before.bounds, after.bounds)
    assert before.triangles.shape == after.triangles.shape
    assert any("_AO" in geometry.vertex_attributes for geometry in after.geometry.values())


def test_loading_an_export_again(tmp_path: Path, level: Path) -> None:
    """An export is a scene like its source, and can itself be baked and exported."""
    result, scene = bake_like(level)
    export(result, tmp_path / "out.glb", scene=scene)
    again, again_scene = bake_like(tmp_path / "out.glb")
    np.testing.assert_array_equal(again.world.positions, result.world.positions)
    np.testing.assert_array_equal(again.world.faces, result.world.faces)
    export(again, tmp_path / "out2.glb", scene=again_scene)
    assert bake_like(tmp_path / "out2.glb")[0].world.vertex_count == result.world.vertex_count


@pytest.mark.parametrize(("count", "kind"), [(1, "SCALAR"), (3, "VEC3"), (4, "VEC4"), (6, None)])
def test_any_number_of_distances(tmp_path: Path, level: Path, count: int, kind: str | None) -> None:
    """Up to four distances share one attribute; more get one each."""
    result, scene = bake_like(level, distances=tuple(float(i + 1) for i in range(count)))
    export(result, tmp_path / "out.glb", scene=scene)
    document, binary, _ = split_glb(tmp_path / "out.glb")
    attributes = document["meshes"][document["nodes"][1]["mesh"]]["primitives"][0]["attributes"]
    if kind:
        assert document["accessors"][attributes["_AO"]]["type"] == kind
        values = accessor(document, binary, attributes["_AO"])
    else:
        values = np.column_stack([accessor(document, binary, attributes[f"_AO_{i}"]) for i in range(count)])
    np.testing.assert_array_equal(values, result.field.ao[:4])
    assert document["asset"]["extras"]["obscura"]["distances"] == [float(i + 1) for i in range(count)]


def test_colors_only_on_request(tmp_path: Path, level: Path) -> None:
    """`COLOR_0` appears when asked for, and the colour that was there moves on."""
    result, scene = bake_like(level)
    export(result, tmp_path / "out.glb", scene=scene, color=True, distance=2.0)
    document, binary, _ = split_glb(tmp_path / "out.glb")
    first, second = document["meshes"][document["nodes"][1]["mesh"]]["primitives"]
    assert first["attributes"]["COLOR_1"] == 3
    colors = accessor(document, binary, first["attributes"]["COLOR_0"])
    np.testing.assert_array_equal(colors, np.repeat(result.field.ao[:4, :1], 3, axis=1))
    assert "COLOR_1" not in second["attributes"]


def test_made_normals_are_mapped_back(tmp_path: Path) -> None:
    """A source without normals, whose vertices the loader splits or gathers, still fits its accessors."""
    document, binary = small_document(normals=False)
    result, scene = bake_like(write_glb(tmp_path / "bare.glb", document, binary))
    export(result, tmp_path / "out.glb", scene=scene)
    exported, chunk, _ = split_glb(tmp_path / "out.glb")
    for primitive in exported["meshes"][exported["nodes"][2]["mesh"]]["primitives"]:
        values = accessor(exported, chunk, primitive["attributes"]["_AO"])
        assert len(values) == 4
        assert ((values > 0.09) & (values < 0.2)).all()  # those of object 1


def test_a_gltf_with_files_beside_it(tmp_path: Path) -> None:
    """External buffers and images move into the GLB; what is missing is reported."""
    import pygltflib

    source = tmp_path / "source"
    source.mkdir()
    document, binary = small_document()
    path = write_gltf(source, document, binary)
    result, scene = bake_like(path)
    findings = export(result, tmp_path / "out.glb", scene=scene)
    exported, chunk, _ = split_glb(tmp_path / "out.glb")
    assert chunk[: len(binary)] == binary
    assert len(exported["buffers"]) == 1
    assert exported["buffers"][0]["name"] == "first"
    assert {view["buffer"] for view in exported["bufferViews"]} == {0}
    image = exported["images"][0]
    view = exported["bufferViews"][image["bufferView"]]
    assert chunk[view["byteOffset"] : view["byteOffset"] + view["byteLength"]] == PIXEL
    assert image["mimeType"] == "image/png"
    assert exported["images"][1] == {"uri": "gone.png"}
    assert ("gone.png", "image-left-out") in {(finding.object, finding.what) for finding in findings}
    again = load_scene(tmp_path / "out.glb")
    assert [item.path for item in again.objects] == [item.path for item in scene.objects]
    np.testing.assert_allclose(again.objects[-1].transform, scene.objects[-1].transform)
    assert pygltflib.GLTF2().load(str(tmp_path / "out.glb")).images[0].name == "wood"


def test_a_changed_source_is_refused(tmp_path: Path, level: Path) -> None:
    """A level edited since the bake is not mixed with old values, and nothing is written."""
    result, scene = bake_like(level)
    level.write_bytes(level.read_bytes() + b"\0")
    with pytest.raises(ResultError, match="changed since the bake"):
        export(result, tmp_path / "out.glb", scene=scene)
    level.unlink()
    with pytest.raises(ResultError, match="is missing"):
        export(result, tmp_path / "out.glb", scene=scene)
    assert not (tmp_path / "out.glb").exists()


def test_other_sources_get_a_new_document(tmp_path: Path, result: BakeResult) -> None:
    """A scene that was no glTF file becomes one node an object, at the right place."""
    import trimesh

    result = dataclasses.replace(result, scene_path=Path("/levels/yard.obj"))
    export(result, tmp_path / "out.glb", color=True)
    document, binary, _ = split_glb(tmp_path / "out.glb")
    assert [node["name"] for node in document["nodes"][1:]] == list(result.world.object_paths)
    attributes = document["meshes"][1]["primitives"][0]["attributes"]
    expected = np.where(np.isnan(result.field.ao[5:10]), 1, result.field.ao[5:10])
    np.testing.assert_array_equal(accessor(document, binary, attributes["_AO"]), expected)
    loaded = trimesh.load_scene(tmp_path / "out.glb")
    world = result.world
    used = (world.positions + world.origin)[np.unique(world.faces)]
    corners = loaded.to_geometry().triangles.reshape(-1, 3)
    np.testing.assert_allclose(corners.min(axis=0), used.min(axis=0), atol=1e-4)
    np.testing.assert_allclose(corners.max(axis=0), used.max(axis=0), atol=1e-4)


def test_an_empty_world_as_glb(tmp_path: Path) -> None:
    """A result without objects gives a valid, empty document."""
    import pygltflib

    empty = dataclasses.replace(build_result(objects=0), scene_path=Path("/levels/yard.ply"))
    export(empty, tmp_path / "out.glb")
    assert pygltflib.GLTF2().load(str(tmp_path / "out.glb")).meshes == []
