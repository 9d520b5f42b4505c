"""What lights a walking figure on a frame: any variant of the walk, about every normal of its mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.region_types import RegionModels, Regions
from bake.regions.evaluate import ambient_obscurance, harmonics
from bake.types import Float32Array, Float64Array, Int64Array
from bake.walk import Course, PathTruth, Variant, WalkOptions

_FORGOTTEN = 1e-4  # share of a past frame that no longer counts


@dataclass(frozen=True, slots=True)
class Light:
    """What lights a figure.

    Attributes:
        sh: Shape (9,): convolved harmonics at the figure's place; AO about a normal is their value there.
        region: Shape (w,): regions whose models say how that changes around the place.
        place: Shape (w, 3): where each of them is evaluated for the figure's place.
        weight: Shape (w,): how much each counts; empty for the truth.
    """

    sh: Float64Array
    region: Int64Array
    place: Float64Array
    weight: Float64Array


def light_at(
    regions: Regions, course: Course, frame: int, variant: Variant, options: WalkOptions, truth: PathTruth | None = None
) -> Light | None:
    """What a variant lights a figure with; None for a truth that is not known there.

    About each normal of the walk it gives the walk's own AO of that frame.
    """
    if variant is Variant.TRUTH:
        sh = None if truth is None else _true_harmonics(truth, course, frame, options.column)
        nothing = np.zeros(0)
        return None if sh is None else Light(sh, nothing.astype(np.int64), np.zeros((0, 3)), nothing)
    frames, weights = np.array([frame]), np.ones(1)
    if variant in (Variant.BLENDED, Variant.SPATIAL_BLENDED):
        frames, weights = _past(course, frame, options.half_life)
    if variant in (Variant.SPATIAL, Variant.SPATIAL_BLENDED):
        first = course.weights.first
        counts = first[frames + 1] - first[frames]
        rows = np.repeat(first[frames], counts) + _within(counts)
        region, place = course.weights.region[rows], course.weighed_place[rows]
        share = np.repeat(weights, counts) * course.weights.weight[rows]
    else:
        region, place, share = course.region[frames], course.place[frames], weights
    models = regions.fitted if variant is Variant.RAW else regions.regularised
    sh = share @ harmonics(models, region, place)[:, :, options.column]
    owners, here = np.unique(region, return_inverse=True)
    latest = np.zeros((len(owners), 3))
    latest[here] = place  # ascending in time: each region keeps its latest place
    total = np.zeros(len(owners))
    np.add.at(total, here, share)
    return Light(sh, owners.astype(np.int64), latest, total)


def lit(
    light: Light, models: RegionModels, column: int, place: Float64Array, positions: Float64Array, normals: Float64Array
) -> Float32Array:
    """AO of a figure's vertices, shape (n,), in [0, 1].

    Args:
        light: What lights it.
        models: Those of the variant.
        column: Which distance.
        place: Shape (3,): the figure's place.
        positions, normals: Shape (n, 3).
    """
    sh = np.broadcast_to(light.sh, (len(positions), 9)).copy()
    for region, at, weight in zip(light.region.tolist(), light.place, light.weight.tolist(), strict=True):
        points = np.concatenate([at[None], at + (positions - place)])
        around = harmonics(models, np.full(len(points), region), points)[:, :, column]
        sh += weight * (around[1:] - around[0])
    return np.clip(ambient_obscurance(sh[:, :, None], normals)[:, 0], 0.0, 1.0).astype(np.float32)


def _past(course: Course, frame: int, half_life: float) -> tuple[Int64Array, Float64Array]:
    """Frames that a blend in time still remembers, and how much each counts."""
    if half_life <= 0.0:
        return np.array([frame]), np.ones(1)
    kept = 2.0 ** (-1.0 / (course.frame_rate * half_life))
    begun = np.flatnonzero(course.frames.teleported[: frame + 1])
    start = int(begun[-1]) if len(begun) else 0
    first = max(start, frame - int(np.ceil(np.log(_FORGOTTEN) / np.log(kept))))
    frames = np.arange(first, frame + 1)
    weights = (1.0 - kept) * kept ** (frame - frames).astype(np.float64)
    weights[0] = kept ** float(frame - first)
    return frames, weights


def _within(counts: Int64Array) -> Int64Array:
    """0, 1, … within groups of the given sizes."""
    return np.arange(int(counts.sum())) - np.repeat(np.cumsum(counts) - counts, counts)


def _true_harmonics(truth: PathTruth, course: Course, frame: int, column: int) -> Float64Array | None:
    own = np.flatnonzero(truth.piece == course.frames.piece[frame])
    along, given = float(course.frames.distance[frame]), truth.distance[own]
    low = int(np.clip(np.searchsorted(given, along, side="right") - 1, 0, max(len(own) - 2, 0)))
    high = min(low + 1, len(own) - 1)
    if not (truth.valid[own[low]] and truth.valid[own[high]]):
        return None
    part = min(max((along - given[low]) / max(float(given[high] - given[low]), 1e-12), 0.0), 1.0)
    return truth.sh[own[low], :, column] * (1.0 - part) + truth.sh[own[high], :, column] * part
