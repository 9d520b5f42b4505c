"""Values on the way: the last ones, moved by what the samples traced so far say changed around each vertex."""

from __future__ import annotations

import numpy as np

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
        before = np.full((world.vertex_count, edit.settings.distance_count), np.nan, np.float32)
        known = np.flatnonzero(edit.change.old_vertex >= 0)
        before[known] = result.field.ao[edit.change.old_vertex[known]]
        self._before = before
        self._mass: Float64Array = np.zeros(world.vertex_count)
        self._sum: Float64Array = np.zeros(before.shape)

    def partial(
        self, rows: Int64Array, ao: Float32Array, before: Float32Array, rays_done: int, rays_total: int
    ) -> Partial:
        """Values after some more samples.

        Args:
            rows: Shape (r,): samples just traced.
            ao, before: Shape (r, k): what they see, and saw; NaN where nobody knows.
            rays_done, rays_total: For the partial.
        """
        samples = self._samples
        corners = self._world.faces[samples.face[rows]].astype(np.int64)
        own: BoolArray = np.asarray(
            np.isfinite(self._before[corners]).all(axis=(1, 2)) & np.isfinite(before).all(axis=1)
        )
        moved = np.where(own[:, None], ao - before, ao).astype(np.float64)
        first = samples.barycentric[rows].astype(np.float64)
        weights = np.column_stack([first, 1.0 - first.sum(axis=1)]) * samples.area[rows, None]
        count = self._world.vertex_count
        # A corner whose value is unknown waits for values, not for changes.
        fresh: BoolArray = np.asarray(~np.isfinite(self._before[corners]).all(axis=2))
        usable = fresh == ~own[:, None]
        weights = np.where(usable, weights, 0.0)
        flat = corners.ravel()
        self._mass += np.bincount(flat, weights.ravel(), minlength=count)
        for column in range(ao.shape[1]):
            self._sum[:, column] += np.bincount(flat, (weights * moved[:, column, None]).ravel(), minlength=count)
        vertices = np.unique(flat)
        vertices = vertices[(self._mass[vertices] > 0.0) & self._wanted[vertices]]
        mean = self._sum[vertices] / self._mass[vertices, None]
        base = self._before[vertices]
        values = np.clip(np.where(np.isfinite(base), base + mean, mean), 0.0, 1.0).astype(np.float32)
        return Partial(vertices, values, rays_done, rays_total)
