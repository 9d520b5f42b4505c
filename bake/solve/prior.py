"""How far the samples around a vertex are to be trusted against their own average.

With few and noisy samples the least squares slope inside a face is mostly noise. The prior pulls a vertex towards its
weighted average x̄ with the weight r m (m the lumped mass):

    (M + diag(r m)) x = b + r m x̄ = (1 + r) b,

which mixes the consistent with the lumped mass matrix: r = 0 is least squares, r → ∞ the weighted average.

The strength is the noise-to-signal ratio of the slopes, measured where the vertex is (empirical Bayes). A plane fitted
to the n samples of a face splits their scatter into the part S that the plane explains (2 degrees of freedom) and the
rest E (n - 3): with σ² the variance of a sample about the plane and τ² that of the true slope,

    E[S / 2] = σ² + n τ²,    E[E / (n - 3)] = σ²,

so F = (S / 2) / (E / (n - 3)), pooled over the faces around the vertex, tells n τ² / σ² = F - 1. For the slope of a
lone triangle M has the weight 1/12 and the lumped mass 4/12, so that r m adds 3 r per unit of data and the optimal
shrinkage 1 / (1 + σ² / (n τ²)) would be reached at r = 1 / (3 (F - 1)). Faces share their corners and the bounds 0 and
1 know part of the same, so less is best: r = `SHARE` / (F - 1), measured on real levels. Samples without noise give
r = 0 and lose nothing; half as many samples give r twice as large.

References: James and Stein 1961 and Efron and Morris 1973 for shrinkage by the F ratio.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bake.solve.mass import FaceMoments, at_corners
from bake.solve.surface import Surface
from bake.types import BoolArray, Float64Array

SHARE = 0.1
"""r times (F - 1). A third is the theory of a lone triangle without bounds; docs/method-vertices.md has the figures."""

STRONGEST = 1.0
"""Bound on r: by then a slope keeps a quarter of what least squares would give it."""

POOLED_FACES = 16.0
"""How many faces' worth of the scene's mean scatter join those around a vertex, which alone are too few."""

UNKNOWN_NOISE = 0.12
"""r times samples per face where no face has the four samples that show their noise; typical of real levels."""

UNDETERMINED = 0.02
"""Least r of a vertex whose faces have too few samples to fix three corners."""

FULL_FROM_ALPHA = 0.01
"""The prior grows with alpha up to here: alpha = 0 asks for the plain least squares fit."""


CHUNK = 4096
"""Faces that are fitted at once."""


_Scatter = tuple[Float64Array, Float64Array, Float64Array, BoolArray]


@dataclass(frozen=True, slots=True)
class PooledScatter:
    """Scatter summed over the faces around each unknown, all of shape (u,), float64.

    Attributes:
        explained, rest, freedom: As a plane's fit gives them for a face.
        usable: Faces with enough samples.
        count: Their samples.
    """

    explained: Float64Array
    rest: Float64Array
    freedom: Float64Array
    usable: Float64Array
    count: Float64Array


@dataclass(frozen=True, slots=True)
class Trust:
    """What the samples tell of their own reliability, whatever alpha is.

    Attributes:
        count: Shape (u,), float64: valid samples on a face, mean over the faces around the unknown that have any.
        shrinkage: Shape (u,), float64, in [0, STRONGEST]: r as the noise asks for it.
        pooled: What that follows from, but for the scene's mean.
    """

    count: Float64Array
    shrinkage: Float64Array
    pooled: PooledScatter

    def under(self, scene: SceneScatter) -> Trust:
        """The same with another mean of the scene."""
        return replace(self, shrinkage=_shrinkage(self.count, self.pooled, scene))

    def strength(self, alpha: Float64Array) -> Float64Array:
        """r at every unknown, shape (u,), for the alpha there, shape (u,)."""
        wanted = self.shrinkage * np.minimum(1.0, alpha / FULL_FROM_ALPHA)
        return np.maximum(wanted, UNDETERMINED * np.clip(4.0 - self.count, 0.0, 1.0))


@dataclass(frozen=True, slots=True)
class SceneScatter:
    """The mean face of a scene: what is pooled with the faces around each unknown.

    Attributes:
        explained, rest, freedom, count: As a plane's fit gives them for one face; all 0 if no face has enough samples.
    """

    explained: float
    rest: float
    freedom: float
    count: float


@dataclass(frozen=True, slots=True)
class ScatterSums:
    """What the mean of a scene is made of: sums over its faces, which add up and can be taken apart.

    Attributes:
        explained, rest, freedom, count: Sums of what `SceneScatter` has the means of.
        faces: Faces with enough samples.
    """

    explained: float
    rest: float
    freedom: float
    count: float
    faces: float

    @staticmethod
    def of(moments: FaceMoments) -> ScatterSums:
        """Over some faces."""
        explained, rest, freedom, usable = _scatter(moments)
        return ScatterSums(
            float(explained.sum()),
            float(rest.sum()),
            float(freedom.sum()),
            float(moments.count[usable].sum()),
            float(np.count_nonzero(usable)),
        )

    def plus(self, other: ScatterSums, sign: float = 1.0) -> ScatterSums:
        """The sums over more faces, or over fewer with a sign of -1."""
        return ScatterSums(
            self.explained + sign * other.explained,
            self.rest + sign * other.rest,
            self.freedom + sign * other.freedom,
            self.count + sign * other.count,
            self.faces + sign * other.faces,
        )

    def mean(self) -> SceneScatter:
        """The mean face; all 0 if no face has enough samples, whatever rounding left of the sums."""
        if self.faces < 0.5:
            return SceneScatter(0.0, 0.0, 0.0, 0.0)
        explained, rest = max(self.explained, 0.0), max(self.rest, 0.0)
        return SceneScatter(
            explained / self.faces, rest / self.faces, self.freedom / self.faces, self.count / self.faces
        )


def scene_scatter(moments: FaceMoments) -> SceneScatter:
    """The mean over the faces whose samples show their noise."""
    return _mean_scatter(moments, _scatter(moments))


def usable_faces(moments: FaceMoments) -> BoolArray:
    """Faces that have enough samples, well enough spread, to show their noise, shape (m,)."""
    return _scatter(moments)[3]


def _mean_scatter(moments: FaceMoments, scatter: _Scatter) -> SceneScatter:
    explained, rest, freedom, usable = scatter
    faces = max(int(usable.sum()), 1)
    count = float(moments.count[usable].sum())
    return SceneScatter(
        float(explained.sum()) / faces, float(rest.sum()) / faces, float(freedom.sum()) / faces, count / faces
    )


def estimate_trust(surface: Surface, moments: FaceMoments, scene: SceneScatter | None = None) -> Trust:
    """Compares signal and noise around every unknown.

    Args:
        surface: The welded surface.
        moments: Sums of the valid samples.
        scene: The mean of the whole scene, where `surface` is a part of it; by default that of `moments`.
    """
    count, scatter = _mean_count(surface, moments), _scatter(moments)
    pooled = _pooled(surface, moments, scatter)
    return Trust(count, _shrinkage(count, pooled, scene or _mean_scatter(moments, scatter)), pooled)


def _mean_count(surface: Surface, moments: FaceMoments) -> Float64Array:
    """Valid samples on a face, mean over the faces around each unknown that have any, shape (u,)."""
    total = at_corners(surface, np.repeat(moments.count[:, None], 3, axis=1))
    faces = at_corners(surface, np.repeat((moments.count > 0).astype(np.float64)[:, None], 3, axis=1))
    return total / np.maximum(faces, 1.0)


def _pooled(surface: Surface, moments: FaceMoments, scatter: _Scatter) -> PooledScatter:
    explained, rest, freedom, usable = scatter
    per_face = (explained, rest, freedom, usable.astype(np.float64), np.where(usable, moments.count, 0.0))
    return PooledScatter(*(at_corners(surface, np.repeat(values[:, None], 3, axis=1)) for values in per_face))


def _shrinkage(count: Float64Array, pooled: PooledScatter, scene: SceneScatter) -> Float64Array:
    """r at every unknown as the noise asks for it, shape (u,): `SHARE` σ² / τ² over the samples on a face."""
    if scene.freedom <= 0:
        return np.minimum(UNKNOWN_NOISE / np.maximum(count, 1.0), STRONGEST)
    variance = (pooled.rest + POOLED_FACES * scene.rest) / (pooled.freedom + POOLED_FACES * scene.freedom)
    signal = (pooled.explained + POOLED_FACES * scene.explained) / 2.0 - variance * (pooled.usable + POOLED_FACES)
    per_sample = signal / (pooled.count + POOLED_FACES * scene.count)
    with np.errstate(divide="ignore", invalid="ignore"):
        noise = np.where(variance > 0, SHARE * variance / per_sample, 0.0)
    # no slope beyond what noise explains: nothing speaks against the average
    noise = np.where((per_sample > 0) | (variance <= 0), noise, np.inf)
    return np.minimum(noise / np.maximum(count, 1.0), STRONGEST)


def _scatter(moments: FaceMoments) -> _Scatter:
    """`_scatter_of` of faces by the thousand, which stay in the processor's cache."""
    faces = len(moments.count)
    if faces <= CHUNK:
        return _scatter_of(moments)
    parts = [_scatter_of(moments.between(begin, begin + CHUNK)) for begin in range(0, faces, CHUNK)]
    explained, rest, freedom, usable = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    return explained, rest, freedom, usable


