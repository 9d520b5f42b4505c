"""What the user should know of the regions' models."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from bake.region_types import PointState, Regions
from bake.regions.models import FittedRegions
from bake.types import Finding

REGIONS = "regions"
KINDS = (
    "region-points-inside",
    "region-without-model",
    "region-points-rang",
    "small-region-kept",
    "region-absorbed",
)
"""Names of the findings below: a refit replaces those that a result has."""

_SHOWN = 5


def model_findings(regions: Regions, fitted: FittedRegions) -> Iterator[Finding]:
    """Points that dropped out, models made of nothing, windows, and absorptions with what they cost."""
    names, points = regions.graph.names, regions.points
    inside = int(np.count_nonzero(points.state == PointState.BACK_FACES))
    if inside:
        detail = f"{inside:,} of {len(points.traced):,} traced points see too many back faces and drop out"
        yield Finding(REGIONS, KINDS[0], inside, detail)
    empty = np.flatnonzero(fitted.models.terms == 0)
    if len(empty):
        detail = f"no point is valid, so their models are what their neighbours say, or open: {_list(names, empty)}"
        yield Finding(REGIONS, KINDS[1], len(empty), detail)
    rang = int(np.count_nonzero(points.windowed))
    if rang:
        detail = f"at {rang:,} of {len(points.traced):,} traced points AO fell below 0 somewhere, and was smoothed"
        yield Finding(REGIONS, KINDS[2], rang, detail, "info")
    kept = fitted.absorption.kept
    if kept:
        detail = f"too small, but without a neighbour that could absorb them: {_list(names, kept)}"
        yield Finding(REGIONS, KINDS[3], len(kept), detail, "info")
    for (name, taker), cost in zip(regions.absorbed, regions.absorbed_error, strict=True):
        price = ", ".join(f"{value:+.4f}" for value in cost.tolist()) if np.isfinite(cost).all() else "unknown"
        detail = f"uses the model of {taker!r}; its error there changes by {price} (one number a distance)"
        yield Finding(name, KINDS[4], 1, detail, "info")


def _list(names: Sequence[str], numbers: Sequence[int] | np.ndarray) -> str:
    shown = ", ".join(names[int(i)][:40] for i in numbers[:_SHOWN])
    return f"{shown} …" if len(numbers) > _SHOWN else shown
