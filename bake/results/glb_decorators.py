"""Decorators in a glTF document.

- A tree mesh gets its model's local AO as `_AO`, shared by all its instances.
- Instances of EXT_mesh_gpu_instancing get instance attributes: trees `_AO_GLOBAL` (VEC4 y0 y1 y2 y3; `_AO_GLOBAL_0`,
  `_AO_GLOBAL_1` … if several distances were baked) and `_AO_CENTRE` (VEC3, world metres); small decorators and shrubs
  `_AO_SCALE` (SCALAR to VEC4 for one to four distances, `_AO_SCALE_0` … SCALAR each for more). An instance to which one
  of them does not apply carries what changes nothing: 1, 0, 0, 0 or 1.
- A plain node says the same in `extras.obscura.baked`: `ao_global` (a row a distance), `ao_centre`, `ao_scale`. The
  loaders skip `baked`, so that an export is a scene like its source.
"""

from __future__ import annotations

import copy
from typing import Any, cast

import numpy as np

from bake.results.exported_decorators import ExportedTree, exported_scales, exported_trees, plain_values
from bake.results.glb_attributes import AoWriter, SourceLayout
from bake.results.glb_container import GltfContainer, Segment
from bake.types import BakeResult, Finding, Float32Array, Scene, SceneObject

_FLOAT = 5126
_KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}


def annotate_tree_meshes(writer: AoWriter, scene: Scene) -> None:
    """Gives each tree mesh its local AO; a mesh that others use as well is copied for the trees."""
    trees = exported_trees(writer.result)
    models = () if writer.result.decorators is None else writer.result.decorators.models
    document = writer.container.document
    nodes = cast(list[dict[str, Any]], document.get("nodes", []))
    meshes = cast(list[dict[str, Any]], document.get("meshes", []))
    members: dict[tuple[int, int], dict[int, SceneObject]] = {}
    for item in scene.objects:
        number = writer.object_numbers.get(item.path, -1)
        if number in trees and item.node >= 0:
            members.setdefault((nodes[item.node]["mesh"], trees[number].model), {})[item.node] = item
    for (mesh, model), items in sorted(members.items()):
        users = {index for index, node in enumerate(nodes) if node.get("mesh") == mesh}
        target = mesh
        if not users <= set(items):
            target = writer.container.add("meshes", copy.deepcopy(meshes[mesh]))
            for index in items:
                nodes[index]["mesh"] = target
        item = next(iter(items.values()))
        source = scene.meshes[item.mesh]
        layout = SourceLayout(source.primitives, source.source_vertex)
        writer.add_values_to_mesh(meshes[target], models[model].local_ao, layout, item.path)


def annotate_nodes(
    container: GltfContainer, result: BakeResult, placed: dict[int, list[tuple[int, int]]]
) -> list[Finding]:
    """Says per instance or in extras what each tree and each small decorator has.

    Args:
        container: Its buffer views are complete but for those added here.
        result: What was baked.
        placed: Per node its objects with their number within EXT_mesh_gpu_instancing, -1 for a plain node.
    """
    trees, scales = exported_trees(result), exported_scales(result)
    columns = result.settings.distance_count
    nodes = cast(list[dict[str, Any]], container.document.get("nodes", []))
    findings: list[Finding] = []
    for index, objects in sorted(placed.items()):
        concerned = [number for number, _ in objects if number in trees or number in scales]
        if not concerned:
            continue
        if objects[0][1] >= 0:
            ordered = [number for number, _ in sorted(objects, key=lambda pair: pair[1])]
            extension = nodes[index]["extensions"]["EXT_mesh_gpu_instancing"]
            for name, rows in instance_attributes(ordered, trees, scales, columns).items():
                extension["attributes"][name] = _add_floats(container, rows)
        elif not _say_in_extras(nodes[index], trees.get(concerned[0]), scales.get(concerned[0])):
            path = result.world.object_paths[concerned[0]]
            detail = "Its node's extras are no table, so that its AO is in the side file only."
            findings.append(Finding(path, "extras-left-alone", 1, detail))
    return findings


def instance_attributes(
    objects: list[int], trees: dict[int, ExportedTree], scales: dict[int, Float32Array], columns: int
) -> dict[str, Float32Array]:
    """Instance attributes by name, shape (n, components) each."""
    attributes: dict[str, Float32Array] = {}
    if any(number in trees for number in objects):
        for column in range(columns):
            rows = np.zeros((len(objects), 4), np.float32)
            rows[:, 0] = 1.0
            for row, number in enumerate(objects):
                if number in trees:
                    rows[row] = trees[number].coefficients[column]
            attributes["_AO_GLOBAL" if columns == 1 else f"_AO_GLOBAL_{column}"] = rows
        zero = np.zeros(3)
        centres = [trees[number].centre if number in trees else zero for number in objects]
        attributes["_AO_CENTRE"] = np.array(centres, np.float32)
    if any(number in scales for number in objects):
        one = np.ones(columns, np.float32)
        rows = np.array([scales.get(number, one) for number in objects], np.float32)
        if columns in _KINDS:
            attributes["_AO_SCALE"] = rows
        else:
            attributes |= {f"_AO_SCALE_{column}": rows[:, column : column + 1] for column in range(columns)}
    return attributes


def _say_in_extras(node: dict[str, Any], tree: ExportedTree | None, scale: Float32Array | None) -> bool:
    extras = node.setdefault("extras", {})
    if not isinstance(extras, dict):  # the format allows anything there
        return False
    baked: dict[str, Any] = {}
    if tree is not None:
        baked |= {"ao_global": plain_values(tree.coefficients), "ao_centre": tree.centre.tolist()}
    if scale is not None:
        baked["ao_scale"] = plain_values(scale)
    said = cast(dict[str, Any], extras).setdefault("obscura", {})
    said["baked"] = baked
    return True


def _add_floats(container: GltfContainer, rows: Float32Array) -> int:
    content = rows.astype("<f4").tobytes()
    view = {"buffer": 0, "byteOffset": container.append(Segment(len(content), content)), "byteLength": len(content)}
    accessor = {"bufferView": container.add("bufferViews", view), "componentType": _FLOAT, "count": len(rows)}
    return container.add("accessors", {**accessor, "type": _KINDS[rows.shape[1]]})
