"""Numerical stability: a small level distorted in every way that breaks bakers, on every tracer and in every stage."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bake.bench.stability_cases import Case, all_cases
from bake.bench.stability_figures import (
    Before,
    Figure,
    decorator_figures,
    map_figures,
    not_finite,
    region_figures,
    sample_change,
    tally_figures,
    warned,
    worst,
    worst_excess,
)
from bake.bench.stability_level import as_scene
from bake.bench.stability_rays import ray_cases, tracers_here
from bake.bench.table import Measurements
from bake.devices import Device, cuda_devices
from bake.errors import ObscuraError
from bake.pipeline import bake
from bake.settings import BakeSettings, MappingKind, TracerKind
from bake.stages import StageClock
from bake.trace import Tracer, create_tracer
from bake.types import BakeResult, Tally, VertexField, World

STAGES = ("bake", "embree", "warp", "cuda", "brute", "least-squares", "average",
          "fog", "volume", "trees", "decorators", "regions")  # fmt: skip
PARITY_GATE = 0.01
_PARITY_SAMPLES, _FEWEST_SAMPLES, _PARITY_PAIRS = 96, 16, 3_500_000
_PARITY = 2e-5
_SPHERES = 64
_CPU = Device("cpu", "CPU")


@dataclass(frozen=True, slots=True)
class Matrix:
    """Every figure, by case and stage.

    Attributes:
        figures: Figures of each case, in order.
        settings: Those of the plain level.
        seconds: How long each case took.
    """

    figures: Mapping[str, Sequence[Figure]]
    settings: BakeSettings
    seconds: Mapping[str, float]

    @property
    def stages(self) -> tuple[str, ...]:
        """Columns that hold anything, in the order of the bake."""
        held = {item.stage for figures in self.figures.values() for item in figures}
        return tuple(stage for stage in STAGES if stage in held)

    def cell(self, case: str, stage: str) -> Figure | None:
        """The figure of a case and a stage that is nearest its gate; None if the case has none of that stage."""
        own = [item for item in self.figures[case] if item.stage == stage]
        return worst(own) if own else None


def bench_settings(options: Mapping[str, Any]) -> BakeSettings:
    """The defaults but for equal numbers of samples on all faces and fewer directions; explicit options win."""
    quick = {"samples-per-face": "4:4", "region-directions": 128, "volume-directions": 128, "device": "cpu"}
    return BakeSettings.from_options({**quick, **options})


def measure_stability(options: Mapping[str, Any], cases: Sequence[Case] | None = None) -> Matrix:
    """Bakes every case, and sends rays where tracers break.

    Args:
        options: Bake options by long name.
        cases: Some of `all_cases`, the first being the plain level; all if None.
    """
    import time

    settings = bench_settings(options)
    found = cuda_devices()
    cuda = found[0] if found else None
    bench = _Bench(settings, tracers_here(cuda), cuda)
    figures: dict[str, list[Figure]] = {}
    seconds: dict[str, float] = {}
    for case in all_cases() if cases is None else cases:
        begin = time.perf_counter()
        figures[case.name] = bench.case(case)
        seconds[case.name] = time.perf_counter() - begin
    if cases is None:
        for body in bench.bodies:
            begin = time.perf_counter()
            for name, own in ray_cases(body, bench.tracer).items():
                figures.setdefault(name, []).extend(own)
            seconds[f"rays, {body}"] = time.perf_counter() - begin
    return Matrix(figures, settings, seconds)


class _Bench:
    """Bakes cases one after another; the first becomes what others are compared with."""

    def __init__(self, settings: BakeSettings, bodies: Sequence[str], cuda: Device | None) -> None:
        self.settings = settings
        self.bodies = bodies
        self._cuda = cuda
        self._before: Before | None = None

    def tracer(self, body: str, world: World, settings: BakeSettings) -> Tracer:
        """A tracer by the name of its column."""
        return self._tracer(body, world, settings, None)

    def _tracer(self, body: str, world: World, settings: BakeSettings, result: BakeResult | None) -> Tracer:
        kind = TracerKind.WARP if body == "cuda" else TracerKind(body)
        device = self._cuda if body == "cuda" and self._cuda is not None else _CPU
        fog = result.decorators.fog if result is not None and result.decorators is not None else None
        return create_tracer(world, settings.replaced(tracer=kind), device, fog=fog)

    def case(self, case: Case) -> list[Figure]:
        """All figures of a case."""
        settings = _in_unit(self.settings, case.unit).replaced(**case.settings)
        figures: list[Figure] = []
        with warned() as caught:
            try:
                result = self._bake(case, settings)
            except Exception as error:  # noqa: BLE001  # a crash is the finding
                plain = isinstance(error, ObscuraError)
                what = "refusals" if plain else "crashes"
                return [Figure("bake", what, 1.0, 0.0, f"{type(error).__name__}: {error}")]
            tallies: dict[str, Tally] = {}
            for body in reversed(self.bodies):  # brute force first: it is what the others are held to
                figures += self._traced(body, result, case.may_change, tallies)
            fields: dict[str, VertexField] = {}
            for mapping in MappingKind:
                own, fields[str(mapping)] = map_figures(result, mapping, self._before, case.may_change)
                figures += own
            figures += decorator_figures(result)
            figures += region_figures(result)
        detail = "; ".join(sorted({f"{Path(item.filename).name}: {item.message}" for item in caught}))
        figures.append(Figure("bake", "warnings", float(len(caught)), 0.0, detail))
        figures.append(Figure("bake", "crashes", 0.0, 0.0))
        if self._before is None:
            self._before = Before(result, tallies, fields)
        return figures

    @staticmethod
    def _bake(case: Case, settings: BakeSettings) -> BakeResult:
        work: Generator[Any, None, BakeResult] = bake(as_scene(case.make()), settings, _CPU, StageClock())
        while True:
            try:
                next(work)
            except StopIteration as done:
                return done.value

    def _traced(
        self, body: str, result: BakeResult, may_change: float | None, tallies: dict[str, Tally]
    ) -> list[Figure]:
        """One tracer's surface samples, spheres and lines of sight."""
        world, settings = result.world, result.settings
        is_brute = body == "brute"
        rows = _rows(len(result.samples), world.face_count * settings.rays)
        some = result.samples.only(rows)
        samples = some if is_brute else result.samples
        tally = Tally.empty(len(samples), settings.distance_count)
        with self._tracer(body, world, settings, result) as tracer:
            for batch in samples.batches(tracer.batch_size):
                tracer.accumulate(samples, batch, tally)
            few = some.only(np.arange(0, len(some), 4 if is_brute else 1))
            records = tracer.record(few)
            points, directions = _points(world), _axes()
            centres = points[:: 8 if is_brute else 1]
            sphere = tracer.gather_sphere(centres, np.arange(len(centres), dtype=np.uint32), 64)
            reach = min(settings.trace_distance, 1e9)
            passes = tracer.transmittance(points, directions, reach)
        tallies[body] = tally
        own = np.count_nonzero(records.first_face == few.face[:, None])
        figures = [
            *tally_figures(body, tally, settings),
            Figure(body, "rays that hit their own face", float(own), 0.0),
            Figure(body, "spheres not finite", not_finite(sphere.sh, passes), 0.0),
            Figure(body, "transmittance beyond 0 to 1", worst_excess(passes.astype(np.float64)), 1e-6),
        ]
        if is_brute:
            return figures
        if len(some):
            off = np.abs(tally.ao[rows] - tallies["brute"].ao).max(axis=1) > _PARITY
            figures.append(Figure(body, "samples unlike brute force", float(off.mean()), PARITY_GATE))
        if self._before is not None and may_change is not None:
            figures += sample_change(body, world, samples, tally, self._before, may_change)
        return figures


