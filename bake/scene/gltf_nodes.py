"""The node tree of a glTF file → placements in scene order (depth first, as the file lists children)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bake.errors import SceneError
from bake.scene.gltf_buffers import GltfBuffers
from bake.scene.gltf_document import GltfDocument
from bake.scene.json_cursor import JsonCursor
from bake.scene.parsed import Placement, number_repeats
from bake.types import Finding, Float64Array

IDENTITY = np.eye(4)
LONGEST_PATH = 65_536  # characters; a chain of a million nodes would otherwise take quadratic time
MOST_INSTANCES = 2_000_000  # objects, each with a path and a transform of its own


RESULT_KEY = "baked"
"""Within `extras.obscura`: what an export of a result says about the node; it declares nothing."""


@dataclass(frozen=True, slots=True)
class _Visit:
    """A node still to be visited, with what it inherits."""

    node: JsonCursor
    parent_path: str
    parent_transform: Float64Array
    declared: dict[str, Any]


def read_placements(document: GltfDocument, buffers: GltfBuffers) -> tuple[list[Placement], list[Finding]]:
    """Every placed mesh of the default scene, or of the root nodes where the file has no scene.

    What a node's `extras.obscura` declares holds for its whole subtree, until a node below says otherwise.
    `Placement.mesh` is the file's mesh index.

    Raises:
        SceneError: a cycle, a node with two parents, a malformed transform, or extras that are no table.
    """
    placements: list[Placement] = []
    findings: list[Finding] = []
    nodes = document.root.get("nodes", [])
    visited = [False] * len(nodes.items())
    waiting = [_Visit(node, "", IDENTITY, {}) for node in reversed(_roots(document, findings))]
    while waiting:
        visit = waiting.pop()
        index = int(visit.node.place[len("nodes[") : -1])
        if visited[index]:
            raise document.wrong(
                f"node {index} is reached twice: the node tree has a cycle or a node with two parents",
                remedy="export the scene again",
            )
        visited[index] = True
        path = _node_path(visit, index)
        if len(path) > LONGEST_PATH:
            raise document.wrong(f"the path of node {index} has {len(path)} characters", remedy="flatten the node tree")
        transform = visit.parent_transform @ _local_transform(visit.node)
        if not np.isfinite(transform).all():
            raise SceneError("the node's transform overflows", where=f"{document.root.file}: {path}")
        declared = visit.declared | _declared(visit.node, path)
        if visit.node.has("mesh"):
            placements += _placements_of(visit.node, index, path, transform, declared, buffers)
            findings += _skin_findings(visit.node, path)
            if len(placements) > MOST_INSTANCES:
                raise document.wrong(f"the scene has more than {MOST_INSTANCES} objects", remedy="split it")
        children = [nodes.element(child) for child in visit.node.get("children", []).items()]
        waiting += [_Visit(child, path, transform, declared) for child in reversed(children)]
    unique = number_repeats([placement.path for placement in placements])
    return [replace(item, path=path) for item, path in zip(placements, unique, strict=True)], findings


def _roots(document: GltfDocument, findings: list[Finding]) -> list[JsonCursor]:
    nodes, scenes = document.root.get("nodes", []), document.root.get("scenes", [])
    scene_list = scenes.items()
    if not scene_list:
        held = {child.integer(low=0) for node in nodes.items() for child in node.get("children", []).items()}
        return [node for index, node in enumerate(nodes.items()) if index not in held]
    chosen = scenes.element(document.root.get("scene", 0))
    if len(scene_list) > 1:
        findings.append(
            Finding(
                document.ledger.scene.name,
                "other-scenes",
                len(scene_list) - 1,
                f"The file holds {len(scene_list)} scenes; {chosen.place}, the default, is baked.",
                "info",
            )
        )
    return [nodes.element(root) for root in chosen.get("nodes", []).items()]


def _node_path(visit: _Visit, index: int) -> str:
    name = visit.node.get("name", "").text() or f"node_{index}"
    return f"{visit.parent_path}/{name}" if visit.parent_path else name


def _local_transform(node: JsonCursor) -> Float64Array:
    """The node's own matrix, or its translation, rotation and scale (glTF 2.0 specification, section 3.5.2)."""
    if node.has("matrix"):
        matrix = node.get("matrix").numbers(16).reshape(4, 4).T
        if np.abs(matrix[3] - (0.0, 0.0, 0.0, 1.0)).max() > 1e-6:
            raise node.get("matrix").wrong("an affine transform (last row 0 0 0 1)")
        return matrix
    translation = node.get("translation", [0.0, 0.0, 0.0]).numbers(3)
    rotation = node.get("rotation", [0.0, 0.0, 0.0, 1.0]).numbers(4)
    scale = node.get("scale", [1.0, 1.0, 1.0]).numbers(3)
    if not np.abs(rotation).max() > 0.0:
        raise node.get("rotation").wrong("a rotation (its quaternion is zero)")
    return compose(translation[None], rotation[None], scale[None])[0]


