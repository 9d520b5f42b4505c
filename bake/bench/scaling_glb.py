"""Writes made-up scenes of many placed meshes as GLB: read without any library besides NumPy, z up turned to y up."""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bake.bench.synthetic import Geometry


@dataclass(frozen=True, slots=True)
class Placed:
    """One object of a made-up scene.

    Attributes:
        name: Its path in the scene.
        mesh: Key of its geometry.
        at: Where the mesh's zero lies, metres, z up.
        turn: Radians about z.
        declared: Role and keys, as `extras.obscura` holds them.
    """

    name: str
    mesh: str
    at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn: float = 0.0
    declared: Mapping[str, Any] = field(default_factory=dict[str, Any])


def write_scene(path: Path, meshes: Mapping[str, Geometry], objects: Sequence[Placed]) -> Path:
    """Writes meshes once each, without normals or materials, and a node an object; returns the path.

    Args:
        path: A .glb file.
        meshes: Geometry by name, z up, metres.
        objects: In scene order.
    """
    parts: list[bytes] = []
    views: list[dict[str, Any]] = []
    accessors: list[dict[str, Any]] = []
    length = 0
    for positions, faces in meshes.values():
        points = (positions[:, [0, 2, 1]] * (1.0, 1.0, -1.0)).astype("<f4")
        ends = {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()}
        corners = faces.astype("<u4").ravel()
        for array, kind, component, more in ((points, "VEC3", 5126, ends), (corners, "SCALAR", 5125, {})):
            accessors.append(
                {"bufferView": len(views), "componentType": component, "count": len(array), "type": kind, **more}
            )
            views.append({"buffer": 0, "byteOffset": length, "byteLength": array.nbytes})
            parts.append(np.ascontiguousarray(array).tobytes())
            length += array.nbytes
    number = {name: i for i, name in enumerate(meshes)}
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [*range(len(objects))]}],
        "nodes": [_node(item, number[item.mesh]) for item in objects],
        "meshes": [
            {"name": name, "primitives": [{"attributes": {"POSITION": 2 * i}, "indices": 2 * i + 1}]}
            for name, i in number.items()
        ],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": length}],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    with path.open("wb") as file:
        file.write(struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + length))
        file.write(struct.pack("<I4s", len(text), b"JSON") + text)
        file.write(struct.pack("<I4s", length, b"BIN\0"))
        for part in parts:  # all of four bytes each
            file.write(part)
    return path


def _node(item: Placed, mesh: int) -> dict[str, Any]:
    x, y, z = item.at
    node: dict[str, Any] = {"name": item.name, "mesh": mesh, "translation": [x, z, -y]}
    if item.turn:
        node["rotation"] = [0.0, math.sin(item.turn / 2.0), 0.0, math.cos(item.turn / 2.0)]
    if item.declared:
        node["extras"] = {"obscura": dict(item.declared)}
    return node
