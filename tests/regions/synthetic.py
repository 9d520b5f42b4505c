"""Regions made from a formula, without geometry or rays."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bake import spherical_harmonics
from bake.region_types import GRID, PointState, RegionGraph, RegionPoints, Regions
from bake.regions.fit import fit_regions
from bake.regions.grid import grid_positions
from bake.regions.mismatch import boundary_mismatch
from bake.regions.regularise import regularise
from bake.settings import BakeSettings

Field = Callable[[np.ndarray], np.ndarray]
"""Positions, shape (n, 3) → convolved harmonics, shape (n, 9, k)."""


def row_of_boxes(count: int, *, size: tuple[float, float, float] = (4.0, 3.0, 5.0), at: float = 0.0) -> RegionGraph:
    """Boxes side by side along x, each linked with the next through the face between them."""
    low = np.zeros((count, 3))
    low[:, 0] = np.arange(count) * size[0]
    return chain(low + at, low + size + at)


def chain(minimum: np.ndarray, maximum: np.ndarray) -> RegionGraph:
    """A graph of boxes, each linked with the next in the middle of their overlap."""
    count = len(minimum)
    link = np.stack([np.arange(count - 1), np.arange(1, count)], axis=1).astype(np.int32).reshape(-1, 2)
    low = np.maximum(minimum[:-1], minimum[1:])
    high = np.maximum(np.minimum(maximum[:-1], maximum[1:]), low)
    extent = np.sort(high - low, axis=1)
    return RegionGraph(
        names=tuple(f"room {i}" for i in range(count)),
        minimum=minimum.astype(np.float64),
        maximum=maximum.astype(np.float64),
        seed=0.5 * (minimum + maximum),
        link=link,
        link_area=extent[:, 1] * extent[:, 2],
        link_centre=0.5 * (low + high),
        origin="automatic",
    )


def points_of(graph: RegionGraph, field: Field, *, valid: np.ndarray | None = None) -> RegionPoints:
    """The grid points of a graph, their harmonics from `field`; `valid`, shape (r · GRID³,), says which are traced."""
    positions = grid_positions(graph)
    valid = np.ones(len(positions), bool) if valid is None else valid
    traced = np.flatnonzero(valid).astype(np.int32)
    return RegionPoints(
        position=positions.astype(np.float32),
        state=np.where(valid, PointState.VALID, PointState.UNREACHABLE).astype(np.uint8),
        back_face_share=np.zeros(len(positions), np.float32),
        traced=traced,
        sh=field(positions[traced]).astype(np.float32),
        windowed=np.zeros(len(traced), np.uint8),
    )


def random_field(seed: int, *, distances: int = 2, wiggle: float = 0.7) -> Field:
    """A smooth field of AO between about 0.2 and 0.8, a little darker toward one direction that turns with place."""
    random = np.random.default_rng(seed)
    ways, phases = random.normal(size=(4, 3)) * wiggle, random.random((4, distances)) * 6.0

    def field(positions: np.ndarray) -> np.ndarray:
        waves = np.sin((positions @ ways.T)[:, :, None] + phases)
        direction = np.stack([waves[:, 1, 0], waves[:, 2, 0], waves[:, 3, 0]], axis=1) + 1e-3
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        sh = np.zeros((len(positions), 9, distances))
        sh[:, 0] = (0.5 + 0.2 * waves[:, 0]) / spherical_harmonics.Y0
        sh[:, 1:] = 0.1 * spherical_harmonics.evaluate(direction)[:, 1:, None] * (1.0 + 0.3 * waves[:, :1])
        return sh

    return field


def build_regions(
    count: int = 5,
    *,
    seed: int = 1,
    graph: RegionGraph | None = None,
    field: Field | None = None,
    invalid: float = 0.2,
    settings: BakeSettings | None = None,
) -> Regions:
    """A whole `Regions`: boxes in a row (or `graph`) in a random field, a share of their points cut off."""
    settings = settings or BakeSettings()
    graph = graph or row_of_boxes(count)
    valid = np.random.default_rng(seed).random(len(graph) * GRID**3) >= invalid
    points = points_of(graph, field or random_field(seed, distances=settings.distance_count), valid=valid)
    fitted = fit_regions(points, graph, settings)
    outcome = regularise(fitted, graph, beta=settings.region_beta)
    return Regions(
        graph=graph,
        points=points,
        fitted=fitted,
        regularised=outcome.models,
        mismatch_before=boundary_mismatch(fitted, graph),
        mismatch_after=outcome.mismatch,
        absorbed=(),
        absorbed_error=np.zeros((0, settings.distance_count), np.float32),
        owner=np.arange(len(graph), dtype=np.int32),
    )