def compose(translation: Float64Array, rotation: Float64Array, scale: Float64Array) -> Float64Array:
    """Matrices T·R·S, shape (n, 4, 4), from (n, 3) translations, (n, 4) quaternions xyzw and (n, 3) scales.

    Quaternions need not have unit length.
    """
    x, y, z, w = (rotation / np.abs(rotation).max(axis=1, keepdims=True)).T
    double = 2.0 / (x * x + y * y + z * z + w * w)
    matrices = np.zeros((len(translation), 4, 4))
    matrices[:, 0, :3] = np.stack(
        (1 - double * (y * y + z * z), double * (x * y - w * z), double * (x * z + w * y)), axis=1
    )
    matrices[:, 1, :3] = np.stack(
        (double * (x * y + w * z), 1 - double * (x * x + z * z), double * (y * z - w * x)), axis=1
    )
    matrices[:, 2, :3] = np.stack(
        (double * (x * z - w * y), double * (y * z + w * x), 1 - double * (x * x + y * y)), axis=1
    )
    matrices[:, :3, :3] *= scale[:, None, :]
    matrices[:, :3, 3] = translation
    matrices[:, 3, 3] = 1.0
    return matrices


def _declared(node: JsonCursor, path: str) -> dict[str, Any]:
    """What the node's extras say about the object."""
    if not isinstance(node.get("extras", {}).value, dict):
        return {}  # extras may be anything; only a table can hold ours
    declared = node.get("extras", {}).get("obscura", {})
    if not isinstance(declared.value, dict):
        raise SceneError(
            "extras.obscura is no table",
            where=f"{node.file}: {path}",
            remedy='write {"obscura": {"role": "tree"}}',
        )
    return {name: value for name, value in declared.object().items() if name != RESULT_KEY}


def _placements_of(
    node: JsonCursor,
    index: int,
    path: str,
    transform: Float64Array,
    declared: dict[str, Any],
    buffers: GltfBuffers,
) -> list[Placement]:
    mesh = node.get("mesh").integer(low=0)
    instancing = node.get("extensions", {}).get("EXT_mesh_gpu_instancing")
    if instancing.value is None:
        return [Placement(path, path, mesh, transform, index, -1, declared)]
    local = _instance_transforms(instancing, buffers)
    with np.errstate(all="ignore"):
        world = transform @ local
    if not np.isfinite(world).all():
        raise SceneError("an instance has no finite transform", where=f"{node.file}: {path}")
    return [Placement(path, path, mesh, matrix, index, i, declared) for i, matrix in enumerate(world)]


def _instance_transforms(instancing: JsonCursor, buffers: GltfBuffers) -> Float64Array:
    """Shape (n, 4, 4): the transforms of EXT_mesh_gpu_instancing."""
    attributes = instancing.get("attributes", {})
    counts = {buffers.count(accessor) for _, accessor in attributes.members()}
    if len(counts) != 1:
        raise attributes.wrong("a set of attributes with one common count")
    count = counts.pop()
    if count > MOST_INSTANCES:
        raise attributes.wrong(f"at most {MOST_INSTANCES} instances")

    def column(name: str, width: int, default: tuple[float, ...], *, quantized: bool = False) -> Float64Array:
        if attributes.has(name):
            return buffers.floats(attributes.get(name), width, quantized=quantized)
        return np.tile(default, (count, 1))

    translation = column("TRANSLATION", 3, (0.0, 0.0, 0.0))
    rotation = column("ROTATION", 4, (0.0, 0.0, 0.0, 1.0), quantized=True)
    scale = column("SCALE", 3, (1.0, 1.0, 1.0))
    finite = np.isfinite(rotation).all(axis=1) & (np.abs(rotation).max(axis=1, initial=0.0) > 0.0)
    if not finite.all():
        raise SceneError(
            f"instance {int(np.argmin(finite))} has no valid rotation",
            where=f"{instancing.file}: {instancing.place}",
            remedy="export the scene again",
        )
    return compose(translation, rotation, scale)


def _skin_findings(node: JsonCursor, path: str) -> list[Finding]:
    if not node.has("skin"):
        return []
    return [Finding(path, "skinned", 1, "The object is skinned: it is baked in its bind pose.", "info")]
