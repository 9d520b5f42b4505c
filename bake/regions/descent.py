"""Block coordinate descent over the models of regions, one region after the other (Sloan et al. 2013, section 2.3)."""

from __future__ import annotations

import math

import numpy as np
from scipy.sparse import bsr_array

from bake import spherical_harmonics
from bake.arrays import Float64Array, Int32Array, Int64Array
from bake.region_types import PARAMETERS
from bake.regions.colouring import colouring
from bake.regions.evaluate import AXIS_NORMALS

SPHERE = 4.0 * math.pi


class Descent:
    """The models of one distance, in coordinates in which their distance from the fit is a plain sum of squares.

    With G = L Lᵀ the Gram matrix of a region's basis functions, y = Lᵀ d for parameters d, and the value at a place is
    (L⁻¹ φ)ᵀ y. A region's minimum is then K (y_fit + Σ w φ t), K = (1 + Σ w φ φᵀ)⁻¹, t its neighbours' values.

    Attributes:
        y: Shape (r, 7, 9), as they stand.

    Args:
        start: Shape (r, 7, 9): y of the fit.
        ends: Shape (l, 2): the regions of each link.
        phi: Shape (2, l, p, 7): L⁻¹ φ of both ends at the places of each link.
        derivatives: Shape (r, 6, 7): what makes derivatives of y, 1/m.
    """

    def __init__(self, start: Float64Array, ends: Int32Array, phi: Float64Array, derivatives: Float64Array) -> None:
        self.y = start.copy()
        self._start, self._ends, self._phi, self._derivatives = start, ends.astype(np.int64), phi, derivatives
        self._colour = colouring(len(start), ends)
        self._apart: Float64Array | None = None
        self._lobes = spherical_harmonics.evaluate(AXIS_NORMALS).T

    def weigh(self, weights: Float64Array, steep: Float64Array) -> None:
        """Sets the weights and prepares sweeps: what rests in each region, and what neighbours add.

        Args:
            weights: Shape (l, p): of what models are apart at places.
            steep: Shape (r, 6): of their derivatives.
        """
        self._weights, self._steep = weights, steep
        count = len(self._start)
        first, second = self._phi
        turned = np.swapaxes(first * weights[:, :, None], 1, 2)
        mixed = turned @ second
        own = np.concatenate([turned @ first, np.swapaxes(second * weights[:, :, None], 1, 2) @ second])
        one_end, other_end = self._ends.T.ravel(), self._ends[:, ::-1].T.ravel()
        pull = np.swapaxes(self._derivatives * steep[:, :, None], 1, 2) @ self._derivatives
        order = np.argsort(one_end, kind="stable")
        linked, firsts = np.unique(one_end[order], return_index=True)
        pull[linked] += np.add.reduceat(own[order], firsts)
        answer = np.linalg.inv(np.eye(PARAMETERS) + pull)
        resting = answer @ self._start
        added = answer[one_end] @ np.concatenate([mixed, np.swapaxes(mixed, 1, 2)])
        self._steps: list[tuple[Int64Array, Float64Array, bsr_array]] = []
        for number in range(int(self._colour[linked].max()) + 1):
            regions = linked[self._colour[linked] == number]
            here = order[self._colour[one_end[order]] == number]
            starts = np.concatenate([[0], np.cumsum(np.bincount(one_end[here], minlength=count)[regions])])
            matrix = bsr_array(
                (added[here], other_end[here], starts), shape=(len(regions) * PARAMETERS, count * PARAMETERS)
            )
            self._steps.append((regions, resting[regions], matrix))

    def sweep(self) -> float:
        """Sets every region once to its minimum; returns the most that a model moved: the RMS of its AO."""
        before, self._apart = self.y.copy(), None
        for regions, resting, matrix in self._steps:
            self.y[regions] = resting + (matrix @ self.y.reshape(-1, self.y.shape[2])).reshape(resting.shape)
        return math.sqrt(float(((self.y - before) ** 2).sum(axis=(1, 2)).max(initial=0.0)) / SPHERE)

    def apart(self) -> Float64Array:
        """Harmonics at each place by the first region less those by the second, shape (l, p, 9)."""
        apart = self._apart
        if apart is None:
            first, second = self._ends.T
            apart = self._apart = self._phi[0] @ self.y[first] - self._phi[1] @ self.y[second]
        return apart

    def steps(self) -> Float64Array:
        """AO by the first region less that by the second, the largest over six axis normals, shape (l, p)."""
        return np.abs(self.apart() @ self._lobes).max(axis=2)

    def slopes(self) -> Float64Array:
        """AO a metre along each half axis, the largest over six axis normals, shape (r, 6)."""
        return np.abs((self._derivatives @ self.y) @ self._lobes).max(axis=2)

    def energy(self) -> float:
        """E under the weights as they are, in squared AO."""
        moved = ((self.y - self._start) ** 2).sum()
        apart, slopes = self.apart(), self._derivatives @ self.y
        pulled = (self._weights * np.einsum("lpc,lpc->lp", apart, apart)).sum()
        held = (self._steep * np.einsum("rac,rac->ra", slopes, slopes)).sum()
        return float(moved + pulled + held) / SPHERE
