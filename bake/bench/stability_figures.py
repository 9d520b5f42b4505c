"""What each stage of a stressed bake is held to: figures with gates, 0 wherever nothing may go wrong."""

from __future__ import annotations

import math
import warnings
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from bake.arrays import BoolArray, Float64Array, Int64Array
from bake.settings import BakeSettings, MappingKind
from bake.solve import VertexMapper
from bake.spherical_harmonics import evaluate
from bake.types import BakeResult, SampleSet, Tally, VertexField, VertexState, World

CONSTANT = 0.37
CONSTANT_GATE = 1e-6
RESIDUAL_GATE = 1e-8
RINGING_GATE = 2e-3


@dataclass(frozen=True, slots=True)
class Figure:
    """One number and the most it may be.

    Attributes:
        stage: Column of the matrix.
        what: Its name.
        value: What was measured, at least 0; NaN counts as infinite.
        gate: The most it may be.
        detail: What to look for, where it is not plain.
    """

    stage: str
    what: str
    value: float
    gate: float
    detail: str = ""

    @property
    def passed(self) -> bool:
        """Whether the gate held."""
        return self.value <= self.gate

    @property
    def ratio(self) -> float:
        """Value over gate: 1 is the gate itself; infinite where a gate of 0 broke."""
        if math.isnan(self.value):
            return math.inf
        if self.gate == 0.0:
            return 0.0 if self.value <= 0.0 else math.inf
        return self.value / self.gate


@dataclass(frozen=True, slots=True)
class Before:
    """What the plain level gave, to compare others with.

    Attributes:
        result: Its bake.
        tallies: Each tracer's.
        fields: Each mapping's.
    """

    result: BakeResult
    tallies: dict[str, Tally]
    fields: dict[str, VertexField]


@contextmanager
def warned() -> Generator[list[warnings.WarningMessage]]:
    """Collects every warning, floating-point errors of NumPy included, of all threads."""
    with warnings.catch_warnings(record=True) as caught, np.errstate(divide="warn", over="warn", invalid="warn"):
        warnings.simplefilter("always")
        yield caught


def worst_excess(values: Float64Array, low: float = 0.0, high: float = 1.0) -> float:
    """How far finite values leave their bounds."""
    finite = values[np.isfinite(values)]
    return float(max(low - finite.min(initial=low), finite.max(initial=high) - high, 0.0))


def not_finite(*arrays: np.ndarray) -> float:
    """How many numbers are not finite."""
    return float(sum(int(np.count_nonzero(~np.isfinite(array))) for array in arrays))


def tally_figures(stage: str, tally: Tally, settings: BakeSettings) -> list[Figure]:
    """A tracer's samples: finite, in bounds, and darker the further a blocker counts."""
    ao = tally.ao.astype(np.float64)
    order = np.argsort(settings.column_distances)
    rises = np.diff(ao[:, order], axis=1)
    return [
        Figure(stage, "values not finite", not_finite(ao), 0.0),
        Figure(stage, "beyond 0 to 1", worst_excess(ao), 0.0),
        Figure(stage, "brighter at a longer distance", float(np.max(rises, initial=0.0)), 1e-6),
        Figure(stage, "rays missing", float(np.count_nonzero(tally.rays != settings.rays)), 0.0),
    ]


def sample_change(
    stage: str, world: World, samples: SampleSet, tally: Tally, before: Before, gate: float
) -> list[Figure]:
    """How far the samples that both worlds have moved, as root mean square."""
    mine, theirs = _shared_samples(world, samples, before.result)
    difference = tally.ao[mine].astype(np.float64) - before.tallies[stage].ao[theirs]
    change = math.sqrt(float(np.mean(difference**2))) if difference.size else math.nan
    return [Figure(stage, "AO of samples changed, RMS", change, gate)]


def _shared_samples(world: World, samples: SampleSet, plain: BakeResult) -> tuple[Int64Array, Int64Array]:
    def keys(w: World, s: SampleSet) -> Int64Array:
        item = w.face_object[s.face].astype(np.int64)
        return (item << 48) + ((s.face - w.first_face[item]) << 16) + s.index

    _, mine, theirs = np.intersect1d(
        keys(world, samples), keys(plain.world, plain.samples), assume_unique=True, return_indices=True
    )
    return mine.astype(np.int64), theirs.astype(np.int64)


