"""`.glb`: the level with AO as a vertex attribute.

From a glTF scene the source document is kept: its JSON apart from what must be added, its binary chunk byte for byte
as the beginning of the new one. From any other scene a new document is built (`glb_build`).

`_AO` is float, 1 open, 0 closed, one component a distance in the order of `asset.extras.obscura.distances`: SCALAR,
VEC2, VEC3 or VEC4 for one to four distances, and `_AO_0`, `_AO_1` … SCALAR each for more. `COLOR_0`, which glTF
defines as a multiplier of the base colour, is written only on request, as linear grey; a `COLOR_0` that was there
moves to the next free `COLOR_n`.

AO belongs to a placed object, a glTF mesh may be placed often: every object but the first gets its own copy of the
mesh's JSON, sharing all its accessors but the AO. Nodes of EXT_mesh_gpu_instancing cannot say anything per vertex and
instance: they get the mean AO of each instance as instance attribute `_AO`, and a side file
`NAME.instances.json` with the same by object path. Trees and small decorators are said as `glb_decorators` tells, and
by object path in the side file `NAME.decorators.json`.
"""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any, cast

import numpy as np

from bake.errors import InputError, ResultError
from bake.results.arrays import file_sha256
from bake.results.exported_ao import object_means, open_where_unbaked
from bake.results.exported_decorators import decorators_by_path, exported_trees
from bake.results.glb_attributes import AoWriter, SourceLayout
from bake.results.glb_build import build_document
from bake.results.glb_container import read_container
from bake.results.glb_decorators import annotate_nodes, annotate_tree_meshes
from bake.results.glb_placing import place_nodes
from bake.results.storage import replacing
from bake.types import BakeResult, Finding, Scene, SceneObject


def write_glb_export(
    result: BakeResult, path: Path, column: int, *, color: bool, scene: Scene | None
) -> tuple[Finding, ...]:
    """Writes the level with its AO.

    Args:
        result: What was baked.
        path: The file.
        column: The AO column for `COLOR_0`.
        color: Whether to write `COLOR_0`.
        scene: The scene as loaded from its file, if that is a glTF file.

    Returns:
        What could not be expressed.

    Raises:
        InputError: a glTF scene was not given.
        ResultError: the scene's files changed since the bake, or do not fit the result.
        StorageError: the file could not be written.
    """
    instance_means: dict[str, list[float]] = {}
    findings: list[Finding] = []
    placed: dict[int, list[tuple[int, int]]] = {}
    if result.scene_path.suffix.lower() not in (".glb", ".gltf"):
        container, drawn = build_document(result)
        writer = AoWriter(container, result, column if color else None)
        trees = exported_trees(result)
        for object_index, mesh in zip(drawn, container.document.get("meshes", []), strict=True):
            if object_index in trees and result.decorators is not None:
                local_ao = result.decorators.models[trees[object_index].model].local_ao
                writer.add_values_to_mesh(mesh, local_ao, None, result.world.object_paths[object_index])
            else:
                writer.add_to_mesh(mesh, object_index, None)
        placed = {1 + place: [(number, -1)] for place, number in enumerate(drawn)}  # node 0 is the root
    else:
        if scene is None:
            raise InputError("needs the scene it was baked from", where=str(path))
        _check_unchanged(result)
        container = read_container(result.scene_path)
        findings += [
            Finding(uri, "image-left-out", 1, "The image is not there, so the export still refers to it.")
            for uri in container.left_out
        ]
        scene, place_findings = place_nodes(container, scene)
        findings += place_findings
        writer = AoWriter(container, result, column if color else None)
        _annotate(writer, scene)
        instance_means, instance_findings = _annotate_instances(writer, scene)
        findings += instance_findings
        annotate_tree_meshes(writer, scene)
        for item in scene.objects:
            if item.path in writer.object_numbers and item.node >= 0:
                placed.setdefault(item.node, []).append((writer.object_numbers[item.path], item.node_instance))
    writer.finish()
    findings += annotate_nodes(container, result, placed)
    with replacing(path) as file:
        container.write(file)
    if instance_means:
        distances = list(result.settings.column_distances)
        side = {"attribute": "_AO", "distances": distances, "instances": instance_means}
        with replacing(path.with_name(f"{path.stem}.instances.json")) as file:
            file.write(json.dumps(side, indent=1, ensure_ascii=False).encode())
    if result.decorators is not None:
        text = json.dumps(decorators_by_path(result), indent=1, ensure_ascii=False, allow_nan=False)
        with replacing(path.with_name(f"{path.stem}.decorators.json")) as file:
            file.write(text.encode())
    return tuple(findings)


