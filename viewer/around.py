"""From surface samples to the vertices around them, and back: sums by barycentric weight."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.sparse import csc_array

from bake.types import BakeResult, BoolArray, Float64Array


class Around:
    """The samples on the faces around each vertex, each counted by its barycentric weight.

    The same sums serve everything that samples say about vertices: kept as long as the result is looked at.

    Args:
        result: The bake.
    """

    def __init__(self, result: BakeResult) -> None:
        self.result = result
        self._count = result.world.vertex_count

    @cached_property
    def _matrix(self) -> csc_array:
        samples = self.result.samples
        corners = np.asarray(self.result.world.faces)[np.asarray(samples.face)]
        first, second = np.asarray(samples.barycentric, np.float64).T
        weights = np.stack((first, second, 1.0 - first - second), axis=1)
        ends = np.arange(0, corners.size + 1, 3, dtype=np.int32)
        return csc_array((weights.ravel(), corners.ravel(), ends), shape=(self._count, len(samples)))

    @cached_property
    def valid(self) -> BoolArray:
        """Samples that the bake used, shape (samples,)."""
        return self.result.tally.valid(self.result.settings.back_face_threshold)

    @cached_property
    def every(self) -> BoolArray:
        """All samples, shape (samples,)."""
        return np.ones(len(self.result.samples), np.bool_)

    @cached_property
    def valid_mass(self) -> Float64Array:
        """Weight of the samples that the bake used, shape (n,)."""
        return self._matrix @ self.valid.astype(np.float64)

    @cached_property
    def mass(self) -> Float64Array:
        """Weight of all samples, shape (n,)."""
        return self._matrix @ self.every.astype(np.float64)

    def total(self, values: np.ndarray, *, valid: bool) -> Float64Array:
        """Σ weight × value, shape (n,), of values of all samples, or of those that the bake used."""
        every = np.asarray(values, np.float64)
        return self._matrix @ (np.where(self.valid, every, 0.0) if valid else every)

    def mean(self, values: np.ndarray, *, valid: bool) -> Float64Array:
        """Weighted mean, shape (n,); NaN where no sample is near."""
        mass = self.valid_mass if valid else self.mass
        return np.divide(self.total(values, valid=valid), mass, out=np.full(self._count, np.nan), where=mass > 0.0)

    def at_samples(self, values: np.ndarray) -> Float64Array:
        """Values of vertices, shape (n,), interpolated at all samples, shape (samples,)."""
        return self._matrix.T @ np.asarray(values, np.float64)
