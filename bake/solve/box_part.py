"""Whole connected components of a system that is scaled to a unit diagonal, as the solvers under bounds see them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from bake.types import BoolArray, Float64Array, Int64Array


@dataclass(frozen=True, slots=True)
class BoxPart:
    """Some whole components of the scaled system."""

    matrix: csr_array
    scale: Float64Array  # root of the diagonal, and thereby the upper bound of a scaled unknown
    begin: Int64Array  # first unknown of each component
    sizes: Int64Array  # unknowns of each component
    component: Int64Array  # of each unknown
    reach: Float64Array | None = None  # one over the gradient at which an unknown counts as solved; by norms if None

    def sum(self, values: Float64Array) -> Float64Array:
        """Sums over each component."""
        return np.add.reduceat(values, self.begin)

    def spread(self, per_component: NDArray[Any]) -> NDArray[Any]:
        """Each component's value at its unknowns."""
        return np.repeat(per_component, self.sizes)

    def only(self, components: BoolArray, unknowns: BoolArray) -> BoxPart:
        """The part that is left when other components are done."""
        component = (np.cumsum(components) - 1)[self.component[unknowns]]
        return BoxPart(
            matrix=self.matrix[unknowns][:, unknowns],
            scale=self.scale[unknowns],
            begin=np.cumsum(self.sizes[components]) - self.sizes[components],
            sizes=self.sizes[components],
            component=component,
            reach=None if self.reach is None else self.reach[unknowns],
        )
