"""Exports say what every tree and every small decorator has."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_gltf import accessor, small_document, split_glb, write_glb
from synthetic_results import build_decorators, build_result

from bake.decorator_types import Decorators, SmallScalars
from bake.results.export import export
from bake.scene import flatten, load_scene
from bake.settings import BakeSettings
from bake.types import BakeResult, Role, Scene


def decorated_level(
    folder: Path, *, distances: tuple[float, ...] = (2.0, 300.0), extras: Any = None
) -> tuple[BakeResult, Scene]:
    """The small level, its crates as trees that share their mesh with a blocker, its row as small decorators."""
    document, binary = small_document()
    document["nodes"][1]["extras"]["obscura"] = {"role": "tree"}
    document["nodes"][2]["extras"] = {"obscura": {"role": "tree"}}
    document["nodes"][4]["extras"] = {"obscura": {"role": "small"}}
    clump = {"name": "clump", "mesh": 1, "extras": {"obscura": {"role": "shrub"}} if extras is None else extras}
    document["nodes"].append(clump)
    document["scenes"][0]["nodes"].append(5)
    path = write_glb(folder / "level.glb", document, binary)
    if extras is not None:
        path.with_suffix(".obscura.toml").write_text('[[object]]\nmatch = "clump"\nrole = "shrub"\n')
    scene = load_scene(path)
    settings = BakeSettings(distances=distances)
    world = flatten(scene, settings)
    result = build_result(scene_path=path, files=dict(scene.files), distances=distances)
    ao = np.full((world.vertex_count, len(distances)), np.nan, np.float32)
    field = dataclasses.replace(result.field, ao=ao, state=np.full(len(ao), 3, np.uint8))
    result = dataclasses.replace(result, world=world, field=field, settings=settings)
    made = build_decorators(result, trees=objects_of(result, Role.TREE), model_sizes=(8,))
    models = (dataclasses.replace(made.models[0], mesh=scene.objects[0].mesh),)
    small = objects_of(result, Role.SMALL)
    random = np.random.default_rng(4).random((len(small), len(distances))).astype(np.float32)
    scalars = SmallScalars(np.int32(small), random, np.ones(len(small), bool))
    decorators = dataclasses.replace(made, models=models, small_scalars=scalars)
    return dataclasses.replace(result, decorators=decorators), scene


def objects_of(result: BakeResult, role: Role) -> tuple[int, ...]:
    """Objects of a role."""
    return tuple(i for i, own in enumerate(result.world.object_roles) if own is role)


def decorators_of(result: BakeResult) -> Decorators:
    """The decorators that a test gave to a result."""
    assert result.decorators is not None
    return result.decorators


def test_a_tree_mesh_carries_its_local_ao(tmp_path: Path) -> None:
    """Trees share one mesh with the model's local AO; a blocker of the same mesh stays without."""
    result, scene = decorated_level(tmp_path)
    export(result, tmp_path / "out.glb", scene=scene)
    document, binary, _ = split_glb(tmp_path / "out.glb")
    nodes, meshes = document["nodes"], document["meshes"]
    assert nodes[1]["mesh"] == nodes[2]["mesh"] != nodes[3]["mesh"]
    local_ao = decorators_of(result).models[0].local_ao
    for number, primitive in enumerate(meshes[nodes[1]["mesh"]]["primitives"]):
        values = accessor(document, binary, primitive["attributes"]["_AO"])
        begin = scene.meshes[scene.objects[0].mesh].primitives[number].first_vertex
        np.testing.assert_array_equal(values, local_ao[begin : begin + 4])
    assert all("_AO" not in primitive["attributes"] for primitive in meshes[nodes[3]["mesh"]]["primitives"])


def test_plain_nodes_say_it_in_their_extras(tmp_path: Path) -> None:
    """Trees have coefficients and centre, a shrub its scalar; the role stays where it was."""
    result, scene = decorated_level(tmp_path)
    assert export(result, tmp_path / "out.glb", scene=scene) == ()
    nodes = split_glb(tmp_path / "out.glb")[0]["nodes"]
    decorators = decorators_of(result)
    assert decorators.fits is not None
    assert decorators.shrub_scalars is not None
    for row, node in enumerate((nodes[1], nodes[2])):
        said = node["extras"]["obscura"]
        assert said["role"] == "tree"
        np.testing.assert_array_equal(np.float32(said["baked"]["ao_global"]), decorators.fits.coefficients[row].T)
        np.testing.assert_allclose(said["baked"]["ao_centre"], decorators.fits.centre[row] + result.world.origin)
    assert nodes[1]["extras"]["id"] == 7
    np.testing.assert_array_equal(
        np.float32(nodes[5]["extras"]["obscura"]["baked"]["ao_scale"]), decorators.shrub_scalars.ao[0]
    )
    assert "obscura" in nodes[3]["extras"]
    assert "baked" not in nodes[3]["extras"]["obscura"]


