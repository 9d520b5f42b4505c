"""A level of a million triangles in hundreds of objects, made on the spot, with boxes for two hundred regions."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

from bake.bench.synthetic import Geometry, cube, height_field, octahedron, subdivided

OBJECTS = 301
REGIONS = (20, 10)
"""Boxes along either side of the ground."""

_CELLS, _WIDTH = 540, 200.0
_BOX_LOW, _BOX_HIGH = -4.0, 9.0


def write_large_level(folder: Path) -> tuple[Path, Path]:
    """Writes the scene as GLB, y up and in metres, and its regions as JSON; returns both files.

    A rolling ground of 583,200 triangles, and 150 spheres of 2,048 and 150 boxes of 768 half sunk into it.
    """
    random = np.random.default_rng(1)
    objects = [("ground", _turned(height_field(_CELLS, _WIDTH)))]
    for number in range(OBJECTS - 1):
        if number % 2 == 0:
            name, (positions, faces) = "sphere", subdivided(octahedron(), 4, radius=random.uniform(1.0, 4.0))
        else:
            name, (positions, faces) = "box", subdivided(cube(), 3)
            positions = positions * random.uniform(2.0, 8.0, 3)
        centre = np.append(random.uniform(-90.0, 90.0, 2), random.uniform(-2.0, 4.0))
        objects.append((f"{name} {number}", _turned((positions + centre, faces))))
    scene, regions = folder / "large.glb", folder / "large-regions.json"
    write_glb(scene, objects)
    regions.write_text(json.dumps({"regions": _boxes()}))
    return scene, regions


def write_glb(path: Path, objects: list[tuple[str, Geometry]]) -> None:
    """Writes named meshes, a node each, without normals or materials."""
    parts: list[bytes] = []
    views: list[dict[str, Any]] = []
    accessors: list[dict[str, Any]] = []
    length = 0
    for _, (positions, faces) in objects:
        points, corners = positions.astype("<f4"), faces.astype("<u4")
        ends = {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()}
        for array, kind, component, more in ((points, "VEC3", 5126, ends), (corners.ravel(), "SCALAR", 5125, {})):
            accessors.append(
                {"bufferView": len(views), "componentType": component, "count": len(array), "type": kind, **more}
            )
            views.append({"buffer": 0, "byteOffset": length, "byteLength": array.nbytes})
            parts.append(array.tobytes())
            length += array.nbytes
    numbers = range(len(objects))
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [*numbers]}],
        "nodes": [{"name": name, "mesh": number} for number, (name, _) in enumerate(objects)],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 2 * n}, "indices": 2 * n + 1}]} for n in numbers],
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


def _turned(geometry: Geometry) -> Geometry:
    """From z up to y up."""
    positions, faces = geometry
    return positions[:, [0, 2, 1]] * (1.0, 1.0, -1.0), faces


def _boxes() -> list[dict[str, Any]]:
    columns, rows = REGIONS
    wide, deep = _WIDTH / columns, _WIDTH / rows
    boxes: list[dict[str, Any]] = []
    for column, row in np.ndindex(columns, rows):
        x, z = column * wide - _WIDTH / 2, row * deep - _WIDTH / 2
        low, high = [x, _BOX_LOW, z], [x + wide, _BOX_HIGH, z + deep]
        boxes.append({"name": f"box {column}-{row}", "min": low, "max": high})
    return boxes
