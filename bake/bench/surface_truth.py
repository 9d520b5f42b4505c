"""Converged AO at random points of a scene's surface: what the benchmarks compare interpolated values with.

Half of the points are spread by area and half evenly over the faces, because levels mix faces of a square centimetre
with mountains; as many points spread by area alone stand beside them. Points that are themselves invalid by the
back-face rule, inside walls or under the ground, do not count. The rule goes by the share of what a point's rays hit;
the points that are valid where it goes by the share of all its rays stand beside them as well.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bake.devices import resolve
from bake.geometry import face_normals
from bake.samples import place_samples
from bake.settings import BakeSettings
from bake.trace import create_tracer
from bake.types import Float32Array, Float64Array, Int64Array, SampleSet, Tally, World

REFERENCE_RAYS = 4096
POINTS = 20_000
OF_ALL_RAYS = "area of all rays"


@dataclass(frozen=True)
class SurfaceTruth:
    """Converged AO at points.

    Attributes:
        face: Shape (n,), int64: face of each point.
        corners: Shape (n, 3), int64: that face's vertices.
        weights: Shape (n, 3), float64: barycentric.
        ao: Shape (n, k), float64.
        halves: Shape (2, n, k), float64: the same from either half of the rays.
        sets: Rows that count, by name: "mixed" and "area"; and "area of all rays", by the other count of back faces.
    """

    face: Int64Array
    corners: Int64Array
    weights: Float64Array
    ao: Float64Array
    halves: Float64Array
    sets: Mapping[str, Int64Array]

    def at_points(self, ao: np.ndarray) -> Float64Array:
        """Values at the points, shape (n, k), from those at vertices, (v, k), or at corners of faces, (m, 3, k)."""
        corner: Float64Array = (ao[self.face] if ao.ndim == 3 else ao[self.corners]).astype(np.float64)
        return np.einsum("ij,ijk->ik", self.weights, corner)

    def errors(self, ao: np.ndarray) -> dict[str, float]:
        """Root mean square error by set and column, as `"mixed 0"`; arguments as for `at_points`."""
        square: Float64Array = (self.at_points(ao) - self.ao) ** 2
        return {
            f"{name} {k}": math.sqrt(float(square[rows, k].mean()))
            for name, rows in self.sets.items()
            for k in range(self.ao.shape[1])
        }

    def percentile(self, ao: np.ndarray, share: float, name: str = "mixed") -> Float64Array:
        """The absolute error that `share` per cent of a set's points stay below, shape (k,)."""
        rows = self.sets[name]
        return np.percentile(np.abs(self.at_points(ao) - self.ao)[rows], share, axis=0)

    @cached_property
    def own_error(self) -> Float64Array:
        """Root mean square error of the reference itself, shape (k,): half the difference of its halves."""
        rows = self.sets["mixed"]
        return np.sqrt(((self.halves[0] - self.halves[1])[rows] ** 2).mean(axis=0)) / 2.0


def surface_truth(world: World, settings: BakeSettings, *, points: int = POINTS) -> SurfaceTruth:
    """Traces the reference.

    Args:
        world: The flattened scene.
        settings: With the rays of the reference, half of which each half gets, and a seed of its own.
        points: How many, half spread by area, half evenly over faces; and half as many more by area.
    """
    rng = np.random.default_rng(settings.seed)
    area = face_normals(world.positions, world.faces)[1] * world.face_samples
    by_area = rng.choice(len(area), points, p=area / area.sum())
    by_face = rng.choice(np.flatnonzero(area > 0), points // 2)
    face = np.concatenate([by_area, by_face])
    order = np.argsort(face, kind="stable")
    face = face[order]
    root, v = np.sqrt(rng.random(len(face))), rng.random(len(face))
    samples = SampleSet(
        face=face.astype(np.int32),
        barycentric=np.column_stack([1.0 - root, v * root]).astype(np.float32),
        area=np.ones(len(face), np.float32),
        index=(np.arange(len(face)) - np.searchsorted(face, face)).astype(np.int32),
        face_seed=place_samples(world, settings).face_seed,
    )
    half = settings.replaced(rays=max(settings.rays // 2, 1))
    other = SampleSet(samples.face, samples.barycentric, samples.area, samples.index, ~samples.face_seed)
    tallies = [trace_samples(world, which, half) for which in (samples, other)]
    hits = sum(tally.hits.astype(np.int64) for tally in tallies)
    backs = sum(tally.back_faces.astype(np.int64) for tally in tallies)
    valid = backs <= settings.back_face_threshold * hits
    sent = sum(tally.rays.astype(np.int64) for tally in tallies)
    valid_of_all = backs <= settings.back_face_threshold * sent
    halves = np.stack([tally.ao.astype(np.float64) for tally in tallies])
    first_two = samples.barycentric.astype(np.float64)
    mixed = (order < points // 2) | (order >= points)
    return SurfaceTruth(
        face=face.astype(np.int64),
        corners=world.faces[face].astype(np.int64),
        weights=np.column_stack([first_two, 1.0 - first_two.sum(axis=1)]),
        ao=halves.mean(axis=0),
        halves=halves,
        sets={
            "mixed": np.flatnonzero(valid & mixed),
            "area": np.flatnonzero(valid & (order < points)),
            OF_ALL_RAYS: np.flatnonzero(valid_of_all & (order < points)),
        },
    )


def trace_samples(world: World, samples: SampleSet, settings: BakeSettings) -> Tally:
    """Traces samples of their own making."""
    tally = Tally.empty(len(samples), settings.distance_count)
    with create_tracer(world, settings, resolve(settings.device)) as tracer:
        for batch in samples.batches(tracer.batch_size):
            tracer.accumulate(samples, batch, tally)
    return tally


def finest_piecewise_linear(world: World, settings: BakeSettings, *, rays: int = 32, per_face: int = 8) -> Float32Array:
    """AO at the vertices by which linear interpolation comes closest to the truth, shape (n, k): the mapping's floor.

    Least squares without smoothing from many more and better samples than any bake takes.
    """
    from bake.solve import map_to_vertices

    fine = settings.replaced(rays=rays, samples_per_face=(per_face, 2 * per_face), alpha=0.0)
    samples = place_samples(world, fine)
    tally = trace_samples(world, samples, fine)
    return map_to_vertices(world, samples, tally.ao, tally.valid(fine.back_face_threshold), fine).ao