def _scatter_of(moments: FaceMoments) -> _Scatter:
    """Explained and remaining squares of a plane fitted to each face's samples, summed over the distances.

    Returns:
        S, E and E's degrees of freedom, shape (m,); and on which faces they could be had, shape (m,), bool.
    """
    total = moments.mass.sum(axis=1)
    share = np.where(moments.count > 0, moments.count / np.where(total > 0, total, 1.0), 0.0)
    p, q, r = (moments.square * share[:, None]).T
    pq, qr, rp = (moments.mixed * share[:, None]).T
    # adjugate of the symmetric 3 × 3 moment matrix
    a, b, c = q * r - qr * qr, r * p - rp * rp, p * q - pq * pq
    ab, bc, ca = qr * rp - pq * r, rp * pq - qr * p, pq * qr - rp * q
    determinant = p * a + pq * ab + rp * ca
    usable = (moments.count >= 4) & (determinant > 1e-5 * moments.count**3)
    inverse = np.where(usable, 1.0 / np.where(usable, determinant, 1.0), 0.0)
    columns = moments.value.shape[2]
    explained, rest = np.zeros(len(total)), np.zeros(len(total))
    for k in range(columns):
        u, v, w = (moments.value[:, :, k] * share[:, None]).T
        fitted = inverse * (a * u * u + b * v * v + c * w * w + 2.0 * (ab * u * v + bc * v * w + ca * w * u))
        mean_square = (u + v + w) ** 2 / np.maximum(moments.count, 1.0)
        explained += np.where(usable, np.maximum(fitted - mean_square, 0.0), 0.0)
        rest += np.where(usable, np.maximum(moments.value_square[:, k] * share - fitted, 0.0), 0.0)
    # sums over columns keep the degrees of freedom of one column, so that their ratio is that of the mean column
    freedom = np.where(usable, moments.count - 3.0, 0.0)
    return explained, rest, freedom, usable
