"""The smoothing that the samples themselves ask for: the alpha of least expected error over the surface.

The error of values x at places on the surface, against the AO there, is bias² + variance. Neither is known, but both
can be estimated from the samples f alone. What x misses the samples by, weighted and summed, is

    Σ w (f - x)² = bias² + variance at the samples + Σ w σ² - 2 Σ w cov(f, x),

with σ² the noise of a sample. Solving once more from samples with as much noise added again gives x': the covariance is
the mean of noise times (x' - x), and the variance that of (x' - x)², here over the whole surface and not at the samples
alone: with few samples a face its corners are extrapolated, and vary more there than at the samples. Both solves are
the ones of the mapping, with its bounds and its prior, which no formula for the trace of a matrix would know.

References: Efron 2004, "The Estimation of Prediction Error: Covariance Penalties and Cross-Validation" (JASA 99);
Ramani, Blu and Unser 2008 for solving twice instead of taking a trace; Rosset and Tibshirani 2020 (JASA 115) for the
error at new places rather than at the samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bake.solve.mapper import VertexMapper
from bake.solve.prior import POOLED_FACES, scene_scatter
from bake.types import BoolArray, Float32Array, Float64Array, SampleSet, VertexField, World

CANDIDATES = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0)

STRATIFIED = 0.4
"""Variance of the mean of n rays of one scrambled sequence, in p (1 - p) / n: where samples do not show their noise."""


@dataclass(frozen=True, slots=True)
class AlphaChoice:
    """What was chosen and why.

    Attributes:
        alpha: The candidate of least risk.
        risk: Shape (c,), float64: each candidate's estimated mean square error, mean of the distances, but for a
            constant; below 0 where the noise is overestimated.
        noise: Root mean square noise of a sample.
        fields: Each candidate's values.
    """

    alpha: float
    risk: Float64Array
    noise: float
    fields: tuple[VertexField, ...]


def choose_alpha(
    world: World,
    samples: SampleSet,
    ao: Float32Array,
    valid: BoolArray,
    mapper: VertexMapper,
    *,
    rays: int,
    candidates: Sequence[float] = CANDIDATES,
    seed: int = 1,
) -> AlphaChoice:
    """Solves twice for each candidate and takes the one of least estimated error.

    Half of the weight is spread by area and half evenly over the faces that have valid samples.

    Args:
        world, samples: As the mapper has them.
        ao: Shape (n, k), float32, in [0, 1].
        valid: Shape (n,), bool; at least one.
        mapper: Of the same world and samples.
        rays: Rays a sample.
        candidates: What to choose from.
        seed: Of the noise that is added.
    """
    rows = np.flatnonzero(valid)
    face, values = samples.face[rows], ao[rows].astype(np.float64)
    phi = np.column_stack([samples.barycentric[rows], 1.0 - samples.barycentric[rows].sum(axis=1)]).astype(np.float64)
    corners = world.faces[face]
    area = samples.area[rows].astype(np.float64)
    each = 1.0 / np.bincount(face, minlength=world.face_count)[face]
    weight = 0.5 * area / area.sum() + 0.5 * each / each.sum()
    of_face = np.bincount(face, weight, world.face_count)
    with_samples = np.flatnonzero(of_face)
    sigma = np.sqrt(_noise(world, face, values, mapper, ao, valid, rays))
    added = np.random.default_rng(seed).standard_normal(values.shape) * sigma[:, None]
    noisy = ao.copy()
    noisy[rows] += added
    risk: list[float] = []
    fields: list[VertexField] = []
    for alpha in candidates:
        fields.append(mapper.solve(ao, valid, alpha=alpha))
    for alpha, field in zip(candidates, fields, strict=True):
        change = mapper.solve(noisy, valid, alpha=alpha).ao.astype(np.float64) - field.ao
        missed = values - np.einsum("ij,ijk->ik", phi, field.ao[corners].astype(np.float64))
        here = np.einsum("ij,ijk->ik", phi, change[corners])
        d = change[world.faces[with_samples]]
        # the integral of a linear function's square over a face, for an area of 1
        anywhere = (np.square(d).sum(axis=1) + (d * np.roll(d, -1, axis=1)).sum(axis=1)) / 6.0
        at_samples = weight @ (np.square(missed) - sigma[:, None] ** 2 + 2.0 * added * here - np.square(here))
        risk.append(float((at_samples + of_face[with_samples] @ anywhere).mean()))
    found = np.array(risk)
    return AlphaChoice(candidates[int(found.argmin())], found, float(np.sqrt(weight @ sigma**2)), tuple(fields))


def _noise(
    world: World,
    face: np.ndarray,
    values: Float64Array,
    mapper: VertexMapper,
    ao: Float32Array,
    valid: BoolArray,
    rays: int,
) -> Float64Array:
    """Variance of each valid sample, shape (n,), mean of the distances: about planes fitted to the faces around it."""
    scene = scene_scatter(mapper.moments(ao, valid))
    if scene.freedom <= 0.0:
        return STRATIFIED * (values * (1.0 - values)).mean(axis=1) / rays
    pooled = mapper.equations(ao, valid).trust.pooled
    rest, freedom = pooled.rest + POOLED_FACES * scene.rest, pooled.freedom + POOLED_FACES * scene.freedom
    unknown = mapper.surface.unknown[world.faces[face]]
    return (rest / freedom)[unknown].mean(axis=1) / values.shape[1]
