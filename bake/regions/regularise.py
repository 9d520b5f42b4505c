"""Neighbouring models are drawn together where their regions meet (Sloan et al. 2013, section 2.3)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bake import spherical_harmonics
from bake.arrays import BoolArray, Float32Array, Float64Array, Int32Array
from bake.region_types import RegionGraph, RegionModels
from bake.regions.bound_weights import BoundWeights
from bake.regions.crossings import Crossings, middles
from bake.regions.descent import Descent
from bake.regions.evaluate import basis
from bake.regions.gram import group_boxes
from bake.regions.metric import determined_terms, whitening
from bake.regions.mismatch import boundary_mismatch
from bake.regions.moments import Moments

LARGEST_STEP = 0.12
"""Steps of AO beyond this are drawn together harder: blended over 0.15 s, it makes 0.009 a frame at 60 Hz."""

LARGEST_SLOPE = 0.25
"""Slopes of AO beyond this, 1/m, are held back harder: at 1.5 m/s it makes 0.006 a frame at 60 Hz."""

DARK = 0.4
"""In levels that are dark at a distance, the largest step as a share of their mean AO; slopes in proportion."""

_A_ROUND = 4  # sweeps between changes of the weights
_ROUNDS = 10
_LARGEST_BETA = 1e6  # beyond it nothing changes that anyone sees, but rounding errors grow


class Regularised(NamedTuple):
    """What came of it.

    Attributes:
        models: The same models, drawn together. Their `rmse` is that of the fit: `fit.with_errors` gives the new one.
        energies: Shape (sweeps, 2), float64: E before and after each sweep, under the weights of that sweep; no sweep
            raises it.
        mismatch: Shape (l, k), float32, as `boundary_mismatch` gives it.
    """

    models: RegionModels
    energies: Float64Array
    mismatch: Float32Array


def regularise(
    models: RegionModels,
    graph: RegionGraph,
    *,
    beta: float = 1.0,
    sweeps: int = 50,
    tolerance: float = 1e-4,
    owner: Int32Array | None = None,
    moments: Moments | None = None,
    crossings: Crossings | None = None,
    largest_step: float = LARGEST_STEP,
    largest_slope: float = LARGEST_SLOPE,
) -> Regularised:
    """Minimises, by block coordinate descent over the regions,

        E = Σ_i |M_i - M_orig,i|² + Σ_i Σ_{j ∈ N(i)} Σ_q (β w_ij s_q + h_q) |M_i(b_q) - M_j(b_q)|²
            + Σ_i Σ_a g_ia |∂_a M_i|²

    |M|² is the mean square of AO over the region's valid points and over all normals, summed over the distances (see
    `metric.whitening`). b_q are the places at which a character may cross the boundary; s_q shares the weight out, half
    of it to the middle. w_ij is the area of the boundary over the area of all of i's boundaries, so that β has no unit
    and depends on no scale; a link counts from both of its ends. Derivatives that no point determined stay zero; a
    region without any point has no fit to keep to, so that its first term counts next to nothing and its model becomes
    what suits its neighbours.

    A mean over boundaries leaves steps at some, above all at small openings of large regions. So every fourth sweep the
    further weights h_q, of each distance its own, grow where models still step by more than `largest_step` and fall
    where they step less, by the square of the ratio: an iteratively reweighted least-squares problem, whose solution
    moves the fits just so far that no step is larger. The weights g_ia of derivatives do the same for slopes beyond
    `largest_slope`: else small rooms would bridge in a few frames what they differ by from their neighbours.

    A sweep sets one region after the other to its minimum while its neighbours stand still, so that E does not rise;
    regions that share no link are set side by side. For given weights E is a strictly convex quadratic, and the descent
    converges to its minimum.

    Args:
        models: As fitted.
        graph: The regions and their links.
        beta: β; 0 gives the models back as they are.
        sweeps: Most passes over all regions.
        tolerance: It ends once no model's AO changed by more, RMS, in a pass, and no step is too large.
        owner: Shape (r,): whose model each region uses (see `Regions.owner`); its own without it.
        moments: Sums over the valid points; without them |M|² is over the boxes.
        crossings: Where characters cross; the middle of each boundary without it.
        largest_step: Of AO, about the worst of six axis normals, or `DARK` of the mean AO if that is less; infinity
            for no further weights.
        largest_slope: Of AO, 1/m, in the same proportion where it is dark.
    """
    owner = np.arange(len(graph), dtype=np.int32) if owner is None else owner
    ends = owner[graph.link]
    joined = (ends[:, 0] != ends[:, 1]) & (graph.link_area > 0.0)
    if beta == 0.0 or sweeps == 0 or not joined.any():
        return Regularised(models, np.zeros((0, 2)), boundary_mismatch(models, graph))
    problem = _Problem(models, graph, owner, joined, moments, crossings or middles(graph))
    energies = problem.solve(beta, sweeps, tolerance, largest_step, largest_slope)
    regularised = problem.models()
    return Regularised(regularised, energies, boundary_mismatch(regularised, graph))


def link_weights(area: Float64Array, ends: Int32Array, count: int) -> Float64Array:
    """w_ij + w_ji of links with the given areas, shape (l,): the share of each in all boundaries of its two regions."""
    total = np.bincount(ends.ravel(), np.repeat(area, 2), count)
    return area * (1.0 / total[ends]).sum(axis=1)


def place_shares(counts: BoolArray) -> Float64Array:
    """How the weight of a link is shared among its places, shape (l, p): half to the middle, half to the others."""
    others = counts[:, 1:].sum(axis=1, keepdims=True)
    share = np.where(counts, 0.5 / np.maximum(others, 1), 0.0)
    share[:, 0] = np.where(others[:, 0] > 0, 0.5, 1.0)
    return share


class _Problem:
    """Models and places in the coordinates of the descent."""

    def __init__(
        self,
        models: RegionModels,
        graph: RegionGraph,
        owner: Int32Array,
        joined: BoolArray,
        moments: Moments | None,
        crossings: Crossings,
    ) -> None:
        self._fitted, self._owner = models, owner
        self._ends: Int32Array = owner[graph.link[joined]]
        self._half = group_boxes(graph.minimum, graph.maximum, owner)[1]
        self._free = determined_terms(models)
        self._root = whitening(models, graph, owner, self._half, self._free, moments)
        self._lengths = np.ones((len(graph), models.coefficients.shape[1]))
        self._lengths[:, 1:] = np.repeat(self._half, 2, axis=1)
        self._counts = crossings.counts[joined]
        self._share = link_weights(graph.link_area[joined], self._ends, len(graph))[:, None] * place_shares(
            self._counts
        )
        phi = np.stack([self._at(end, crossings.position[joined]) for end in self._ends.T])
        start = np.einsum("rqp,rqck->krpc", self._root, models.coefficients * self._lengths[:, :, None, None])
        inverse = np.swapaxes(np.linalg.inv(self._root), 1, 2)[:, 1:]
        self._held = self._free[:, 1:] & (np.bincount(self._ends.ravel(), minlength=len(graph)) > 0)[:, None]
        slopes = np.where(self._free[:, 1:, None], inverse / self._lengths[:, 1:, None], 0.0)
        self._descents = [Descent(own, self._ends, phi, slopes) for own in start]

    def solve(
        self, beta: float, sweeps: int, tolerance: float, largest_step: float, largest_slope: float
    ) -> Float64Array:
        """Descends; returns E before and after each sweep."""
        shown = np.minimum(1.0, DARK * self._mean() / LARGEST_STEP)
        bounds = [(largest_step * own, largest_slope * own) for own in shown.tolist()]
        weights = [
            BoundWeights(min(beta, _LARGEST_BETA) * self._share, self._counts, self._held) for _ in self._descents
        ]
        for descent, own in zip(self._descents, weights, strict=True):
            descent.weigh(own.places, own.slopes)
        energies: list[tuple[float, float]] = []
        last, rounds, reached = self._energy(), 0, False
        while len(energies) < sweeps:
            changed = max(descent.sweep() for descent in self._descents)
            energy = self._energy()
            energies.append((last, energy))
            last = energy
            settled = changed <= tolerance
            if not reached and rounds < _ROUNDS and (settled or len(energies) % _A_ROUND == 0):
                reached = self._reweigh(weights, bounds)
                rounds += 1
                last = self._energy()
            elif settled:
                break
        return np.array(energies)

    def models(self) -> RegionModels:
        """The models as they stand."""
        fitted = self._fitted
        coefficients = fitted.coefficients.copy()
        linked = np.unique(self._ends)
        y = np.stack([descent.y for descent in self._descents], axis=3)[linked]
        flat = y.reshape(*y.shape[:2], -1)
        parameters = np.linalg.solve(np.swapaxes(self._root[linked], 1, 2), flat) / self._lengths[linked, :, None]
        coefficients[linked] = np.where(self._free[linked, :, None], parameters, 0.0).reshape(y.shape)
        return RegionModels(fitted.centre, coefficients[self._owner], fitted.terms, fitted.centre_kind, fitted.rmse)

    def _reweigh(self, weights: list[BoundWeights], bounds: list[tuple[float, float]]) -> bool:
        """Changes the weights where steps or slopes are too large; returns whether none was."""
        within = True
        for descent, own, bound in zip(self._descents, weights, bounds, strict=True):
            if own.grow(descent.steps(), descent.slopes(), *bound):
                descent.weigh(own.places, own.slopes)
                within = False
        return within

    def _mean(self) -> Float64Array:
        """Mean AO of the regions at each distance, shape (k,)."""
        mean = self._fitted.coefficients[np.unique(self._owner), 0, 0].mean(axis=0)
        return np.clip(mean * spherical_harmonics.Y0, 1e-3, 1.0)

    def _energy(self) -> float:
        return sum(descent.energy() for descent in self._descents)

    def _at(self, end: Int32Array, position: Float64Array) -> Float64Array:
        """L⁻¹ φ of regions at the places of their links, shape (l, p, 7)."""
        offsets = (position - self._fitted.centre[end][:, None]) / self._half[end][:, None]
        phi = np.where(self._free[end][:, None], basis(offsets), 0.0)
        return np.swapaxes(np.linalg.solve(self._root[end], np.swapaxes(phi, 1, 2)), 1, 2).astype(np.float64)
