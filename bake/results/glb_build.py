"""A new glTF document from a baked world, for scenes that were no glTF files."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.results.glb_container import GltfContainer, Segment
from bake.types import BakeResult

_FLOAT, _UINT32 = 5126, 5125
_VERTICES, _INDICES = 34962, 34963


def build_document(result: BakeResult) -> tuple[GltfContainer, list[int]]:
    """One mesh and one node for every object that has faces, in scene order, without materials.

    Positions stay float32 relative to the world's origin, which the root node adds. Axes are as in the scene's file.

    Returns:
        The document, and the object that each of its meshes stands for.
    """
    world = result.world
    container = GltfContainer({"asset": {"version": "2.0", "generator": "Obscura"}})
    drawn = np.flatnonzero(np.diff(world.first_face)).tolist()
    if not drawn:
        return container, drawn
    local_faces = world.faces - world.first_vertex[world.face_object, None]
    views = [
        _view(container, world.positions.astype("<f4"), 12, _VERTICES),
        _view(container, world.normals.astype("<f4"), 12, _VERTICES),
        _view(container, local_faces.astype("<u4"), None, _INDICES),
    ]
    names = [world.object_paths[index] for index in drawn]
    children = list(range(1, len(drawn) + 1))
    root = {"name": result.scene_path.stem, "translation": world.origin.tolist(), "children": children}
    container.document |= {
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [root, *({"name": name, "mesh": mesh} for mesh, name in enumerate(names))],
        "meshes": [
            {"name": name, "primitives": [_primitive(container, result, index, views)]}
            for name, index in zip(names, drawn, strict=True)
        ],
    }
    return container, drawn


def _primitive(container: GltfContainer, result: BakeResult, index: int, views: list[int]) -> dict[str, Any]:
    world = result.world
    first_vertex, last_vertex = world.first_vertex[index : index + 2].tolist()
    first_face, last_face = world.first_face[index : index + 2].tolist()
    positions = world.positions[first_vertex:last_vertex].astype(np.float32)
    normals = world.normals[first_vertex:last_vertex]
    vertices: dict[str, Any] = {"byteOffset": 12 * first_vertex, "componentType": _FLOAT, "type": "VEC3"}
    vertices["count"] = len(positions)
    bounds = {"min": positions.min(axis=0).tolist(), "max": positions.max(axis=0).tolist()}
    attributes = {"POSITION": container.add("accessors", {"bufferView": views[0], **vertices, **bounds})}
    if bool((np.abs(np.linalg.norm(normals, axis=1) - 1.0) < 1e-3).all()):
        attributes["NORMAL"] = container.add("accessors", {"bufferView": views[1], **vertices})
    indices = {
        "bufferView": views[2],
        "byteOffset": 12 * first_face,
        "componentType": _UINT32,
        "count": 3 * (last_face - first_face),
        "type": "SCALAR",
    }
    return {"attributes": attributes, "indices": container.add("accessors", indices)}


def _view(container: GltfContainer, rows: NDArray[Any], stride: int | None, target: int) -> int:
    content = rows.tobytes()
    view: dict[str, Any] = {"buffer": 0, "byteOffset": container.append(Segment(len(content), content))}
    view["byteLength"] = len(content)
    if stride is not None:
        view["byteStride"] = stride
    return container.add("bufferViews", {**view, "target": target})
