"""Values on the way: the last ones, moved by what the samples looked at so far say changed around each vertex."""

from __future__ import annotations

import numpy as np

from bake.geometry import face_normals
from bake.rebake.state import Edit
from bake.rebake.types import Partial
from bake.types import BakeResult, BoolArray, Float32Array, Float64Array, Int64Array, SampleSet


class DeltaPreview:
    """Spreads the changes of samples to the corners of their faces.

    A vertex moves by the mean change of the samples around it, weighted by area and nearness; one that has no value
    yet takes the mean of the values. Noise of the samples that is the same before and after cancels.
    """

    def __init__(self, result: BakeResult, edit: Edit, samples: SampleSet) -> None:
        world = edit.world
        self._world, self._samples, self._wanted = world, samples, edit.wanted
        self._before = before = _values_before(result, edit)
        self._has_value: BoolArray = np.asarray(np.isfinite(before).all(axis=1))
        self._mass: Float64Array = np.zeros(world.vertex_count)
        self._sum: Float64Array = np.zeros(before.shape)
        self._spread: Float64Array = np.zeros(before.shape)
        self._told = np.zeros(len(samples), np.bool_)
        self._last = np.zeros((len(samples), before.shape[1]), np.float32)

    def partial(
        self, rows: Int64Array, moved: Float32Array, known: BoolArray, rays_done: int, rays_total: int
    ) -> Partial:
        """Values after some more rays.

        Args:
            rows: Shape (r,), samples just looked at, no row twice.
            moved: Shape (r, k): by how much their AO differs from before, as far as it is known; AO itself where
                there was none.
            known: Shape (r,): whether there was some.
            rays_done, rays_total: For the partial.
        """
        samples = self._samples
        corners = self._world.faces[samples.face[rows]].astype(np.int64)
        first = samples.barycentric[rows].astype(np.float64)
        weights = np.column_stack([first, 1.0 - first.sum(axis=1)]) * samples.area[rows, None]
        # A corner whose value is unknown waits for values, not for changes.
        weights *= self._has_value[corners] == known[:, None]
        flat, count = corners.ravel(), self._world.vertex_count
        fresh = ~self._told[rows]
        self._mass += np.bincount(flat, (weights * fresh[:, None]).ravel(), minlength=count)
        step = (moved - self._last[rows]).astype(np.float64)
        for column in range(moved.shape[1]):
            self._sum[:, column] += np.bincount(flat, (weights * step[:, column, None]).ravel(), minlength=count)
        self._told[rows] = True
        self._last[rows] = moved
        hit = np.zeros(count, np.bool_)
        hit[flat] = True
        vertices = np.flatnonzero(hit & self._wanted & (self._mass > 0.0))
        mean = self._sum[vertices] / self._mass[vertices, None]
        base = self._before[vertices]
        values = np.clip(np.where(np.isfinite(base), base + mean, mean), 0.0, 1.0).astype(np.float32)
        moving = (values != base).any(axis=1)
        return Partial(vertices[moving], values[moving], rays_done, rays_total)

    def spread(self, rows: Int64Array, moved: Float32Array, rays_done: int, rays_total: int) -> Partial:
        """Values where some samples changed and all others, as far as is known, did not.

        Args:
            rows: Shape (r,), samples that changed, no row twice; those of earlier calls keep what they said there.
            moved: Shape (r, k): by how much.
            rays_done, rays_total: For the partial.
        """
        world, samples = self._world, self._samples
        corners = world.faces[samples.face[rows]].astype(np.int64)
        first = samples.barycentric[rows].astype(np.float64)
        weights = np.column_stack([first, 1.0 - first.sum(axis=1)]) * samples.area[rows, None]
        hit = np.zeros(world.vertex_count, np.bool_)
        hit[corners.ravel()] = True
        around = np.flatnonzero(hit[world.faces].any(axis=1) & world.face_samples)
        areas = face_normals(world.positions, world.faces[around])[1] / 3.0
        vertices = np.flatnonzero(hit & self._wanted & self._has_value)
        place = np.full(world.vertex_count, len(vertices), np.int64)
        place[vertices] = np.arange(len(vertices))
        count = len(vertices) + 1
        mass = np.bincount(place[world.faces[around]].ravel(), np.repeat(areas, 3), minlength=count)[:-1]
        values = self._before[vertices].astype(np.float64)
        step = (moved - self._last[rows]).astype(np.float64)
        self._last[rows] = moved
        for column in range(values.shape[1]):
            change = weights * step[:, column, None]
            self._spread[vertices, column] += np.bincount(place[corners].ravel(), change.ravel(), minlength=count)[:-1]
            values[:, column] += self._spread[vertices, column] / np.maximum(mass, 1e-300)
        return Partial(vertices, np.clip(values, 0.0, 1.0).astype(np.float32), rays_done, rays_total)


def _values_before(result: BakeResult, edit: Edit) -> Float32Array:
    """The old values at the edited world's vertices, NaN where there were none."""
    former, ao = edit.change.old_vertex, result.field.ao
    if len(former) == len(ao) and np.array_equal(former, np.arange(len(ao))):
        return ao
    before = np.full((edit.world.vertex_count, edit.settings.distance_count), np.nan, np.float32)
    known = np.flatnonzero(former >= 0)
    before[known] = ao[former[known]]
    return before
