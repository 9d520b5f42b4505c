"""Objects that a side file moved or made: in an exported document they stand where they were baked."""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import Any, cast

from bake.results.glb_container import GltfContainer
from bake.types import Finding, Scene, SceneObject


def place_nodes(container: GltfContainer, scene: Scene) -> tuple[Scene, list[Finding]]:
    """Moves the nodes of objects that the side file moved, and adds nodes for the copies that it made.

    A moved object keeps its node, which becomes a root of the scene; what hangs below that node in the file hangs below
    a new one in its old place.

    Args:
        container: The source document, unchanged so far.
        scene: As loaded.

    Returns:
        The scene with the nodes of its copies, and what could not be expressed.
    """
    document = container.document
    objects: list[SceneObject] = []
    left: list[str] = []
    node_of = {item.path: item.node for item in scene.objects}
    for item in scene.objects:
        if item.copy_of:
            node_of[item.path] = node = _add_copy(container, item, node_of.get(item.copy_of, -1))
            objects.append(replace(item, node=node))
            continue
        if item.placing is not None and not item.placing.is_as_stored and item.node >= 0:
            if item.node_instance >= 0:
                left.append(item.path)
            else:
                _detach(container, item)
        objects.append(item)
    findings: list[Finding] = []
    if left:
        detail = "Instances of EXT_mesh_gpu_instancing that the side file moves stay where the file has them."
        findings.append(Finding(left[0], "moved-instances-stay", len(left), detail))
    document.setdefault("nodes", [])
    return replace(scene, objects=tuple(objects)), findings


def _matrix(item: SceneObject) -> list[float]:
    return [float(value) for value in item.transform.T.ravel()]  # glTF stores columns


def _roots(document: dict[str, Any]) -> list[int]:
    scenes = cast("list[dict[str, Any]]", document.setdefault("scenes", [{}]))
    return cast("list[int]", scenes[int(document.get("scene", 0))].setdefault("nodes", []))


def _detach(container: GltfContainer, item: SceneObject) -> None:
    document = container.document
    nodes = cast("list[dict[str, Any]]", document["nodes"])
    node = nodes[item.node]
    if node.get("children"):
        rest = {name: copy.deepcopy(node[name]) for name in node if name not in ("mesh", "skin", "weights", "extras")}
        node.pop("children")
        stand_in = [container.add("nodes", rest)]
    else:
        stand_in = []
    scenes = cast("list[dict[str, Any]]", document.get("scenes", []))
    for owner, name in (*((scene, "nodes") for scene in scenes), *((other, "children") for other in nodes)):
        listed = cast("list[int]", owner.get(name, []))
        if item.node in listed and owner is not node:
            where = listed.index(item.node)
            owner[name] = [*listed[:where], *stand_in, *listed[where + 1 :]]
            if not owner[name] and name == "children":
                owner.pop(name)
    for name in ("translation", "rotation", "scale"):
        node.pop(name, None)
    node["matrix"] = _matrix(item)
    _roots(document).append(item.node)


def _add_copy(container: GltfContainer, item: SceneObject, original: int) -> int:
    nodes = cast("list[dict[str, Any]]", container.document["nodes"])
    if original < 0:
        return -1
    kept = {name: copy.deepcopy(nodes[original][name]) for name in ("mesh", "extras") if name in nodes[original]}
    number = container.add("nodes", {"name": item.path.rpartition("/")[2], **kept, "matrix": _matrix(item)})
    _roots(container.document).append(number)
    return number
