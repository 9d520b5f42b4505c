"""A row of linked regions whose models and points are made up but agree with each other."""

from __future__ import annotations

import numpy as np

from bake.region_types import GRID, PARAMETERS, PointState, RegionGraph, RegionModels, RegionPoints, Regions
from bake.regions.evaluate import harmonics

OPEN = np.sqrt(4.0 * np.pi)


def row_of_regions(count: int = 4, *, columns: int = 2, seed: int = 1, size: float = 2.0, y: float = 0.0) -> Regions:
    """Cubes side by side along x, each linked to the next; random models, every seventh point unreachable."""
    random = np.random.default_rng(seed)
    minimum = np.zeros((count, 3))
    minimum[:, 0] = size * np.arange(count)
    minimum[:, 1] = y
    maximum = minimum + size
    link = np.stack([np.arange(count - 1), np.arange(1, count)], axis=1).astype(np.int32)
    middle = (minimum + maximum) / 2.0
    link_centre = middle[:-1] + np.array([size / 2.0, 0.0, 0.0])
    graph = RegionGraph(
        tuple(f"cell {number}" for number in range(count)),
        minimum,
        maximum,
        middle.copy(),
        link.reshape(-1, 2),
        np.full(len(link), size * size),
        link_centre.reshape(-1, 3),
        "automatic",
    )
    coefficients = 0.02 * random.standard_normal((count, PARAMETERS, 9, columns)).astype(np.float32)
    coefficients[:, 0, 0] = OPEN * random.uniform(0.3, 0.8, (count, columns))
    ones = np.full(count, (1 << PARAMETERS) - 1, np.uint8)
    rmse = random.uniform(0.005, 0.05, (count, columns)).astype(np.float32)
    fitted = RegionModels(middle, coefficients, ones, (np.arange(count) % 2).astype(np.uint8), rmse)
    smooth = coefficients.copy()
    smooth[:, 0] = 0.5 * (coefficients[:, 0] + coefficients[:, 0].mean(axis=0))
    regularised = RegionModels(middle, smooth, ones, fitted.centre_kind, rmse * 1.1)
    before = np.abs(np.diff(coefficients[:, 0, 0] / OPEN, axis=0)).astype(np.float32)
    points = _points(graph, fitted)
    return Regions(
        graph, points, fitted, regularised, before, before / 2, (), np.zeros((0, columns), np.float32),
        np.arange(count, dtype=np.int32),
    )  # fmt: skip


def _points(graph: RegionGraph, models: RegionModels) -> RegionPoints:
    steps = (np.arange(GRID) + 0.5) / GRID
    grid = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    position = graph.minimum[:, None] + grid * (graph.maximum - graph.minimum)[:, None]
    state = np.zeros(position.shape[:2], np.uint8)
    state[:, ::7] = PointState.UNREACHABLE
    state[:, 3] = PointState.BACK_FACES
    share = np.where(state == PointState.BACK_FACES, 0.6, 0.0).astype(np.float32).ravel()
    traced = np.flatnonzero(state.ravel() != PointState.UNREACHABLE).astype(np.int32)
    position = position.reshape(-1, 3)
    noise = 0.01 * np.random.default_rng(7).standard_normal((len(traced), 9, 1))
    sh = (harmonics(models, traced // GRID**3, position[traced]) + noise).astype(np.float32)
    windowed = np.zeros(len(traced), np.uint8)
    return RegionPoints(position.astype(np.float32), state.ravel(), share, traced, sh, windowed)
