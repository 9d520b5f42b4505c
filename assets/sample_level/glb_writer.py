"""A level as a binary glTF 2.0 file (Khronos Group, glTF 2.0 specification, section 4)."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from assets.sample_level.level import Level, Node
from assets.sample_level.mesh import NORMAL_STEP, POSITION_STEP, Part, quantised

_FLOAT, _USHORT, _UINT = 5126, 5123, 5125
_VERTEX_DATA, _INDEX_DATA = 34962, 34963
_IDENTITY = {"translation": (0, 0, 0), "rotation": (0, 0, 0, 1), "scale": (1, 1, 1)}


class _Buffer:
    """The binary chunk and the views and accessors into it."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def view(self, raw: bytes, target: int = 0) -> int:
        self.data += b"\0" * (-len(self.data) % 4)
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(raw)}
        self.views.append({**view, "target": target} if target else view)
        self.data += raw
        return len(self.views) - 1

    def accessor(self, array: NDArray[Any], target: int = 0, *, bounds: bool = False) -> int:
        kinds = {"float32": _FLOAT, "uint16": _USHORT, "uint32": _UINT}
        shape = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}[array.shape[1] if array.ndim == 2 else 1]
        accessor: dict[str, Any] = {
            "bufferView": self.view(array.astype(array.dtype.newbyteorder("<")).tobytes(), target),
            "componentType": kinds[array.dtype.name],
            "count": len(array),
            "type": shape,
        }
        if bounds:
            accessor |= {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
        self.accessors.append(accessor)
        return len(self.accessors) - 1


def write_glb(path: Path, level: Level, materials: dict[str, dict[str, Any]], images: dict[str, bytes]) -> None:
    """Writes the level.

    Args:
        path: Where to.
        level: What.
        materials: glTF materials by name; a texture is given by the name of its image under `index`.
        images: PNG files by name.
    """
    buffer = _Buffer()
    material_index = {name: i for i, name in enumerate(materials)}
    meshes = [
        {"name": name, "primitives": [_primitive(buffer, part, material_index) for part in parts]}
        for name, parts in level.meshes.items()
    ]
    nodes: list[dict[str, Any]] = []
    mesh_index = {name: i for i, name in enumerate(level.meshes)}
    root = _add_node(nodes, level.root, mesh_index, buffer)
    image_index = {name: i for i, name in enumerate(images)}
    document = {
        "asset": {"version": "2.0", "generator": "Obscura sample level", "copyright": "CC0 1.0"},
        "extensionsUsed": ["EXT_mesh_gpu_instancing"],
        "scene": 0,
        "scenes": [{"name": level.root.name, "nodes": [root]}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [{"name": name, **_with_textures(m, image_index)} for name, m in materials.items()],
        "textures": [{"source": i, "sampler": 0} for i in range(len(images))],
        "samplers": [{"wrapS": 10497, "wrapT": 10497}],
        "images": [
            {"name": name, "mimeType": "image/png", "bufferView": buffer.view(png)} for name, png in images.items()
        ],
        "bufferViews": buffer.views,
        "accessors": buffer.accessors,
        "buffers": [{"byteLength": len(buffer.data)}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    chunks = [
        (b"JSON", text + b" " * (-len(text) % 4)),
        (b"BIN\0", bytes(buffer.data) + b"\0" * (-len(buffer.data) % 4)),
    ]
    body = b"".join(struct.pack("<I4s", len(chunk), kind) + chunk for kind, chunk in chunks)
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)


def _primitive(buffer: _Buffer, part: Part, material_index: dict[str, int]) -> dict[str, Any]:
    positions = quantised(part.positions, POSITION_STEP).astype(np.float32)
    normals = quantised(part.normals, NORMAL_STEP).astype(np.float32)
    attributes = {
        "POSITION": buffer.accessor(positions, _VERTEX_DATA, bounds=True),
        "NORMAL": buffer.accessor(normals + np.float32(0), _VERTEX_DATA),  # + 0 turns -0 into 0
    }
    if part.uvs is not None:
        attributes["TEXCOORD_0"] = buffer.accessor(quantised(part.uvs, POSITION_STEP).astype(np.float32), _VERTEX_DATA)
    small = np.uint16 if len(positions) < 65535 else np.uint32
    indices = buffer.accessor(part.faces.reshape(-1).astype(small), _INDEX_DATA)
    return {"attributes": attributes, "indices": indices, "material": material_index[part.material]}


def _add_node(nodes: list[dict[str, Any]], node: Node, mesh_index: dict[str, int], buffer: _Buffer) -> int:
    entry: dict[str, Any] = {"name": node.name}
    nodes.append(entry)
    index = len(nodes) - 1
    if node.mesh:
        entry["mesh"] = mesh_index[node.mesh]
    for key, identity in _IDENTITY.items():
        value = tuple(round(float(v), 6) + 0.0 for v in getattr(node, key))
        if value != identity:
            entry[key] = value
    if node.extras:
        entry["extras"] = node.extras
    if node.instances is not None:
        arrays = {
            "TRANSLATION": node.instances.translations,
            "ROTATION": node.instances.rotations,
            "SCALE": node.instances.scales,
        }
        attributes = {
            key: buffer.accessor(quantised(array, NORMAL_STEP).astype(np.float32)) for key, array in arrays.items()
        }
        entry["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    children = [_add_node(nodes, child, mesh_index, buffer) for child in node.children]
    if children:
        entry["children"] = children
    return index


def _with_textures(value: Any, image_index: dict[str, int]) -> Any:
    """The material with image names under `index` replaced by texture numbers."""
    if isinstance(value, dict):
        return {k: image_index[v] if k == "index" else _with_textures(v, image_index) for k, v in value.items()}
    return value
