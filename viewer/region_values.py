"""Numbers of regions and boundaries that colour them: fit error, mismatch, valid share, terms, bytes, centre."""

from __future__ import annotations

import numpy as np

from bake.region_types import GRID, PARAMETERS, CentreKind, PointState, RegionModels, Regions
from bake.types import Float32Array, UInt8Array
from viewer.colormaps import CIVIDIS
from viewer.fields import Scale, distance_label
from viewer.region_view import RegionColor, RegionView

POINTS = GRID**3

# Colours that stay apart to colour-blind eyes (Okabe and Ito 2002).
NONE_COLOR = (148, 152, 158)
CENTRE_COLORS = {
    CentreKind.BOX: (86, 180, 233),
    CentreKind.MASS: (204, 121, 167),
    CentreKind.OPTIMISED: (0, 158, 115),
}
CENTRE_WORDS = {
    CentreKind.BOX: "box",
    CentreKind.MASS: "centre of mass",
    CentreKind.OPTIMISED: "optimised",
}


def valid_counts(regions: Regions) -> np.ndarray:
    """Valid points of each region, shape (r,), int64."""
    return (np.asarray(regions.points.state).reshape(-1, POINTS) == PointState.VALID).sum(axis=1)


def term_counts(models: RegionModels) -> np.ndarray:
    """Parameters that the points of each region determined, shape (r,), int64, 0 to 7."""
    bits = np.asarray(models.terms)[:, None] >> np.arange(PARAMETERS, dtype=np.uint8) & 1
    return bits.sum(axis=1)


def used_models(regions: Regions, view: RegionView) -> RegionModels:
    """The models in view: as fitted, or regularised."""
    return regions.fitted if view.as_fitted else regions.regularised


def link_mismatch(regions: Regions, view: RegionView) -> Float32Array:
    """Mismatch of each link at the distance in view, shape (l,)."""
    mismatch = regions.mismatch_before if view.as_fitted else regions.mismatch_after
    return np.asarray(mismatch)[:, view.column]


def worst_mismatch(regions: Regions, view: RegionView) -> Float32Array:
    """The largest mismatch around each region at the distance in view, shape (r,); NaN without a neighbour."""
    worst = np.full(len(regions.graph), -np.inf, np.float32)
    mismatch = link_mismatch(regions, view)
    for side in (0, 1):
        np.maximum.at(worst, regions.graph.link[:, side], mismatch)
    worst[np.isneginf(worst)] = np.nan
    return worst


def region_values(regions: Regions, view: RegionView, color: RegionColor, region_bytes: np.ndarray) -> Float32Array:
    """What colours the boxes, shape (r,); NaN where a region has no such number.

    Args:
        regions: What was baked.
        view: Picks the models and the distance.
        color: Which number.
        region_bytes: Shape (r,): memory that each region takes in the engine.
    """
    match color:
        case RegionColor.ERROR:
            values = np.asarray(used_models(regions, view).rmse)[:, view.column]
        case RegionColor.MISMATCH:
            values = worst_mismatch(regions, view)
        case RegionColor.VALID:
            values = 100.0 * valid_counts(regions) / POINTS
        case RegionColor.MEMORY:
            values = region_bytes
        case RegionColor.TERMS:
            values = term_counts(regions.fitted)
        case RegionColor.CENTRE:
            values = np.asarray(used_models(regions, view).centre_kind)
    return np.asarray(values, np.float32)


def region_scale(regions: Regions, view: RegionView, color: RegionColor, region_bytes: np.ndarray, label: str) -> Scale:
    """What the boxes' colours mean.

    Errors and mismatches keep their range when regularisation is switched on and off, so that the two can be compared.
    """
    missing: tuple[tuple[tuple[int, int, int], str], ...] = ()
    values = region_values(regions, view, color, region_bytes)
    state = "as fitted" if view.as_fitted else "regularised"
    match color:
        case RegionColor.ERROR:
            both = np.concatenate([regions.fitted.rmse[:, view.column], regions.regularised.rmse[:, view.column]])
            if np.isnan(values).any():
                missing = ((NONE_COLOR, "no valid point"),)
            return Scale("Fit error (RMSE)", CIVIDIS, 0.0, _top(both), note=f"at {label}, {state}", swatches=missing)
        case RegionColor.MISMATCH:
            if np.isnan(values).any():
                missing = ((NONE_COLOR, "no neighbour"),)
            top, note = link_top(regions, view), f"at {label}, {state}{_beyond(regions, view)}"
            return Scale("Largest mismatch", CIVIDIS, 0.0, top, note=note, swatches=missing)
        case RegionColor.VALID:
            return Scale("Valid points", CIVIDIS, 0.0, 100.0, "%", note=f"of {POINTS} a region")
        case RegionColor.MEMORY:
            return Scale("Memory in the engine", CIVIDIS, 0.0, _top(values, 1.0), "bytes", note="a region")
        case RegionColor.TERMS:
            return Scale("Parameters determined", CIVIDIS, 0.0, float(PARAMETERS), note=f"of {PARAMETERS}")
        case RegionColor.CENTRE:
            kinds = [kind for kind in CentreKind if (values == kind).any()]
            swatches = tuple((CENTRE_COLORS[kind], CENTRE_WORDS[kind]) for kind in kinds)
            return Scale("Centre of the model", swatches=swatches)


def region_colors(regions: Regions, view: RegionView, color: RegionColor, region_bytes: np.ndarray) -> UInt8Array:
    """A colour a region, shape (r, 3)."""
    values = region_values(regions, view, color, region_bytes)
    if color is RegionColor.CENTRE:
        table = np.array([CENTRE_COLORS[kind] for kind in CentreKind], np.uint8)
        return table[values.astype(np.int64)]
    scale = region_scale(regions, view, color, region_bytes, "")
    colors = CIVIDIS.colors(values, scale.low, scale.high)
    colors[np.isnan(values)] = NONE_COLOR
    return colors


def link_top(regions: Regions, view: RegionView) -> float:
    """Upper end of the mismatch's colours, the same for both states at the distance in view.

    A few boundaries that were bad as fitted must not make all others look alike: a quarter of them may be off the
    scale, but none once regularised.
    """
    before, after = (np.asarray(part)[:, view.column] for part in (regions.mismatch_before, regions.mismatch_after))
    return _top(np.append(after, np.quantile(before, 0.75) if len(before) else 0.0))


def _beyond(regions: Regions, view: RegionView) -> str:
    """How far mismatches go beyond the scale, for its note; empty if they do not."""
    worst = float(np.max(link_mismatch(regions, view), initial=0.0))
    return f", up to {worst:.2g}" if worst > link_top(regions, view) else ""


def link_scale(regions: Regions, view: RegionView, distance: float) -> Scale:
    """What the links' colours mean."""
    state = "as fitted" if view.as_fitted else "regularised"
    note = f"at {distance_label(distance)}, {state}{_beyond(regions, view)}"
    return Scale("Mismatch of links", CIVIDIS, 0.0, link_top(regions, view), note=note)


def _top(values: np.ndarray, least: float = 1e-4) -> float:
    known = np.asarray(values, np.float64)
    known = known[np.isfinite(known)]
    return max(float(known.max()), least) if len(known) else least
