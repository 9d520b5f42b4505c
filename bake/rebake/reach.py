"""How much an edit may change the AO at a point: a bound from the kernel's falloff and the size of what changed.

A sphere of radius R at distance r fills at most (R/r)² of a cosine-weighted hemisphere, or of the sphere, and a ray
that it newly stops or no longer stops changes by at most 2^(-t/D), with t at least r - R. What is gone can only open,
what is new can only close: the larger of the two bounds holds for both together.

That is the bound of the mean over all directions. A bake sends a few rays, of which now and then one strikes what lies
far away, and changes the sample by one ray's share. The mean hardly notices, but where a vertex hangs on one or two
samples the fit makes several times as much of it. So points are told apart by what one ray may do, too. With the bound
at 0 nothing is left to chance: whatever may be struck at all is looked at.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.geometry import OFFSET_ULPS
from bake.in_parts import in_spans
from bake.rebake.casters import Casters, Parts
from bake.rebake.rows import RowMap
from bake.settings import BakeSettings, Kernel
from bake.types import BoolArray, Float32Array, Float64Array, Int32Array, Int64Array, SampleSet, World

BLOCK = 512
"""Neighbouring points that are looked at together before each is looked at for itself."""

_CHUNK = 1 << 18
_SPAN = 1 << 15


@dataclass(frozen=True, slots=True)
class Places:
    """Points that look at the scene, in blocks.

    Attributes:
        points: Shape (n, 3), float32, metres relative to `World.origin`.
        normals: Shape (n, 3), float32: of the planes that no ray goes below; None where rays go everywhere.
        centre, radius: Shape (b, 3) and (b,): spheres around `BLOCK` points each.
        lift: How far above its point a ray may begin, in metres.
    """

    points: Float32Array
    normals: Float32Array | None
    centre: Float64Array
    radius: Float64Array
    lift: float

    def __len__(self) -> int:
        return len(self.points)

    @staticmethod
    def of(points: Float32Array, normals: Float32Array | None = None, *, lift: float = 0.0) -> Places:
        """Points with their blocks."""
        return Places(points, normals, *_blocks(points), lift)

    @staticmethod
    def of_samples(world: World, samples: SampleSet) -> Places:
        """The points of surface samples, and the planes of their faces."""
        return Places.of(*_points(world, samples.face, samples.barycentric), lift=_lift(world))

    def after(self, world: World, samples: SampleSet, rows: RowMap) -> Places:
        """The same of an edited world: computed only where samples are new or moved."""
        assert self.normals is not None
        rest = rows.rest
        points, normals = rows.carried(self.points), rows.carried(self.normals)
        points[rest], normals[rest] = _points(world, samples.face[rest], samples.barycentric[rest])
        if rows.count != len(self) or any(now != then for now, then in rows.runs):
            return Places.of(points, normals, lift=_lift(world))
        centre, radius = self.centre.copy(), self.radius.copy()
        touched = np.unique(rest // BLOCK)
        for block in touched.tolist():
            own = slice(block * BLOCK, (block + 1) * BLOCK)
            centre[block : block + 1], radius[block : block + 1] = _blocks(points[own])
        return Places(points, normals, centre, radius, _lift(world))


def _blocks(points: Float32Array) -> tuple[Float64Array, Float64Array]:
    begins = np.arange(0, len(points), BLOCK)
    if not len(begins):
        return np.zeros((0, 3)), np.zeros(0)
    low = np.minimum.reduceat(points, begins).astype(np.float64)
    high = np.maximum.reduceat(points, begins).astype(np.float64)
    return 0.5 * (low + high), 0.5 * np.linalg.norm(high - low, axis=1)


def _points(world: World, face: Int32Array, weights: Float32Array) -> tuple[Float32Array, Float32Array]:
    """Points of samples and the unit normals of their faces, shape (n, 3) each; a normal is 0 without an area."""
    points, normals = np.empty((len(face), 3), np.float32), np.empty((len(face), 3), np.float32)
    for begin in range(0, len(face), _CHUNK):
        part = slice(begin, begin + _CHUNK)
        corners = world.positions[world.faces[face[part]]].astype(np.float32)
        one, other = corners[:, 0] - corners[:, 2], corners[:, 1] - corners[:, 2]
        points[part] = corners[:, 2] + weights[part, :1] * one + weights[part, 1:] * other
        normal = np.cross(one, other)
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        normals[part] = normal / np.where(length > 0.0, length, np.float32(1.0))
    return points, normals


def _lift(world: World) -> float:
    """More than any ray of the world begins above its point: see `geometry.offset_distance`."""
    offsets = [keys.offset for keys in world.object_keys if keys.offset is not None]
    largest = float(np.abs(world.positions).max(initial=0.0))
    return 4.0 * OFFSET_ULPS * 2.0**-24 * largest + max(offsets, default=0.0)


@dataclass(frozen=True, slots=True)
class Reached:
    """What an edit may do to points.

    Attributes:
        bound: Shape (n,), float32, in AO: of the mean over all directions.
        single: Shape (n,), float32, in [0, 1]: how much a ray that strikes what changed may change; 0 where none can.
    """

    bound: Float32Array
    single: Float32Array

    @property
    def touched(self) -> BoolArray:
        """Points from which something that changed may be struck at all, shape (n,)."""
        return self.single > 0.0


def reach(
    places: Places, casters: Casters, settings: BakeSettings, *, near: float, near_single: float = 1.0
) -> Reached:
    """Bounds at points.

    Args:
        places: The points.
        casters: What changed.
        settings: Kernel and distances.
        near, near_single: Blocks with a larger bound, or where a ray may do more, are refined point by point; the
            others keep what their nearest point may have.
    """
    before, single_before = _side(places, casters.before, settings, near, near_single)
    after, single_after = _side(places, casters.after, settings, near, near_single)
    return Reached(np.maximum(before, after), np.maximum(single_before, single_after))


def nearest_blocks(places: Places, casters: Casters, settings: BakeSettings, count: int) -> Int64Array:
    """At most `count` blocks at whose points the edit may do most, those first; none where it can do nothing.

    Args:
        places: The points.
        casters: What changed.
        settings: Kernel and distances.
        count: How many.
    """
    bound = np.zeros(len(places.radius))
    for parts in (casters.before, casters.after):
        total = np.zeros(len(bound))
        for centre, radius in zip(parts.centre, parts.radius, strict=True):
            away = np.linalg.norm(places.centre - centre, axis=1) - places.radius
            total += _bound(np.maximum(away, 0.0), float(radius) + places.lift, settings)[0]
        np.maximum(bound, total, out=bound)
    order = np.argsort(-bound, kind="stable")[:count]
    return order[bound[order] > 0.0]


def _side(
    places: Places, parts: Parts, settings: BakeSettings, near: float, near_single: float
) -> tuple[Float32Array, Float32Array]:
    """The bound, and how much one ray may change, of all spheres of one world; shape (n,) each."""
    total, single = np.zeros(len(places), np.float32), np.zeros(len(places), np.float32)
    sizes = np.full(len(places.radius), BLOCK)
    if len(sizes):
        sizes[-1] = len(places) - BLOCK * (len(sizes) - 1)
    for centre, radius in zip(parts.centre, parts.radius, strict=True):
        wide = float(radius) * (1.0 + 1e-5) + places.lift + 1e-6
        away = np.linalg.norm(places.centre - centre, axis=1) - places.radius
        whole, one = _bound(np.maximum(away, 0.0), wide, settings)
        rest = (whole <= near) & (one <= near_single)
        total += np.repeat(np.where(rest, whole, 0.0).astype(np.float32), sizes)
        np.maximum(single, np.repeat(np.where(rest, one, 0.0).astype(np.float32), sizes), out=single)
        refine = partial(_refine, places, settings, centre.astype(np.float32), wide, (total, single))
        in_spans(refine, _runs_of(np.flatnonzero(~rest), len(places)))
    return total, single


def _refine(
    places: Places,
    settings: BakeSettings,
    centre: Float32Array,
    wide: float,
    found: tuple[Float32Array, Float32Array],
    begin: int,
    end: int,
) -> None:
    """Adds what a sphere may do at a span of points."""
    run = slice(begin, end)
    offset = places.points[run] - centre
    squared = np.einsum("ij,ij->i", offset, offset)
    bound, one = _bound(np.sqrt(squared), wide, settings)
    if places.normals is not None:
        below = np.einsum("ij,ij->i", offset, places.normals[run]) > np.float32(wide)
        bound[below] = one[below] = 0.0  # all of it lies below the face
    found[0][run] += bound
    np.maximum(found[1][run], one, out=found[1][run])


def _runs_of(blocks: Int64Array, count: int) -> list[tuple[int, int]]:
    """Spans of points that hold some blocks, ascending, none longer than `_SPAN`."""
    if not len(blocks):
        return []
    step = _SPAN // BLOCK
    apart = (np.diff(blocks) != 1) | (blocks[1:] // step != blocks[:-1] // step)
    begins = np.concatenate(([0], np.flatnonzero(apart) + 1))
    ends = np.concatenate((begins[1:], [len(blocks)])) - 1
    pairs = zip(blocks[begins].tolist(), blocks[ends].tolist(), strict=True)
    return [(a * BLOCK, min((b + 1) * BLOCK, count)) for a, b in pairs]


def _bound(distance: NDArray[Any], radius: float, settings: BakeSettings) -> tuple[NDArray[Any], NDArray[Any]]:
    """For a sphere at some distances from its centre: the bound, in AO, and what one ray may change, shape (n,), of the
    distances' own type."""
    gap = np.maximum(distance - radius, 0.0)
    one = np.ones_like(gap)
    if settings.kernel is Kernel.OBSCURANCE:
        np.exp2(gap * (-1.0 / max(settings.distances)), out=one)
    if float(gap.max(initial=0.0)) > settings.trace_distance:
        one[gap > settings.trace_distance * (1.0 + 1e-5)] = 0.0
    share = radius / np.maximum(distance, radius)
    return one * (share * share), one
