"""What each sample counts for in one value: the adjoint of the mapping to vertices.

The least squares fit solves A x = b + p x̄ within 0 ≤ x ≤ 1, where b and x̄ are linear in the samples (r, the strength
of the prior, taken as it is). At the solution the bounds push with λ = A x - (b + p x̄), which is 0 wherever x is
strictly inside. So with A a = e_v

    x_v = a·(b + p x̄) + a·λ = Σ_s w_s AO_s + Σ_held a_j λ_j,

exactly, and whatever the bounds do: the first sum is what the samples ask for, with weights that add up to 1 and are
the same for every distance; the second is what the bounds change, vertex by vertex. Written for what is missing to 1,

    1 - x_v = Σ_s w_s (1 - AO_s) - Σ_held a_j λ_j.

The derivative of the value, on the other hand, follows the bounds: a held vertex does not answer to its samples.
`Adjoint.derivative` gives that: the free unknowns solve the linear system, the held ones are constants.

A sample's weight is dA φ·g, where g_i = (1 + r_i) a_i at a vertex with samples; starved vertices pass theirs on
along the fill. For the weighted average, g = φ / m at the vertex itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from bake.explain.fill import Fill
from bake.explain.greens import Column, Greens
from bake.settings import BakeSettings, MappingKind
from bake.solve.mapper import VertexMapper
from bake.types import BoolArray, Float32Array, Float64Array, Int64Array, SampleSet, VertexField

TOLERANCE = 1e-7
"""Bound on what leaving out far samples may change, in AO."""

HELD = 1e-6
"""How far beyond a bound a value must want to go, judged by its own row, to count as held; rounding is below."""


@dataclass(frozen=True, slots=True)
class Weights:
    """The samples behind one value.

    Attributes:
        sample: Shape (n,), int64, sorted.
        weight: Shape (n,), float64.
        held: Shape (h,), int64: unknowns at a bound that reach the value.
        effect: Shape (h, k), float64: what the value gains by each.
        constant: Weight of no sample at all: 1 where the scene has no valid sample, and values are 1.
        cut_off: Bound on the error by what was left out, in AO.
    """

    sample: Int64Array
    weight: Float64Array
    held: Int64Array
    effect: Float64Array
    constant: float
    cut_off: float


class Adjoint:
    """The adjoint of one solve, kept for any number of values.

    Args:
        mapper: Over the scene and its samples.
        samples: The samples.
        ao: Shape (n, k), float32: the samples' AO.
        valid: Shape (n,), bool.
        field: What the mapper made of them.
        settings: Mapping and alpha.
    """

    def __init__(
        self,
        mapper: VertexMapper,
        samples: SampleSet,
        ao: Float32Array,
        valid: BoolArray,
        field: VertexField,
        settings: BakeSettings,
    ) -> None:
        self.surface = mapper.surface
        self._samples = samples
        equations = mapper.equations(ao, valid)
        self.starved, self._mass = equations.starved, equations.mass
        self._valid = valid
        self._fill = Fill(self.surface, self.starved) if self.starved.any() else None
        self._receiving = np.flatnonzero(self.surface.row >= 0)
        self._around = _faces_around(self.surface.corners, self.surface.unknown_count)
        has = np.flatnonzero(self.surface.unknown >= 0)
        self.values = np.zeros((self.surface.unknown_count, ao.shape[1]))
        self.values[self.surface.unknown[has]] = field.ao[has]
        self.vertex = np.full(self.surface.unknown_count, -1, np.int64)
        self.vertex[self.surface.unknown[has][::-1]] = has[::-1]  # the first of those that share an unknown

        size = self.surface.unknown_count
        self._greens: Greens | None = None
        self._scale, self._pull, self._push = np.ones(size), np.zeros(size), np.zeros_like(self.values)
        self._held = np.zeros(self.values.shape, np.bool_)
        self.averaged = np.full(size, settings.mapping is MappingKind.AVERAGE)
        if settings.mapping is not MappingKind.AVERAGE:
            system = mapper.system(ao, valid, alpha=settings.alpha)
            if field.report.averaged:
                self.averaged = _fallen_back(self.surface.first, self.values, system.average)
            self._greens = Greens(system.matrix)
            self._scale = 1.0 + system.strength
            self._pull = np.where(self.starved, system.matrix @ np.ones(size), 0.0)
            self._push = system.matrix @ self.values - system.rhs
            wants_out = self._push / self._greens.diagonal[:, None]
            self._held = ((self.values <= 0) & (wants_out > HELD)) | ((self.values >= 1) & (wants_out < -HELD))

    @property
    def solver_error(self) -> Float64Array:
        """How far values strictly inside the bounds are from solving their own row, shape (u, k), in AO."""
        if self._greens is None:
            return np.zeros_like(self.values)
        inside = (self.values > 0) & (self.values < 1) & ~self.averaged[:, None]
        return np.where(inside, self._push / self._greens.diagonal[:, None], 0.0)

    def weights(self, unknowns: Int64Array, shares: Float64Array, *, tolerance: float = TOLERANCE) -> Weights:
        """The weights behind a weighted mean of unknowns.

        Args:
            unknowns: Shape (m,), int64, distinct.
            shares: Shape (m,), float64, adding up to 1.
            tolerance: Bound on what may be left out, in AO.
        """
        mean = self.averaged[unknowns]
        column = self._column(unknowns[~mean], shares[~mean], tolerance)
        at_bound = self._held[column.unknowns].any(axis=1)
        held = column.unknowns[at_bound]
        effect = np.where(self._held[held], self._push[held] * column.values[at_bound, None], 0.0)
        return self._gathered(column, unknowns[mean], shares[mean], held, effect)

    def derivative(
        self, unknowns: Int64Array, shares: Float64Array, distance: int, *, tolerance: float = TOLERANCE
    ) -> Weights:
        """How the value of one distance answers to each sample while the held vertices stay held.

        `Weights.held` and `effect` are the constants: bound times coefficient, so that Σ weight × AO + Σ effect is the
        value; the weights add up to 1 less the coefficients.

        Args:
            unknowns, shares, tolerance: As for `weights`.
            distance: Column of the AO.
        """
        mean = self.averaged[unknowns]
        fixed = self._held[:, distance]
        column = self._column(unknowns[~mean], shares[~mean], tolerance, fixed)
        own = fixed[unknowns] & ~mean
        held = np.concatenate([column.fixed, unknowns[own]])
        coefficient = np.concatenate([column.coefficients, shares[own]])
        effect = np.full((len(held), self.values.shape[1]), np.nan)
        effect[:, distance] = coefficient * self.values[held, distance]
        return self._gathered(column, unknowns[mean], shares[mean], held, effect)

    def reach(self, unknowns: Int64Array, shares: Float64Array, tolerance: float) -> Int64Array:
        """The unknowns whose right-hand sides matter to a weighted mean of unknowns, sorted; arguments as `weights`."""
        mean = self.averaged[unknowns]
        return np.union1d(unknowns, self._column(unknowns[~mean], shares[~mean], tolerance).unknowns)

    def rings(self, unknowns: Int64Array, count: int) -> Int64Array:
        """The unknowns within `count` faces of some, sorted."""
        for _ in range(count):
            unknowns = np.unique(self.surface.corners[self.faces_around(unknowns)])
        return unknowns

    def faces_around(self, unknowns: Int64Array) -> Int64Array:
        """Rows of `Surface.corners` of the faces that touch some unknowns, sorted."""
        return np.unique(self._around.indices[_entries(self._around.indptr, unknowns)]).astype(np.int64)

    def all_samples_on(self, rows: Int64Array) -> Int64Array:
        """The samples on some faces, given as sorted rows of `Surface.corners`, valid or not; sorted, shape (n,)."""
        face = self._receiving[rows]
        begin = np.searchsorted(self._samples.face, face)
        count = np.searchsorted(self._samples.face, face, side="right") - begin
        return (np.repeat(begin - (np.cumsum(count) - count), count) + np.arange(int(count.sum()))).astype(np.int64)

    def samples_on(self, rows: Int64Array) -> Int64Array:
        """The valid ones of them."""
        every = self.all_samples_on(rows)
        return every[self._valid[every]]

    def _column(
        self, unknowns: Int64Array, shares: Float64Array, tolerance: float, fixed: BoolArray | None = None
    ) -> Column:
        if self._greens is None or not len(unknowns):
            nothing, none = np.zeros(0, np.int64), np.zeros(0)
            return Column(nothing, none, 0.0, nothing, none)
        return self._greens.column(unknowns, shares, tolerance=tolerance, fixed=fixed)

    def _gathered(
        self, column: Column, mean: Int64Array, mean_share: Float64Array, held: Int64Array, effect: Float64Array
    ) -> Weights:
        """From a column of A⁻¹ and the shares of plain averages at some unknowns to the weights of samples."""
        starved = self.starved[column.unknowns]
        pull = column.values[starved] * self._pull[column.unknowns[starved]]
        source = np.concatenate([column.unknowns[starved], mean])
        amount = np.concatenate([pull, mean_share])
        total = float(amount.sum())
        if self._fill is not None:
            source, amount = self._fill.sources(source, amount)
        constant = total - float(amount.sum())
        fitted = column.unknowns[~starved]
        every = np.union1d(fitted, source)
        g = np.zeros(len(every))
        g[np.searchsorted(every, fitted)] = column.values[~starved] * self._scale[fitted]
        np.add.at(g, np.searchsorted(every, source), amount / self._mass[source])
        sample, weight = self._to_samples(every, g)
        return Weights(sample, weight, held, effect, constant if abs(constant) > 1e-12 else 0.0, column.cut_off)

    def _to_samples(self, unknowns: Int64Array, g: Float64Array) -> tuple[Int64Array, Float64Array]:
        """dA φ·g for all valid samples on faces around the unknowns."""
        sample = self.samples_on(self.faces_around(unknowns))
        corners = self.surface.corners[self.surface.row[self._samples.face[sample]]]
        place = np.minimum(np.searchsorted(unknowns, corners), max(len(unknowns) - 1, 0))
        at_corner = np.where(unknowns[place] == corners, g[place], 0.0) if len(unknowns) else np.zeros(corners.shape)
        phi = np.empty((len(sample), 3))
        phi[:, :2] = self._samples.barycentric[sample]
        phi[:, 2] = 1.0 - phi[:, 0] - phi[:, 1]
        area = self._samples.area[sample].astype(np.float64)
        return sample, area * np.einsum("ij,ij->i", phi, at_corner)


def _entries(start: np.ndarray, rows: Int64Array) -> Int64Array:
    """Places of the entries of some rows of a compressed matrix."""
    begin = start[rows].astype(np.int64)
    count = start[rows + 1] - begin
    return np.repeat(begin - (np.cumsum(count) - count), count) + np.arange(int(count.sum()))


def _faces_around(corners: Int64Array, unknowns: int) -> csr_array:
    """Faces (columns) that touch each unknown (rows)."""
    rows = np.repeat(np.arange(len(corners), dtype=np.int32), 3)
    touch = (np.ones(corners.size, np.bool_), (corners.ravel().astype(np.int32), rows))
    return csr_array(touch, shape=(unknowns, len(corners)))


def _fallen_back(first: Int64Array, values: Float64Array, average: Float64Array) -> BoolArray:
    """Unknowns of components that did not converge and keep their average, shape (u,)."""
    apart = np.abs(values - average).max(axis=1)
    worst = np.maximum.reduceat(apart, first[:-1])
    back = (worst < 1e-6) & (np.diff(first) > 1)
    return np.repeat(back, np.diff(first))