def map_figures(
    result: BakeResult, mapping: MappingKind, before: Before | None, gate: float | None
) -> tuple[list[Figure], VertexField]:
    """One mapping of the result's samples: finite, in bounds, converged, and true to a constant."""
    stage, settings = str(mapping), result.settings.replaced(mapping=mapping)
    valid = result.tally.valid(settings.back_face_threshold)
    mapper = VertexMapper(result.world, result.samples, settings)
    solved = mapper.solve(result.tally.ao, valid)
    flat = mapper.solve(np.full_like(result.tally.ao, CONSTANT), valid)
    own = solved.state <= VertexState.FILLED
    report = solved.report
    figures = [
        Figure(stage, "values not finite", not_finite(solved.ao[own]), 0.0),
        Figure(stage, "beyond 0 to 1", worst_excess(solved.ao[own].astype(np.float64)), 0.0),
        Figure(stage, "unknowns not converged", float(report.averaged), 0.0),
        Figure(stage, "residual", report.residual, RESIDUAL_GATE),
        Figure(stage, "constant missed by", _miss(flat, own, valid), CONSTANT_GATE),
    ]
    if before is not None and gate is not None:
        change = _vertex_change(result.world, solved, before, before.fields[stage])
        figures.append(Figure(stage, "AO of vertices changed, greatest", change, gate))
    return figures, solved


def _miss(flat: VertexField, own: BoolArray, valid: BoolArray) -> float:
    """How far a constant is missed; where no sample is valid there is none to reproduce."""
    if not valid.any() or not own.any():
        return 0.0
    return float(np.abs(flat.ao[own].astype(np.float64) - CONSTANT).max())


def _vertex_change(world: World, solved: VertexField, before: Before, plain: VertexField) -> float:
    rows = _shared_vertices(world, before.result.world)
    mine, theirs = solved.ao[rows].astype(np.float64), plain.ao.astype(np.float64)
    if (np.isnan(mine) != np.isnan(theirs)).any():
        return math.nan
    return float(np.nanmax(np.abs(mine - theirs)))


def _shared_vertices(world: World, plain: World) -> Int64Array:
    """Where the plain world's vertices lie in another that has more after those of each object."""
    counts = np.diff(plain.first_vertex)
    starts = world.first_vertex[: len(counts)] - plain.first_vertex[:-1]
    return np.arange(plain.vertex_count, dtype=np.int64) + np.repeat(starts, counts)


def decorator_figures(result: BakeResult) -> list[Figure]:
    """Fog, volume, trees and small decorators."""
    made = result.decorators
    figures: list[Figure] = []
    if made is None:
        return figures
    if made.fog is not None:
        fog = made.fog
        figures += [
            Figure("fog", "values not finite", not_finite(fog.density, fog.minimum, fog.maximum), 0.0),
            Figure("fog", "density beyond what was given", float(np.max(fog.density - fog.given_density)), 0.0),
            Figure("fog", "density below 0", float(max(0.0, -fog.density.min())), 0.0),
        ]
    if made.volume is not None:
        sh = made.volume.sh.astype(np.float64)
        figures += [
            Figure("volume", "values not finite", not_finite(sh), 0.0),
            Figure("volume", "mean beyond 0 to 1", worst_excess(sh[:, 0] / math.sqrt(4.0 * math.pi)), 1e-5),
        ]
    for model in made.models:
        figures += [
            Figure("trees", "values not finite", not_finite(model.local_ao), 0.0),
            Figure("trees", "beyond 0 to 1", worst_excess(model.local_ao.astype(np.float64)), 0.0),
        ]
    if made.fits is not None:
        fits = made.fits
        lost = not_finite(fits.coefficients, fits.centre, fits.rmse_global, fits.rmse_product)
        figures.append(Figure("trees", "values not finite", lost, 0.0))
    for scalars in (made.shrub_scalars, made.small_scalars):
        if scalars is not None:
            figures += [
                Figure("decorators", "values not finite", not_finite(scalars.ao), 0.0),
                Figure("decorators", "beyond 0 to 1", worst_excess(scalars.ao.astype(np.float64)), 0.0),
            ]
    return figures


def region_figures(result: BakeResult) -> list[Figure]:
    """Points, models and their agreement."""
    made = result.regions
    if made is None:
        return []
    models, points = made.regularised, made.points
    steps = made.mismatch_after.astype(np.float64)
    return [
        Figure("regions", "values not finite", not_finite(points.sh, models.coefficients, models.centre, steps), 0.0),
        Figure("regions", "undershoot of traced points", _undershoot(points.sh), RINGING_GATE),
    ]


def _undershoot(sh: np.ndarray) -> float:
    """How far below 0 the points' AO goes along the axes."""
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    return worst_excess(np.einsum("njk,aj->nak", sh.astype(np.float64), evaluate(axes)), high=1e9)


def worst(figures: Sequence[Figure]) -> Figure:
    """The one nearest its gate, or furthest beyond."""
    return max(figures, key=lambda item: (not item.passed, item.ratio))
