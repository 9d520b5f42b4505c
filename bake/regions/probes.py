"""What is open around the grid points of regions, traced."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np

from bake.arrays import BoolArray, Float32Array, UInt8Array, UInt32Array
from bake.low_discrepancy import hash_u32
from bake.region_types import GRID, PointState, RegionGraph, RegionPoints
from bake.regions.convolution import convolve
from bake.regions.grid import grid_positions
from bake.regions.windowing import window
from bake.settings import BakeSettings
from bake.sphere_rays import SphereTracer


@dataclass(frozen=True, slots=True)
class KnownPoints:
    """Points that need not be traced, in the order of `RegionPoints.traced`.

    Attributes:
        sh: Shape (t, 9, k), float32: as in `RegionPoints`, where they are known.
        windowed: Shape (t,), uint8.
        share: Shape (t,), float32: of back faces.
        wanted: Shape (t,), bool: those to be traced.
    """

    sh: Float32Array
    windowed: UInt8Array
    share: Float32Array
    wanted: BoolArray


def trace_points(
    graph: RegionGraph,
    reachable: BoolArray,
    tracer: SphereTracer,
    settings: BakeSettings,
    *,
    known: KnownPoints | None = None,
) -> Generator[int, None, RegionPoints]:
    """Traces the reachable points of all regions (Sloan et al. 2013, section 2.3).

    Their harmonics are convolved with the clamped cosine and, where they ring, windowed; points that see too many back
    faces are inside something and drop out.

    Args:
        graph: The regions.
        reachable: Shape (r · GRID³,): points worth tracing, in the order of `RegionPoints`.
        tracer: Of the whole world.
        settings: `region_directions`, `back_face_threshold` and `seed`.
        known: What need not be traced.

    Yields:
        How many points are done.
    """
    positions = grid_positions(graph).astype(np.float32)
    traced = np.flatnonzero(reachable).astype(np.int32)
    seeds = point_seeds(graph.names, settings.seed)
    directions, k = settings.region_directions, settings.distance_count
    share = np.zeros(len(positions), np.float32)
    rows = np.arange(len(traced))
    if known is None:
        sh, windowed = np.empty((len(traced), 9, k), np.float32), np.empty(len(traced), np.uint8)
    else:
        sh, windowed, rows = known.sh.copy(), known.windowed.copy(), np.flatnonzero(known.wanted)
        share[traced] = known.share
    size = tracer.points_at_once(directions)
    for begin in range(0, len(rows), size):
        part = rows[begin : begin + size]
        points = traced[part]
        counts = tracer.gather_sphere(positions[points], seeds[points], directions)
        share[points] = counts.back_faces / np.maximum(counts.hits, 1)
        sh[part], windowed[part] = window(convolve(counts.sh))
        yield min(begin + size, len(rows))
    points = RegionPoints(
        position=positions,
        state=np.where(reachable, PointState.VALID, PointState.UNREACHABLE).astype(np.uint8),
        back_face_share=share,
        traced=traced,
        sh=sh,
        windowed=windowed,
    )
    return judged(points, settings.back_face_threshold)


def judged(points: RegionPoints, threshold: float) -> RegionPoints:
    """The same points, those that were traced judged anew by the share of back faces that they may see."""
    state: UInt8Array = np.array(points.state)
    inside = points.back_face_share[points.traced] > np.float32(threshold)
    state[points.traced] = np.where(inside, PointState.BACK_FACES, PointState.VALID)
    return dataclasses.replace(points, state=state)


def point_seeds(names: Sequence[str], seed: int) -> UInt32Array:
    """A scramble for each grid point, shape (r · GRID³,), from the seed, its region's name and its place in the grid.

    What happens to other regions changes none of them.
    """
    digests = [hashlib.blake2b(name.encode(), digest_size=4).digest() for name in names]
    named = np.frombuffer(b"".join(digests), "<u4").astype(np.uint32)
    cells = np.arange(GRID**3, dtype=np.uint32)
    with np.errstate(over="ignore"):
        mixed = hash_u32(named ^ hash_u32(np.full(1, seed, np.uint32)))
        return hash_u32(mixed[:, None] + hash_u32(cells)[None, :]).ravel()