def _check_unchanged(result: BakeResult) -> None:
    for name, digest in result.files.items():
        path = result.scene_path.parent / name
        try:
            now = file_sha256(path)
        except OSError:
            now = ""
        if now == digest:
            continue
        what = "has changed since the bake" if now else "is missing"
        raise ResultError(what, where=str(path), remedy="bake again, or export to .npz or .ply")


def _annotate(writer: AoWriter, scene: Scene) -> None:
    """Adds AO to the nodes of the source document that place one object each."""
    document = writer.container.document
    number = writer.object_numbers
    baked_nodes = {
        item.node: item
        for item in scene.objects
        if item.node_instance < 0 and item.path in number and writer.has_values(number[item.path])
    }
    nodes = cast(list[dict[str, Any]], document.get("nodes", []))
    meshes = cast(list[dict[str, Any]], document.get("meshes", []))
    mesh_of: dict[int, int] = {index: node["mesh"] for index, node in enumerate(nodes) if "mesh" in node}
    # A mesh that a node without AO uses too must stay without.
    taken = {mesh for index, mesh in mesh_of.items() if index not in baked_nodes}
    originals = {mesh_of[index]: copy.deepcopy(meshes[mesh_of[index]]) for index in baked_nodes}
    for index, item in sorted(baked_nodes.items()):
        mesh = mesh_of[index]
        target = mesh
        if mesh in taken:
            target = nodes[index]["mesh"] = writer.container.add("meshes", copy.deepcopy(originals[mesh]))
        taken.add(mesh)
        source = scene.meshes[item.mesh]
        layout = SourceLayout(source.primitives, source.source_vertex)
        writer.add_to_mesh(meshes[target], number[item.path], layout)


def _annotate_instances(writer: AoWriter, scene: Scene) -> tuple[dict[str, list[float]], list[Finding]]:
    """Gives the instances of EXT_mesh_gpu_instancing their mean AO; returns it by object path, too."""
    number = writer.object_numbers
    members: dict[int, list[SceneObject]] = {}
    for item in scene.objects:
        if item.node_instance >= 0:
            members.setdefault(item.node, []).append(item)
    means: dict[str, list[float]] = {}
    findings: list[Finding] = []
    mean_ao = open_where_unbaked(object_means(writer.result).astype(np.float32)) if members else None
    for node, items in sorted(members.items()):
        items.sort(key=lambda item: item.node_instance)
        baked = [item.path in number and writer.has_values(number[item.path]) for item in items]
        if mean_ao is None or not any(baked):
            continue
        values = np.ones((len(items), writer.columns), np.float32)
        for row, (item, has_value) in enumerate(zip(items, baked, strict=True)):
            if has_value:
                values[row] = mean_ao[number[item.path]]
                means[item.path] = [round(float(value), 6) for value in values[row]]
        extension = writer.container.document["nodes"][node]["extensions"]["EXT_mesh_gpu_instancing"]
        extension["attributes"].update(writer.add_values(values))
        detail = "Instances of EXT_mesh_gpu_instancing share their vertices: each carries only its mean AO."
        findings.append(Finding(items[0].path, "instances-carry-their-mean", sum(baked), detail))
    return means, findings
