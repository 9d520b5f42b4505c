"""What about a result's regions deserves a look: places without a model of their own, and steps that stay."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from bake.arrays import Int64Array
from bake.region_types import GRID, PARAMETERS, PointState, Regions
from bake.types import Finding

LARGE_STEP = 0.1
"""AO: a step at a boundary above this is seen even while it is blended in time."""

LARGE_ERROR = 0.1
"""AO: a model that misses its own points by more than this."""


def check_regions(regions: Regions) -> tuple[Finding, ...]:
    """Problems of severity "warning" (a region cannot work as it is) and "info" (it works, but look at it)."""
    return (*_structure(regions), *_quality(regions))


def _structure(regions: Regions) -> Iterator[Finding]:
    graph = regions.graph
    count = len(graph)
    valid = (np.asarray(regions.points.state) == PointState.VALID).reshape(count, -1).sum(axis=1)
    linked = np.bincount(np.asarray(graph.link).ravel(), minlength=count)
    for i, name in enumerate(graph.names):
        if valid[i] == 0:
            detail = f"none of its {GRID**3} points is valid: its model is what its neighbours say, or open"
            yield Finding(name, "no-valid-points", 1, detail)
        elif valid[i] < PARAMETERS:
            detail = f"{valid[i]} valid points are fewer than the {PARAMETERS} terms of a model"
            yield Finding(name, "few-valid-points", int(valid[i]), detail)
        if linked[i] == 0 and count > 1:
            yield Finding(name, "no-link", 1, "it is linked to no other region, so nothing smooths the way into it")
    parts = _parts(regions)
    if len(parts) > 1:
        detail = f"the links fall into {len(parts)} parts; the largest has {parts.max()} of {count} regions"
        yield Finding("links", "separate-parts", len(parts), detail, "info")


def _parts(regions: Regions) -> Int64Array:
    """How many regions each connected part of the link graph has."""
    count = len(regions.graph)
    a, b = np.asarray(regions.graph.link).T
    joined = coo_array((np.ones(len(a)), (a, b)), shape=(count, count))
    return np.bincount(connected_components(joined, directed=False)[1]).astype(np.int64)


def _quality(regions: Regions) -> Iterator[Finding]:
    graph = regions.graph
    error = np.nan_to_num(np.asarray(regions.regularised.rmse), nan=0.0).max(axis=1, initial=0.0)
    for i in np.flatnonzero(error > LARGE_ERROR):
        detail = f"its model misses its points by {error[i]:.3f}: split the box where the light changes"
        yield Finding(graph.names[int(i)], "large-error", 1, detail, "info")
    step = np.asarray(regions.mismatch_after).max(axis=1, initial=0.0)
    for i in np.flatnonzero(step > LARGE_STEP)[np.argsort(-step[step > LARGE_STEP], kind="stable")]:
        a, b = (graph.names[int(end)] for end in graph.link[i])
        detail = f"a step of {step[i]:.3f} stays at their boundary: raise --region-beta, or blend over an overlap"
        yield Finding(f"{a} – {b}", "large-step", 1, detail, "info")