def test_extras_that_are_no_table_are_left_alone(tmp_path: Path) -> None:
    """The scalar of such a node is in the side file only, and the export says so."""
    result, scene = decorated_level(tmp_path, extras=[1, 2])
    (finding,) = export(result, tmp_path / "out.glb", scene=scene)
    assert (finding.object, finding.what) == ("clump", "extras-left-alone")
    assert split_glb(tmp_path / "out.glb")[0]["nodes"][5]["extras"] == [1, 2]
    assert "clump" in json.loads((tmp_path / "out.decorators.json").read_text())["shrubs"]


@pytest.mark.parametrize("count", [1, 2, 4, 5])
def test_instances_carry_their_scale(tmp_path: Path, count: int) -> None:
    """Each instance has its scalar, in one attribute up to four distances, in one each for more."""
    result, scene = decorated_level(tmp_path, distances=tuple(float(i + 1) for i in range(count)))
    export(result, tmp_path / "out.glb", scene=scene)
    document, binary, _ = split_glb(tmp_path / "out.glb")
    attributes = document["nodes"][4]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]
    names = ["_AO_SCALE"] if count <= 4 else [f"_AO_SCALE_{i}" for i in range(count)]
    values = np.concatenate([accessor(document, binary, attributes[name]) for name in names], axis=1)
    small = decorators_of(result).small_scalars
    assert small is not None
    np.testing.assert_array_equal(values, small.ao)
    assert not any(name.startswith("_AO_GLOBAL") for name in attributes)


@pytest.mark.parametrize("distances", [(2.0,), (2.0, 300.0)])
def test_instanced_trees_carry_their_coefficients(tmp_path: Path, distances: tuple[float, ...]) -> None:
    """Instances have a VEC4 a distance and their centre; one that is no tree carries 1, 0, 0, 0."""
    result, scene = decorated_level(tmp_path, distances=distances)
    row = [i for i, path in enumerate(result.world.object_paths) if path.startswith("row")]
    made = build_decorators(result, trees=(row[0], row[2]), model_sizes=(4,))
    tile = scene.objects[row[0]].mesh
    decorators = dataclasses.replace(
        made, models=(dataclasses.replace(made.models[0], mesh=tile),), small_scalars=None, shrub_scalars=None
    )
    export(dataclasses.replace(result, decorators=decorators), tmp_path / "out.glb", scene=scene)
    document, binary, _ = split_glb(tmp_path / "out.glb")
    attributes = document["nodes"][4]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]
    assert decorators.fits is not None
    for column in range(len(distances)):
        name = "_AO_GLOBAL" if len(distances) == 1 else f"_AO_GLOBAL_{column}"
        values = accessor(document, binary, attributes[name])
        np.testing.assert_array_equal(values[[0, 2]], decorators.fits.coefficients[:, :, column])
        np.testing.assert_array_equal(values[1], [1, 0, 0, 0])
    centres = accessor(document, binary, attributes["_AO_CENTRE"])
    np.testing.assert_allclose(centres[[0, 2]], decorators.fits.centre + result.world.origin, rtol=1e-6)


def test_the_side_file_names_every_object(tmp_path: Path) -> None:
    """Strict JSON by object path: trees, small decorators, shrubs with their densities."""
    result, scene = decorated_level(tmp_path)
    export(result, tmp_path / "out.glb", scene=scene)
    text = (tmp_path / "out.decorators.json").read_text()
    side = json.loads(text, parse_constant=lambda constant: pytest.fail(constant))
    paths, decorators = result.world.object_paths, decorators_of(result)
    assert side["distances"] == [2.0, 300.0]
    assert set(side["trees"]) == {paths[i] for i in objects_of(result, Role.TREE)}
    assert set(side["small"]) == {paths[i] for i in objects_of(result, Role.SMALL)}
    assert decorators.fits is not None
    tree = side["trees"][paths[int(decorators.fits.object[1])]]
    np.testing.assert_array_equal(np.float32(tree["coefficients"]), decorators.fits.coefficients[1].T)
    np.testing.assert_array_equal(tree["centre"], decorators.fits.centre[1] + result.world.origin)
    shrub = side["shrubs"]["clump"]
    assert shrub["density"] == pytest.approx(0.5)
    assert shrub["given_density"] == pytest.approx(0.8)
    assert shrub["found"] is True


