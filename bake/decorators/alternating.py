"""Local AO refined for all instances of a mesh together, by alternating least squares.

Sloan et al. 2013 name this as future work: instead of the AO of the tree alone, take the local AO that, with the best
global AO of every instance, comes closest to the gold signals of all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import cg

from bake.arrays import Float32Array, Float64Array, Int32Array
from bake.decorators.fit import GlobalFit, fit_global

PRIOR = 0.05
"""Pull towards the AO of the tree alone, relative to the pull of the samples: it holds what samples do not reach, and
settles which of the two factors a common scale belongs to."""

ROUNDS = 12
_ENOUGH = 1e-3  # relative decrease of a round that is not worth another
_HALVINGS = 12


@dataclass(frozen=True, slots=True)
class Instance:
    """One tree at the samples of its mesh.

    Attributes:
        gold: Shape (n, k); not finite where unknown.
        offsets: Shape (n, 3), metres from the tree's centre.
        area: Shape (n,), m².
    """

    gold: Float64Array
    offsets: Float64Array
    area: Float64Array


@dataclass(frozen=True, slots=True)
class Refined:
    """What came of it.

    Attributes:
        local_ao: Shape (v, k), float32, in [0, 1].
        fits: One an instance.
        objective: Shape (rounds + 1, k): the sum that is minimised, at the start and after each round; it never grows.
    """

    local_ao: Float32Array
    fits: tuple[GlobalFit, ...]
    objective: Float64Array


def refine(
    instances: Sequence[Instance],
    corners: Int32Array,
    weights: Float64Array,
    local_ao: Float32Array,
    *,
    prior: float = PRIOR,
    rounds: int = ROUNDS,
) -> Refined:
    """Minimises Σ_j Σ_i a (f - G_j L)² + prior · Σ_v m (L - L₀)² in turns over all G_j and over L in [0, 1].

    Each turn is a linear least-squares problem: the G_j as in `fit_global`, L by conjugate gradients. Where L would
    leave [0, 1] it is cut off, and the step is halved until the sum has not grown; so it decreases monotonically.

    Args:
        instances: Trees of one mesh, at least one.
        corners: Shape (n, 3): the vertices around each sample.
        weights: Shape (n, 3): their barycentric weights.
        local_ao: Shape (v, k): L₀, the AO of the tree alone; also where L starts.
        prior: Weight of staying near L₀.
        rounds: At most.
    """
    start = local_ao.astype(np.float64)
    count, k = start.shape
    rows = np.repeat(np.arange(len(corners)), 3)
    spread = csr_array((weights.ravel(), (rows, corners.ravel())), shape=(len(corners), count))
    scale = sum(float(item.area.sum()) for item in instances)
    known = [np.isfinite(item.gold) for item in instances]
    golds = [np.where(there, item.gold, 0.0) for item, there in zip(instances, known, strict=True)]
    areas = [np.where(there, item.area[:, None], 0.0) / scale for item, there in zip(instances, known, strict=True)]
    mass = np.asarray(spread.T @ np.sum(areas, axis=0))  # (v, k): what the samples weigh at each vertex
    hold = prior * mass + 1e-9 * max(float(mass.max(initial=0.0)), 1e-30)

    def fitted(local: Float64Array) -> tuple[GlobalFit, ...]:
        at_samples = np.asarray(spread @ local)
        return tuple(fit_global(item.gold, at_samples, item.offsets, item.area) for item in instances)

    def cost(local: Float64Array, levels: Sequence[Float64Array]) -> Float64Array:
        at_samples = np.asarray(spread @ local)
        data = [(a * (f - g * at_samples) ** 2).sum(axis=0) for a, f, g in zip(areas, golds, levels, strict=True)]
        return np.sum(data, axis=0) + (hold * (local - start) ** 2).sum(axis=0)

    local, fits = start, fitted(start)
    levels = [fit.at(item.offsets) for fit, item in zip(fits, instances, strict=True)]
    history = [cost(local, levels)]
    for _ in range(rounds):
        stiff: Float64Array = np.sum([a * g * g for a, g in zip(areas, levels, strict=True)], axis=0)
        pull: Float64Array = np.sum([a * g * f for a, g, f in zip(areas, levels, golds, strict=True)], axis=0)
        wanted = np.empty_like(local)
        for j in range(k):
            matrix = csr_array(spread.T @ _diagonal(stiff[:, j]) @ spread + _diagonal(hold[:, j]))
            rhs = np.asarray(spread.T @ pull[:, j]) + hold[:, j] * start[:, j]
            wanted[:, j] = cg(
                matrix, rhs, x0=local[:, j], rtol=1e-8, maxiter=500, M=_diagonal(1.0 / matrix.diagonal())
            )[0]
        local = _towards(local, wanted, partial(cost, levels=levels))
        refitted = fitted(local)
        fresh = [fit.at(item.offsets) for fit, item in zip(refitted, instances, strict=True)]
        # Slopes that the fit leaves out could make it worse than the one before; then that one stays.
        if (cost(local, fresh) <= cost(local, levels)).all():
            fits, levels = refitted, fresh
        history.append(cost(local, levels))
        if (history[-2] - history[-1] <= _ENOUGH * history[-2]).all():
            break
    return Refined(local.astype(np.float32), fits, np.array(history))


def _towards(local: Float64Array, wanted: Float64Array, cost: Callable[[Float64Array], Float64Array]) -> Float64Array:
    """The farthest of some steps towards `wanted`, cut off at 0 and 1, that does not cost more, for each column."""
    before, step = cost(local), np.ones(local.shape[1])
    there = local
    for _ in range(_HALVINGS):
        there = np.clip(local + step * (wanted - local), 0.0, 1.0)
        worse = cost(there) > before
        if not worse.any():
            return there
        step = np.where(worse, 0.5 * step, step)
    return np.where(cost(there) > before, local, there)


def _diagonal(values: Float64Array) -> csr_array:
    index = np.arange(len(values))
    return csr_array((values, (index, index)), shape=(len(values), len(values)))
