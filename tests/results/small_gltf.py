"""A small glTF level written by hand, with everything an export must not disturb."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

QUAD = np.float32([[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]])
UP = np.tile(np.float32([0, 1, 0]), (4, 1))
TRIANGLES = np.uint16([0, 2, 1, 0, 3, 2])
COLORS = np.tile(np.uint8([255, 128, 0, 255]), (4, 1))
SHIFTS = np.float32([[0, 0, 5], [0, 0, 6], [0, 0, 7]])
PIXEL = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)


def small_document(*, normals: bool = True) -> tuple[dict[str, Any], bytes]:
    """Two crates and a blocker sharing a mesh of two primitives, a row of instances, and odd but legal extras."""
    blocks = [QUAD, UP, TRIANGLES, COLORS, SHIFTS]
    views: list[dict[str, int]] = []
    binary = b""
    for block in blocks:
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": block.nbytes})
        binary += block.tobytes() + bytes(-block.nbytes % 4)
    surface = {"POSITION": 0, "NORMAL": 1} if normals else {"POSITION": 0}
    bounds = {"min": [0.0, 0.0, 0.0], "max": [1.0, 0.0, 1.0]}
    document = {
        "asset": {"version": "2.0", "generator": "hand ☂", "extras": {"studio": [1, 2.5]}},
        "extras": {"text": "kept"},
        "extensionsUsed": ["EXT_mesh_gpu_instancing", "MY_vendor"],
        "extensions": {"MY_vendor": {"kept": True}},
        "scene": 0,
        "scenes": [{"name": "main", "nodes": [0, 3, 4], "extras": {"x": 1e-7}}],
        "nodes": [
            {"name": "yard", "children": [1, 2]},
            {"name": "crate", "mesh": 0, "extras": {"id": 7}},
            {"name": "crate", "mesh": 0, "translation": [3, 0, 0]},
            {"name": "wall", "mesh": 0, "translation": [0, 2, 0], "extras": {"obscura": {"role": "blocker"}}},
            {"name": "row", "mesh": 1, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 4}}}},
        ],
        "meshes": [
            {
                "name": "crate",
                "primitives": [
                    {"attributes": {**surface, "COLOR_0": 3}, "indices": 2, "material": 0},
                    {"attributes": surface, "indices": 2, "extras": {"second": True}},
                ],
            },
            {"name": "tile", "primitives": [{"attributes": surface, "indices": 2}]},
        ],
        "materials": [{"name": "wood", "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 0.125, 1]}}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", **bounds},
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"},
            {"bufferView": 3, "componentType": 5121, "normalized": True, "count": 4, "type": "VEC4"},
            {"bufferView": 4, "componentType": 5126, "count": 3, "type": "VEC3"},
        ],
        "bufferViews": views,
        "buffers": [{"byteLength": len(binary)}],
    }
    return document, binary


def write_glb(path: Path, document: dict[str, Any], binary: bytes, *, trailing: bytes = b"") -> Path:
    """A GLB with its JSON padded by blanks and perhaps a chunk that nobody knows."""
    text = json.dumps(document, indent=1).encode()
    text += b" " * (-len(text) % 4)
    binary += bytes(-len(binary) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    body += trailing
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)
    return path


def write_gltf(folder: Path, document: dict[str, Any], binary: bytes) -> Path:
    """The same as `.gltf` with an external buffer, a second one in a data URI, and an image beside it."""
    (folder / "my level.bin").write_bytes(binary)
    (folder / "wood.png").write_bytes(PIXEL)
    shifts = base64.b64encode(SHIFTS.tobytes()).decode()
    document["buffers"] = [
        {"uri": "my%20level.bin", "byteLength": len(binary), "name": "first"},
        {"uri": f"data:application/octet-stream;base64,{shifts}", "byteLength": SHIFTS.nbytes},
    ]
    document["bufferViews"][4] = {"buffer": 1, "byteLength": SHIFTS.nbytes}
    document["images"] = [{"uri": "wood.png", "name": "wood"}, {"uri": "gone.png"}]
    path = folder / "level.gltf"
    path.write_text(json.dumps(document))
    return path


def split_glb(path: Path) -> tuple[dict[str, Any], bytes, bytes]:
    """JSON, binary chunk and what follows, read as the specification says."""
    content = path.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", content)
    assert (magic, version, length) == (b"glTF", 2, len(content))
    size, kind = struct.unpack_from("<II", content, 12)
    assert kind == 0x4E4F534A
    assert size % 4 == 0
    text = content[20 : 20 + size]
    binary_size, kind = struct.unpack_from("<II", content, 20 + size)
    assert kind == 0x004E4942
    assert binary_size % 4 == 0
    begin = 28 + size
    return json.loads(text), content[begin : begin + binary_size], content[begin + binary_size :]


def accessor(document: dict[str, Any], binary: bytes, index: int) -> np.ndarray:
    """An accessor of floats, shape (n, components)."""
    item = document["accessors"][index]
    view = document["bufferViews"][item["bufferView"]]
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[item["type"]]
    assert item["componentType"] == 5126
    stride = view.get("byteStride", 4 * width)
    offset = view.get("byteOffset", 0) + item.get("byteOffset", 0)
    assert offset + stride * (item["count"] - 1) + 4 * width <= view.get("byteOffset", 0) + view["byteLength"]
    return np.ndarray((item["count"], width), "<f4", binary, offset, (stride, 4)).copy()
