"""Which of the regions' points an edit leaves as they are."""

from __future__ import annotations

import numpy as np

from bake.rebake.reach import Places, reach
from bake.rebake.state import Edit, State
from bake.rebake.wanted_points import wanted_points
from bake.region_types import GRID, RegionGraph
from bake.regions.grid import grid_positions
from bake.regions.probes import KnownPoints, point_seeds
from bake.regions.space import RegionSpace
from bake.trace.changed_points import ChangedPoints
from bake.types import Float32Array, Int64Array

POINT_RAY = 4.4
"""Most that one of N rays may change of a convolved coefficient, times N: 4π times the largest harmonic, over π."""


def known_points(
    state: State, edit: Edit, space: RegionSpace, bound: float, changed: ChangedPoints | None
) -> tuple[KnownPoints | None, Float32Array]:
    """What was traced at the points of regions of the same name and box, out of the edit's reach.

    Args:
        state: Before the edit.
        edit: What differs.
        space: The regions as they are now.
        bound: Most that may be skipped for a point.
        changed: Tells points with a ray that can have changed; None if nobody can.

    Returns:
        The points, None if there were no regions, and what is skipped after this edit, one a traced point.
    """
    regions = state.result.regions
    traced = np.flatnonzero(space.valid)
    if regions is None or "region_directions" in edit.settings_change.names:
        return None, np.zeros(len(traced), np.float32)
    cells = GRID**3
    former_region = _former_regions(regions.graph, space.graph)[traced // cells]
    row_of = np.full(len(regions.points.state), -1, np.int64)
    row_of[regions.points.traced] = np.arange(len(regions.points.traced))
    point = np.maximum(former_region, 0) * cells + traced % cells
    former = np.where(former_region >= 0, row_of[point], -1) if len(row_of) else np.full(len(traced), -1, np.int64)
    known = np.maximum(former, 0)
    places = Places.of(grid_positions(space.graph).astype(np.float32)[traced])
    settings = edit.settings
    found = reach(places, edit.casters, settings, near=bound / 8.0)
    kept = state.result.skipped
    before = np.zeros(len(traced), np.float32)
    if kept is not None and len(kept.points):
        before = np.where(former >= 0, kept.points[known], np.float32(0.0))
    seeds, directions = point_seeds(space.graph.names, settings.seed)[traced], settings.region_directions
    wanted, skipped = wanted_points(
        former,
        found,
        before,
        bound=bound,
        scale=1.0,
        ray=POINT_RAY / directions,
        look=None if changed is None else lambda rows: changed.find(places.points[rows], seeds[rows], directions),
    )
    if not len(regions.points.traced):
        return None, skipped
    share = regions.points.back_face_share[regions.points.traced]
    points = KnownPoints(
        sh=np.asarray(regions.points.sh)[known],
        windowed=np.asarray(regions.points.windowed)[known],
        share=np.asarray(share)[known],
        wanted=wanted,
    )
    return points, skipped


def _former_regions(old: RegionGraph, new: RegionGraph) -> Int64Array:
    """The old region of the same name and box, shape (r,); -1 where there is none."""
    number = {name: i for i, name in enumerate(old.names)}
    found = np.full(len(new), -1, np.int64)
    for i, name in enumerate(new.names):
        former = number.get(name, -1)
        if former >= 0 and np.array_equal(old.minimum[former], new.minimum[i]):
            found[i] = former if np.array_equal(old.maximum[former], new.maximum[i]) else -1
    return found
