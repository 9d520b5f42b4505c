"""Dynamic regions in figures, for JSON, for the terminal and for the report."""

from __future__ import annotations

from typing import Any

import numpy as np

from bake.region_types import CentreKind, PointState, Regions
from bake.regions.models import mean_error
from bake.regions.packed import model_bytes
from bake.types import BakeResult


def region_counts(result: BakeResult) -> dict[str, Any]:
    """How many regions, links, points and models the result has, how well they fit, and what they weigh."""
    regions = result.regions
    if regions is None:
        return {"regions": 0}
    state = np.bincount(np.asarray(regions.points.state), minlength=len(PointState))
    return {
        "regions": len(regions.graph),
        "origin": regions.graph.origin,
        "links": len(regions.graph.link),
        "models": len(np.unique(regions.owner)),
        "points_traced": len(regions.points.traced),
        "points_valid": int(state[PointState.VALID]),
        "points_unreachable": int(state[PointState.UNREACHABLE]),
        "points_inside": int(state[PointState.BACK_FACES]),
        "points_windowed": int(np.count_nonzero(regions.points.windowed)),
        "mean_error": mean_error(regions.fitted.rmse),
        "mean_error_regularised": mean_error(regions.regularised.rmse),
        "worst_mismatch_before": float(np.max(regions.mismatch_before, initial=0.0)),
        "worst_mismatch_after": float(np.max(regions.mismatch_after, initial=0.0)),
        "bytes": int(model_bytes(regions).sum()),
    }


def regions_content(result: BakeResult) -> dict[str, Any]:
    """What `regions --json` prints: every region and every link; plain values that JSON can hold."""
    regions = result.regions
    if regions is None:
        return {"regions": [], "links": [], "distances": list(result.settings.column_distances)}
    return {
        "origin": regions.graph.origin,
        "distances": list(result.settings.column_distances),
        "regions": _regions(regions, result.world.origin),
        "links": _links(regions, result.world.origin),
    }


def _regions(regions: Regions, origin: np.ndarray) -> list[dict[str, Any]]:
    graph, models = regions.graph, regions.fitted
    states = np.asarray(regions.points.state).reshape(len(graph), -1)
    low, high = graph.minimum + origin, graph.maximum + origin
    weight = model_bytes(regions)
    return [
        {
            "name": name,
            "min": low[i].tolist(),
            "max": high[i].tolist(),
            "seed": (graph.seed[i] + origin).tolist(),
            "valid_points": int(np.count_nonzero(states[i] == PointState.VALID)),
            "unreachable_points": int(np.count_nonzero(states[i] == PointState.UNREACHABLE)),
            "inside_points": int(np.count_nonzero(states[i] == PointState.BACK_FACES)),
            "fit_rmse": largest(models.rmse[i]),
            "fit_rmse_by_distance": finite(models.rmse[i]),
            "regularised_rmse": largest(regions.regularised.rmse[i]),
            "regularised_rmse_by_distance": finite(regions.regularised.rmse[i]),
            "centre": (models.centre[i] + origin).tolist(),
            "centre_kind": CentreKind(int(models.centre_kind[i])).name.lower(),
            "terms": int(models.terms[i]).bit_count(),
            "absorbed_by": None if regions.owner[i] == i else graph.names[int(regions.owner[i])],
            "bytes": int(weight[i]),
        }
        for i, name in enumerate(graph.names)
    ]


def _links(regions: Regions, origin: np.ndarray) -> list[dict[str, Any]]:
    graph = regions.graph
    return [
        {
            "a": graph.names[a],
            "b": graph.names[b],
            "area": float(graph.link_area[i]),
            "centre": (graph.link_centre[i] + origin).tolist(),
            "mismatch_before": largest(regions.mismatch_before[i]),
            "mismatch_before_by_distance": finite(regions.mismatch_before[i]),
            "mismatch_after": largest(regions.mismatch_after[i]),
            "mismatch_after_by_distance": finite(regions.mismatch_after[i]),
        }
        for i, (a, b) in enumerate(np.asarray(graph.link).tolist())
    ]


def finite(values: np.ndarray) -> list[float | None]:
    """Plain numbers; None for what is not known."""
    return [float(value) if np.isfinite(value) else None for value in values]


def largest(values: np.ndarray) -> float | None:
    """The largest over the distances; None if nothing is known."""
    return float(np.max(values)) if np.isfinite(values).all() and values.size else None