def test_an_export_is_a_scene_again(tmp_path: Path) -> None:
    """What an export says of its nodes declares nothing: roles are as before."""
    result, scene = decorated_level(tmp_path)
    export(result, tmp_path / "out.glb", scene=scene)
    again = load_scene(tmp_path / "out.glb")
    assert [(item.path, item.role, item.keys) for item in again.objects] == [
        (item.path, item.role, item.keys) for item in scene.objects
    ]


def test_independent_readers_open_it(tmp_path: Path) -> None:
    """pygltflib and trimesh read the document with its instance attributes."""
    import pygltflib
    import trimesh

    result, scene = decorated_level(tmp_path)
    export(result, tmp_path / "out.glb", scene=scene)
    read = pygltflib.GLTF2().load(str(tmp_path / "out.glb"))
    assert "_AO_SCALE" in read.nodes[4].extensions["EXT_mesh_gpu_instancing"]["attributes"]
    assert (
        trimesh.load_scene(tmp_path / "out.glb").triangles.shape
        == trimesh.load_scene(result.scene_path).triangles.shape
    )


def test_other_sources_say_it_too(tmp_path: Path, result: BakeResult) -> None:
    """In the document made for a scene that was no glTF file, trees have their local AO and nodes their extras."""
    decorated = dataclasses.replace(
        result, scene_path=Path("/levels/yard.obj"), decorators=build_decorators(result, trees=(1,))
    )
    export(decorated, tmp_path / "out.glb")
    document, binary, _ = split_glb(tmp_path / "out.glb")
    local_ao = decorators_of(decorated).models[0].local_ao
    attributes = document["meshes"][1]["primitives"][0]["attributes"]
    np.testing.assert_array_equal(accessor(document, binary, attributes["_AO"]), local_ao)
    assert set(document["nodes"][2]["extras"]["obscura"]["baked"]) == {"ao_global", "ao_centre"}
    assert set(document["nodes"][3]["extras"]["obscura"]["baked"]) == {"ao_scale"}
    assert "extras" not in document["nodes"][1]


def test_npz_has_the_arrays(tmp_path: Path, result: BakeResult) -> None:
    """The archive gains plain arrays; without decorators it is as it was."""
    decorators = build_decorators(result, trees=(0, 2), model_sizes=(5, 3))
    export(dataclasses.replace(result, decorators=decorators), tmp_path / "with.npz")
    export(result, tmp_path / "without.npz")
    assert decorators.fits is not None
    assert decorators.small_scalars is not None
    assert decorators.fog is not None
    with np.load(tmp_path / "with.npz") as archive, np.load(tmp_path / "without.npz") as plain:
        np.testing.assert_array_equal(archive["tree_objects"], [0, 2])
        np.testing.assert_array_equal(archive["tree_coefficients"], decorators.fits.coefficients)
        np.testing.assert_array_equal(archive["tree_centres"], decorators.fits.centre + result.world.origin)
        np.testing.assert_array_equal(archive["tree_model_first"], [0, 5, 8])
        np.testing.assert_array_equal(archive["small_objects"], decorators.small_scalars.object)
        np.testing.assert_array_equal(archive["small_ao"], decorators.small_scalars.ao)
        np.testing.assert_array_equal(archive["fog_density"], decorators.fog.density)
        assert set(plain.files) < set(archive.files)
        assert not any(name.startswith(("tree_", "small_", "shrub_", "fog_")) for name in plain.files)


def test_lower_levels_carry_their_ao(tmp_path: Path, result: BakeResult) -> None:
    """An object of role lod with values is exported with them, and has a mean."""
    from bake.results.exported_ao import object_means

    roles = (Role.STATIC, Role.LOD, Role.STATIC)
    flags = result.world.face_samples & (result.world.face_object != 1)
    world = dataclasses.replace(result.world, object_roles=roles, face_samples=flags)
    lower = dataclasses.replace(result, world=world, scene_path=Path("/levels/yard.obj"))
    export(lower, tmp_path / "out.glb")
    document, binary, _ = split_glb(tmp_path / "out.glb")
    values = accessor(document, binary, document["meshes"][1]["primitives"][0]["attributes"]["_AO"])
    np.testing.assert_array_equal(values[:4], result.field.ao[5:9])
    assert np.isfinite(object_means(lower)).all()
