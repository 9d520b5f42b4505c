"""Made-up scenes of a wanted number of triangles or of objects, to see how each stage's time grows with them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bake.bench.scaling_glb import Placed, write_scene
from bake.bench.synthetic import field_with_props, height_field, octahedron, subdivided

SEED = 1

_PROPS = 300
_SPACING = 4.0  # metres between balls
_BALL = 128  # triangles
_GROUND = 8  # cells along an edge


def write_field(path: Path, triangles: int) -> Path:
    """One mesh of soup: a field 200 m wide with 300 props half sunk into it, `triangles` in all within a few percent.

    The props hold at most four fifths of them; they are subdivided as finely as that allows.
    """
    subdivisions, props = 3, _PROPS
    while subdivisions and _prop_triangles(subdivisions) * props > 0.8 * triangles:
        subdivisions -= 1
    props = min(props, int(0.8 * triangles / _prop_triangles(subdivisions)))
    cells = max(2, round(((triangles - _prop_triangles(subdivisions) * props) / 2.0) ** 0.5))
    geometry = field_with_props(cells, props, seed=SEED, subdivisions=subdivisions)
    return write_scene(path, {"field": geometry}, [Placed("field", "field")])


def write_instances(path: Path, count: int) -> Path:
    """A ground of 128 triangles and `count` placements of one ball of 128, each an object of its own.

    The level is as wide as gives each ball 16 m², so that it never gets more crowded.
    """
    rng = np.random.default_rng(SEED)
    width = _SPACING * max(count, 25) ** 0.5
    places = np.column_stack([rng.uniform(-width / 2, width / 2, (count, 2)), rng.uniform(-1.0, 3.0, count)])
    turns = rng.uniform(0.0, 2.0 * np.pi, count).tolist()
    balls = [
        Placed(f"ball {i}", "ball", (x, y, z), turn)
        for i, ((x, y, z), turn) in enumerate(zip(places.tolist(), turns, strict=True))
    ]
    meshes = {"ground": height_field(_GROUND, width), "ball": subdivided(octahedron(), 2, radius=1.0)}
    assert len(meshes["ball"][1]) == _BALL
    return write_scene(path, meshes, [Placed("ground", "ground"), *balls])


def _prop_triangles(subdivisions: int) -> float:
    """Mean triangles of a prop: spheres and boxes take turns."""
    return 0.5 * (8 * 4 ** (subdivisions + 1) + 12 * 4**subdivisions)
