"""Two published workloads made anew: as many triangles, samples, trees, boxes and points, of shapes of our own.

Neither level is public. What these share with them is the size of every stage's work, to a fraction of a percent.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from bake.arrays import Float64Array
from bake.bench.scaling_glb import Placed, write_scene
from bake.bench.synthetic import Geometry, height_field, joined
from bake.region_types import GRID
from bake.regions.region_document import bits_to_hex

SEED = 1

LEVEL_TREES, LEVEL_SHRUBS, LEVEL_POINTS = 46, 7_856, 332_741
SLED_TRIANGLES, SLED_MESHES = 418_036, 109

_WIDTH = 600.0  # metres of ground
_GROUND_CELLS, _GROUND_LOD_CELLS = 387, 274
_BUILDINGS, _KINDS, _BOXES = 1_389, 12, 10
_SIDE = 3  # cells along an edge of a side of a box
_WIDE_TREES = 33  # 252 voxels each at a spacing of a metre; the other kind has 270
_REGIONS = (26, 25)


def write_level(folder: Path, *, shrink: int = 1) -> tuple[Path, Path]:
    """The level of Table 1 of Sloan et al. 2013: the scene and its region file.

    1.48 million vertices and 1.80 million faces that take 6.70 million samples at the default of 4 a face; lower levels
    of detail of 0.65 and 0.80 million that take 5.70 million; 46 trees whose volume has 11,826 voxels, 7,856 shrubs,
    332,741 points in 650 regions.

    Args:
        folder: Where to.
        shrink: One in how many objects, regions and cells is made; for tests.
    """
    rng = np.random.default_rng(SEED)
    count = _BUILDINGS // shrink
    cells, coarse = round(_GROUND_CELLS / shrink**0.5), round(_GROUND_LOD_CELLS / shrink**0.5)
    meshes = {"ground": height_field(cells, _WIDTH), "ground lod": height_field(coarse, _WIDTH)}
    objects = [Placed("ground", "ground"), Placed("lod/ground", "ground lod", declared=_lod("ground", 7))]
    for kind in range(_KINDS):
        boxes = [_box(rng.uniform(2.0, 9.0, 3), rng.uniform((-7, -7, -1), (7, 7, 5)), _SIDE) for _ in range(_BOXES)]
        kept = 5 if kind % 3 == 0 else 4
        meshes |= {f"building {kind}": joined(boxes), f"building lod {kind}": joined(boxes[:kept])}
    places = np.column_stack([rng.uniform(-280.0, 280.0, (count, 2)), rng.uniform(-1.0, 2.0, count)])
    turns = rng.uniform(0.0, 2.0 * np.pi, count).tolist()
    for i, ((x, y, z), turn) in enumerate(zip(places.tolist(), turns, strict=True)):
        kind, name, at = i % _KINDS, f"building {i}", (x, y, z)
        objects.append(Placed(name, f"building {kind}", at, turn, {"samples": 3} if kind % 3 == 0 else {}))
        declared = _lod(name, 8 if i % 6 == 1 else 7)
        objects.append(Placed(f"lod/{name}", f"building lod {kind}", at, turn, declared))
    meshes |= {
        "wide tree": _leaves(rng, 400, np.array([4.9, 4.9, 5.9])),
        "tall tree": _leaves(rng, 400, np.array([3.9, 4.9, 7.9])),
        "shrub": _leaves(rng, 8, np.array([1.0, 1.0, 0.8])),
    }
    wide = _WIDE_TREES // shrink
    for i in range(max(1, LEVEL_TREES // shrink)):
        at = (80.0 * (i % 7) - 240.0, 80.0 * (i // 7) - 240.0, 2.0)  # whole metres: the voxels of each are its own
        objects.append(Placed(f"tree {i}", "wide tree" if i < wide else "tall tree", at, 0.0, {"role": "tree"}))
    shrubs = LEVEL_SHRUBS // shrink
    places = np.column_stack([rng.uniform(-290.0, 290.0, (shrubs, 2)), rng.uniform(-2.0, 2.0, shrubs)])
    objects += [Placed(f"shrub {i}", "shrub", (x, y, z), 0.0, {"role": "shrub"}) for i, (x, y, z) in
                enumerate(places.tolist())]  # fmt: skip
    scene, regions = write_scene(folder / "level.glb", meshes, objects), folder / "regions.json"
    regions.write_text(json.dumps({"regions": _regions(LEVEL_POINTS // shrink)}))
    return scene, regions


def write_sled(path: Path, *, meshes: int = SLED_MESHES) -> Path:
    """A machine of 109 meshes with 418,036 triangles, 13.5 m long, like the sled of NVIDIA's baking sample.

    Args:
        path: A .glb file.
        meshes: How many of the parts; the last holds what is left to the sum.
    """
    rng = np.random.default_rng(SEED)
    boxes, side = 20, 4  # 1,920 quads a part
    parts: dict[str, Geometry] = {}
    for number in range(meshes):
        centre = rng.uniform((-6.0, -1.5, 0.6), (6.0, 1.5, 2.0))
        last = number == SLED_MESHES - 1
        count = 17 if last else boxes
        sizes, at = rng.uniform(0.05, 0.8, (count, 3)), centre + rng.normal(0.0, 0.25, (count, 3))
        made = [_box(size, place, side) for size, place in zip(sizes, at, strict=True)]
        if last:
            made.append(_sheet(2, 13, centre))
        parts[f"part {number}"] = joined(made)
    return write_scene(path, parts, [Placed(name, name) for name in parts])


def _lod(of: str, samples: int) -> dict[str, Any]:
    return {"role": "lod", "of": of, "samples": samples}


def _box(size: Float64Array, centre: Float64Array, cells: int) -> Geometry:
    """A box whose sides have vertices of their own."""
    sides: list[Geometry] = []
    for axis in range(3):
        for end in (-0.5, 0.5):
            positions, faces = _grid(cells, cells)
            points = np.empty((len(positions), 3))
            points[:, axis] = end
            points[:, (axis + 1) % 3], points[:, (axis + 2) % 3] = positions.T - 0.5
            sides.append((points * size + centre, faces if end > 0.0 else faces[:, ::-1]))
    return joined(sides)


def _sheet(rows: int, columns: int, centre: Float64Array) -> Geometry:
    positions, faces = _grid(rows, columns)
    return np.column_stack([positions, np.zeros(len(positions))]) + centre, faces


def _grid(rows: int, columns: int) -> Geometry:
    """The unit square in cells: positions of shape (n, 2), faces of shape (2 · rows · columns, 3)."""
    u, v = np.meshgrid(np.linspace(0.0, 1.0, rows + 1), np.linspace(0.0, 1.0, columns + 1), indexing="ij")
    a = np.add.outer(np.arange(rows) * (columns + 1), np.arange(columns)).ravel()
    b, c, d = a + columns + 1, a + columns + 2, a + 1
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return np.column_stack([u.ravel(), v.ravel()]), faces.astype(np.int32)


def _leaves(rng: np.random.Generator, count: int, size: Float64Array) -> Geometry:
    """Small quads strewn in a box that they fill to its sides; the box begins a twentieth of a metre from zero."""
    centre = rng.uniform(0.0, 1.0, (count, 1, 3)) * size
    u, v = rng.normal(size=(2, count, 1, 3)) * 0.25
    corners: Float64Array = centre + np.concatenate([-u - v, u - v, u + v, v - u], axis=1)
    points = corners.reshape(-1, 3)
    low, high = points.min(axis=0), points.max(axis=0)
    halves = np.array([[0, 1, 2], [0, 2, 3]])
    faces = (4 * np.arange(count)[:, None, None] + halves).reshape(-1, 3).astype(np.int32)
    return (points - low) / (high - low) * size + 0.05, faces


def _regions(points: int) -> list[dict[str, Any]]:
    """Boxes over the level, y up, whose bits hold `points` valid points in all."""
    boxes: list[dict[str, Any]] = []
    wide, deep = _WIDTH / _REGIONS[0], _WIDTH / _REGIONS[1]
    for column, row in np.ndindex(_REGIONS):
        own = min(points - GRID**3 * len(boxes), GRID**3)
        if own <= 0:
            break
        x, z = column * wide - _WIDTH / 2.0, row * deep - _WIDTH / 2.0
        valid = np.arange(GRID**3) < own
        box = {"min": [x, 0.0, z], "max": [x + wide, 8.0, z + deep], "valid": bits_to_hex(valid)}
        boxes.append({"name": f"box {column}-{row}", **box})
    return boxes
