"""What a walk should look like: AO traced along the path and interpolated between the places."""

from __future__ import annotations

import math
from collections.abc import Generator

import numpy as np

from bake.regions.convolution import convolve
from bake.regions.evaluate import AXIS_NORMALS
from bake.sphere_rays import SphereTracer
from bake.spherical_harmonics import evaluate
from bake.types import Float32Array, Float64Array, Int32Array, Progress
from bake.walk.frames import Frames
from bake.walk.path import places
from bake.walk.types import PathTruth, WalkPath

DIRECTIONS = 1024
SPACING = 0.1
MOST_PLACES = 20_000
_CHECKS = 128


def trace_truth(
    path: WalkPath,
    tracer: SphereTracer,
    *,
    seed: int,
    back_face_threshold: float,
    directions: int = DIRECTIONS,
    spacing: float = SPACING,
) -> Generator[Progress, None, PathTruth]:
    """Traces places along a path, evenly spaced, and some half-way between them as a check.

    All places send the same directions: what noise they have changes slowly along the way and adds little to steps.

    Args:
        path: The path.
        tracer: Of the whole scene.
        seed: The bake's.
        back_face_threshold: Largest share of back faces among the hits of a valid place.
        directions: Rays from each place, over the sphere.
        spacing: Metres between places; wider on paths so long that there would be too many.
    """
    distance, piece = _stations(path, max(spacing, path.length / MOST_PLACES))
    pairs = np.flatnonzero((np.diff(piece) == 0) & (np.diff(distance) > 0.0))
    checked = pairs[np.unique(np.linspace(0, len(pairs) - 1, min(_CHECKS, len(pairs))).astype(np.int64))]
    between = 0.5 * (distance[checked] + distance[checked + 1])
    positions = places(path, np.concatenate([distance, between]), np.concatenate([piece, piece[checked]]))
    points = positions.astype(np.float32)
    size = min(tracer.points_at_once(directions), 2048)
    sh: list[Float32Array] = []
    valid: list[np.ndarray] = []
    for begin in range(0, len(points), size):
        part = points[begin : begin + size]
        counts = tracer.gather_sphere(part, np.full(len(part), seed & 0xFFFFFFFF, np.uint32), directions)
        sh.append(convolve(counts.sh).astype(np.float32))
        valid.append(counts.valid(back_face_threshold))
        yield Progress("trace the walk", min(begin + size, len(points)) * directions, len(points) * directions)
    found, fine = np.concatenate(sh), np.concatenate(valid)
    count = len(distance)
    usable = fine[checked] & fine[checked + 1] & fine[count:]
    lobes = evaluate(AXIS_NORMALS)
    guessed = 0.5 * (found[checked] + found[checked + 1])
    off = np.einsum("mc,nck->nmk", lobes, (guessed - found[count:])[usable].astype(np.float64))
    error = np.sqrt((off**2).mean(axis=(0, 1))) if len(off) else np.full(found.shape[2], np.nan)
    return PathTruth(distance, piece, found[:count], directions, fine[:count], error)


def truth_along(truth: PathTruth, frames: Frames, lobes: Float64Array, column: int) -> Float64Array:
    """AO on frames, interpolated between places, shape (n, m); NaN next to places that are not valid.

    Args:
        truth: Of the path that the frames walk.
        frames: The frames.
        lobes: Harmonics of m normals, shape (m, 9).
        column: Which distance.
    """
    values = np.einsum("mc,nc->nm", lobes, truth.sh[:, :, column].astype(np.float64))
    values[~truth.valid] = np.nan
    found = np.empty((len(frames), len(lobes)))
    for number in np.unique(frames.piece).tolist():
        own, asked = np.flatnonzero(truth.piece == number), frames.piece == number
        along, given = frames.distance[asked], truth.distance[own]
        low = np.clip(np.searchsorted(given, along, side="right") - 1, 0, max(len(own) - 2, 0))
        high = np.minimum(low + 1, len(own) - 1)
        length = np.maximum(given[high] - given[low], 1e-12)
        part = np.clip((along - given[low]) / length, 0.0, 1.0)[:, None]
        found[asked] = values[own[low]] * (1.0 - part) + values[own[high]] * part
    return found


def _stations(path: WalkPath, spacing: float) -> tuple[Float64Array, Int32Array]:
    distances: list[Float64Array] = []
    pieces: list[Int32Array] = []
    for number in np.unique(path.piece).tolist():
        along = path.distance[path.piece == number]
        begin, length = float(along[0]), float(along[-1] - along[0])
        count = max(1, math.ceil(length / spacing - 1e-9)) if length > 0.0 else 0
        distances.append(begin + length * np.arange(count + 1) / max(count, 1))
        pieces.append(np.full(count + 1, number, np.int32))
    return np.concatenate(distances), np.concatenate(pieces)
