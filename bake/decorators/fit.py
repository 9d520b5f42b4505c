"""Global AO of a tree: the linear function that, times its local AO, comes closest to the gold signal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.arrays import BoolArray, Float64Array

THIN = 1e-2
"""A direction along which the samples spread less than this share of their largest spread determines no slope."""

_POINT = 1e-3
"""Samples that spread less than this share of the tree's reach about its centre count as one point."""

_DARK = 1e-8  # local AO whose mean square is below this determines nothing


@dataclass(frozen=True, slots=True)
class GlobalFit:
    """A linear function of position for each of k distances.

    Attributes:
        coefficients: Shape (4, k), float64: constant, and slopes per metre about the centre.
        terms: Shape (k,), int64, 0 to 4: how many of the four the samples determined.
        condition: Shape (k,), float64: condition number of the normal equations that were solved; 1 where none were.
    """

    coefficients: Float64Array
    terms: np.ndarray[tuple[int], np.dtype[np.int64]]
    condition: Float64Array

    def at(self, offsets: Float64Array) -> Float64Array:
        """Values at positions relative to the centre: (n, 3) → (n, k)."""
        return self.coefficients[0] + offsets @ self.coefficients[1:]


def fit_global(gold: Float64Array, local: Float64Array, offsets: Float64Array, area: Float64Array) -> GlobalFit:
    """Minimises Σ a (f - G L)² over the four coefficients of G (Sloan et al. 2013, equation 3).

    The normal equations have weights a L² and the basis 1, x, y, z. Moved to the weighted mean of the positions and
    turned to the principal axes of their spread, they are diagonal, so that nothing ill-conditioned is ever
    inverted: axes along which the samples hardly spread (a flat card's normal, all of a point) are left out, and the
    slope along them is zero. With positions in units of the farthest one, what is solved has a condition number of at
    most 3 · 10⁶ (where the samples that count crowd in a spot off the centre), and of at most 10⁴ among the slopes.

    Args:
        gold: Shape (n, k): f; samples where it is not finite are left out.
        local: Shape (n, k): L. All ones fit the linear function alone.
        offsets: Shape (n, 3): positions relative to the tree's centre, in metres.
        area: Shape (n,), at least 0, not all 0.

    Returns:
        The fit. Where L vanishes everywhere or no gold is finite, G is 1 and no term is determined.
    """
    k = gold.shape[1]
    coefficients, terms, condition = np.zeros((4, k)), np.zeros(k, np.int64), np.ones(k)
    size = float(np.abs(offsets).max(initial=0.0))
    unit = offsets / size if size > 0.0 else np.zeros_like(offsets)
    known: BoolArray = np.isfinite(gold) & np.isfinite(local)
    for j in range(k):
        use = known[:, j]
        y, terms[j], condition[j] = _fit(gold[use, j], local[use, j], unit[use], area[use])
        coefficients[0, j] = y[0]
        coefficients[1:, j] = y[1:] / size if size > 0.0 else 0.0
    return GlobalFit(coefficients, terms, condition)


def _fit(f: Float64Array, local: Float64Array, x: Float64Array, area: Float64Array) -> tuple[Float64Array, int, float]:
    total = area.sum()
    if not total > 0.0:
        return np.array([1.0, 0.0, 0.0, 0.0]), 0, 1.0
    area = area / total
    weight = area * local * local
    mass = weight.sum()
    if not mass > _DARK:
        return np.array([1.0, 0.0, 0.0, 0.0]), 0, 1.0
    mean = weight @ x / mass
    spread = x - mean
    # The residual about the constant term; Σ w (f/L) = Σ a L f, without dividing by L.
    level = (area * local) @ f / mass
    moment = spread.T @ (area * local * (f - level * local)) / mass
    covariance = (spread * weight[:, None]).T @ spread / mass
    extents, axes = np.linalg.eigh(covariance)
    wide = extents > max(extents[-1] * THIN**2, _POINT**2)
    slope = axes[:, wide] @ ((axes[:, wide].T @ moment) / extents[wide])
    solved = np.append(extents[wide], 1.0)  # the constant's own equation is 1 by the choice of weights
    return np.concatenate([[level - slope @ mean], slope]), 1 + int(wide.sum()), float(solved.max() / solved.min())


def root_mean_square(error: Float64Array, area: Float64Array) -> Float64Array:
    """Area-weighted root mean square over the samples whose error is finite: (n, k) → (k,); 0 without any."""
    known = np.isfinite(error)
    weight = np.where(known, area[:, None], 0.0)
    total = weight.sum(axis=0)
    squares = (weight * np.where(known, error, 0.0) ** 2).sum(axis=0)
    return np.sqrt(squares / np.where(total > 0.0, total, 1.0))


def model_error(gold: Float64Array, model: Float64Array, area: Float64Array) -> Float64Array:
    """RMSE of a model, cut off at 0 and 1 as a game would, against the gold signal: (n, k) → (k,)."""
    return root_mean_square(np.clip(model, 0.0, 1.0) - gold, area)