def _in_unit(settings: BakeSettings, unit: float) -> BakeSettings:
    """Lengths among the settings for a level that grew by `unit`."""
    return settings.replaced(
        distances=tuple(distance * unit for distance in settings.distances),
        sample_spacing=settings.sample_spacing * unit,
        volume_spacing=settings.volume_spacing * unit,
        region_cell=settings.region_cell * unit,
        region_smallest=settings.region_smallest * unit**3,
        fog_density=settings.fog_density / unit,
    )


def _rows(count: int, pairs: int) -> np.ndarray:
    """Samples spread over all, as many as brute force can follow in half a second; `pairs`: tests a sample takes."""
    wanted = min(count, _PARITY_SAMPLES, max(_FEWEST_SAMPLES, _PARITY_PAIRS // max(pairs, 1)))
    return np.unique(np.linspace(0, max(0, count - 1), wanted).astype(np.int64))


def _points(world: World) -> np.ndarray:
    """Points in the world's box, on vertices and between."""
    corners = world.positions[np.linspace(0, world.vertex_count - 1, _SPHERES // 2).astype(np.int64)]
    return np.concatenate([corners, 0.5 * (corners + corners[::-1])]).astype(np.float32)


def _axes() -> np.ndarray:
    """A direction for each of the points, every other along an axis."""
    free = np.random.default_rng(1).normal(size=(_SPHERES, 3))
    free[::2] = np.eye(3)[np.arange(_SPHERES // 2) % 3]
    return (free / np.linalg.norm(free, axis=1, keepdims=True)).astype(np.float32)


def tables(matrix: Matrix) -> list[Measurements]:
    """The matrix of ratios, every kind of figure at its worst, and what failed."""
    return [_ratios(matrix), _kinds(matrix)]


@dataclass(frozen=True, slots=True)
class _WithFigures(Measurements):
    """A table whose JSON holds every figure behind it."""

    matrix: Matrix | None = None

    def to_json(self) -> dict[str, Any]:
        """The table with settings, seed and figures."""
        plain = Measurements(self.name, self.rows, self.notes, seeds=self.seeds).to_json()
        assert self.matrix is not None
        figures = [
            {"case": case, "stage": item.stage, "figure": item.what, "value": item.value, "gate": item.gate,
             "passed": item.passed, "detail": item.detail}
            for case, own in self.matrix.figures.items() for item in own
        ]  # fmt: skip
        return {**plain, "settings": self.matrix.settings.to_json(), "seconds": dict(self.matrix.seconds),
                "figures": figures}  # fmt: skip


def _ratios(matrix: Matrix) -> Measurements:
    rows: list[dict[str, Any]] = []
    for case, figures in matrix.figures.items():
        cells = {stage: matrix.cell(case, stage) for stage in matrix.stages}
        shown = {stage: None if cell is None else _shown(cell) for stage, cell in cells.items()}
        rows.append({"case": case, **shown, "passed": all(item.passed for item in figures)})
    notes = [
        "each cell: the figure nearest its gate, divided by it; ∞: a figure that must be 0 is not",
        f"seed {matrix.settings.seed}, {matrix.settings.rays} rays a sample",
    ]
    return _WithFigures("stability", rows, notes, matrix, seeds=_seeds(matrix))


def _seeds(matrix: Matrix) -> dict[str, int]:
    return {"bake": matrix.settings.seed, "directions": 1}


def _shown(cell: Figure) -> str:
    return "0" if cell.ratio == 0.0 else "∞" if cell.ratio == float("inf") else f"{cell.ratio:.2g}"


def _kinds(matrix: Matrix) -> Measurements:
    """Each kind of figure at its worst, with the case and the stage where."""
    rows: dict[tuple[str, str], list[tuple[str, Figure]]] = {}
    for case, figures in matrix.figures.items():
        for item in figures:
            group = "tracers" if item.stage in ("embree", "warp", "cuda", "brute") else item.stage
            rows.setdefault((item.what, group), []).append((case, item))
    table: list[dict[str, Any]] = []
    for (what, group), items in rows.items():
        case, item = max(items, key=lambda pair: (not pair[1].passed, pair[1].ratio))
        clean = item.ratio == 0.0
        table.append({
            "figure": what, "stage": group, "cases": len({name for name, _ in items}), "worst": item.value,
            "gate": item.gate, "where": "" if clean else f"{case} ({item.stage})", "detail": item.detail,
            "failed": sum(not one.passed for _, one in items), "passed": item.passed,
        })  # fmt: skip
    note = "`failed`: how many cells of the matrix break this gate"
    return Measurements("stability, figures", table, [note], seeds=_seeds(matrix))


__all__ = ["STAGES", "Matrix", "bench_settings", "measure_stability", "tables"]
