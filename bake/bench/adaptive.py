"""What adaptive rays save: the fixed count that comes to the same error, over the rays that they sent.

For each of several seeds the whole scene is traced with adaptive rays, as a bake does, and timed. Errors are measured
on patches of it, drawn half by area and half by faces: their samples send 4 to 256 rays each as well, as bakes of these
counts do; all are mapped to vertices the same way and compared with a mapped reference that has rays of its own. Only
vertices all of whose faces lie in a patch count. What linear interpolation cannot represent is no part of the error,
since it is the same for all. Square errors are pooled over the seeds, since a few vertices carry most of them.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bake.bench.patches import PATCH_FACES, Patches, patches_of, whole_of
from bake.bench.scaled import scaled
from bake.bench.table import Measurements
from bake.decorators.fog import make_fog
from bake.devices import resolve
from bake.pipeline import settings_for
from bake.samples import place_samples
from bake.scene import flatten, load_scene
from bake.settings import BakeSettings
from bake.solve import VertexMapper
from bake.solve.importance import SampleImportance
from bake.stages import drained
from bake.trace import Tracer, create_tracer
from bake.trace.adaptive import RayPasses, RayPlan, trace_adaptively
from bake.types import BoolArray, Float64Array, SampleSet, Tally, World

RAYS = 256
BOUND = 0.016
"""Of the estimated error, unless the options have one."""

SAVING = 2.0
"""Rays of the fixed count of equal error over those sent, all distances together."""

SEEDS = 4
"""Bakes and sets of patches, from the seed of the settings on."""

SAMPLES = 15_000
"""Samples of a seed's patches, about."""

REFERENCE_RAYS = 1024
SETTLED_RAYS = 4096
_OPEN = 0.08  # share of back faces off the threshold up to which the reference sends more rays
_TWICE = 32  # fixed counts up to this one are traced with two scrambles
_TIMED = 16
_SECOND = np.uint32(0x9E3779B9)


@dataclass(frozen=True, slots=True)
class _Run:
    """What adaptive rays came to, with one seed.

    Attributes:
        square: Shape (1 + k,): mean square errors of all distances together, then of each.
        known: The first of these if samples are kept and dropped as the reference says.
        seconds: For the whole scene, importance and planning included.
        flipped: Share of the patches' samples whose validity differs from the reference's.
    """

    plan: RayPlan
    square: Float64Array
    known: float
    seconds: float
    flipped: float


@dataclass(frozen=True, slots=True)
class _Trial:
    """One seed's errors.

    Attributes:
        fixed: Shape (1 + k,) for each fixed count: mean square errors, as in `_Run`.
        known: The first of these for each count if samples are kept and dropped as the reference says.
        run: With adaptive rays.
    """

    fixed: Mapping[int, Float64Array]
    known: Mapping[int, float]
    run: _Run


def measure_adaptive(
    scenes: Iterable[Path], options: Mapping[str, Any], *, scale: float = 1.0, whole: bool = False
) -> Measurements:
    """One row a scene.

    Args:
        scenes: Scene files.
        options: Bake options by long name; `rays` is the most of a sample, `seed` the first of the seeds and
            `adaptive-error` the bound.
        scale: Metres in a unit of the files.
        whole: One seed, and errors of all vertices instead of those of patches.
    """
    rows: list[Mapping[str, Any]] = []
    asked = {"rays": RAYS, "adaptive-error": BOUND, **options}
    first = BakeSettings.from_options(asked).seed
    for path in scenes:
        settings = settings_for(path, asked)
        scene = scaled(load_scene(path, crease_angle=settings.crease_angle), scale)
        rows.append(_row(path.name, flatten(scene, settings), settings, 1 if whole else SEEDS))
    over = (
        f"one seed, {first}; errors of all vertices"
        if whole
        else f"seeds {first} to {first + SEEDS - 1}, each with patches of {PATCH_FACES} faces and {SAMPLES:,} samples; "
        "spread: lowest and highest saving of a seed by itself"
    )
    return Measurements(
        "adaptive rays, whole scene" if whole else "adaptive rays",
        rows,
        [
            f"gate: at least {SAVING:g} times fewer rays than the least fixed count of equal error, all distances and "
            "seeds together",
            f"{over}; reference of {REFERENCE_RAYS:,} rays a sample, {SETTLED_RAYS:,} where its validity is open; "
            "errors of vertex values, half by area and half by faces; each bake throws its own invalid samples away, "
            "but for noise alone, where all keep what the reference keeps",
            f"rays and seconds are those of the whole scene, all planning included; fixed counts take their share of "
            f"the seconds of {_TIMED} rays",
            "estimated: by the plan, noise and open validity together; flipped: validity differs from the reference's",
        ],
        seeds={"first": first},
    )


def _row(name: str, world: World, settings: BakeSettings, seeds: int) -> Mapping[str, Any]:
    """A scene's figures; all of its vertices count if there is but one seed."""
    trials: list[_Trial] = []
    ray = 0.0
    with create_tracer(world, settings, resolve(settings.device), fog=make_fog(world, settings)) as tracer:
        for seed in range(settings.seed, settings.seed + seeds):
            own = settings.replaced(seed=seed)
            samples = place_samples(world, own)
            patches = whole_of(world, samples) if seeds == 1 else patches_of(world, samples, seed, SAMPLES)
            trials.append(_trial(tracer, samples, patches, own, 0 if seeds == 1 else _TWICE))
            if seed == settings.seed:
                begin = time.perf_counter()
                _fixed(tracer, samples, settings, _TIMED)
                ray = (time.perf_counter() - begin) / _TIMED
    return _pooled(name, trials, ray, settings)


def _trial(tracer: Tracer, samples: SampleSet, patches: Patches, settings: BakeSettings, twice: int) -> _Trial:
    mapper = VertexMapper(patches.world, patches.samples, settings)
    threshold = settings.back_face_threshold
    reference = _reference(tracer, replace(patches.traced, face_seed=~patches.traced.face_seed), settings)
    kept = reference.valid(threshold)

    def values(tally: Tally, valid: BoolArray) -> Float64Array:
        return mapper.solve(tally.ao, valid).ao.astype(np.float64)

    truth = values(reference, kept)
    counted = (patches.share > 0.0) & np.isfinite(truth).all(axis=1)
    share = patches.share[counted] / patches.share[counted].sum()

    def square(tally: Tally, valid: BoolArray) -> Float64Array:
        each = share @ (values(tally, valid) - truth)[counted] ** 2
        return np.concatenate([[each.mean()], each])

    curve: dict[int, Float64Array] = {}
    known: dict[int, float] = {}
    # Of a whole scene the largest count is left out: it costs as much as all others together.
    for power in range(2, int(math.log2(settings.rays)) + (1 if twice else 0)):
        fixed = _fixed(tracer, patches.traced, settings, 2**power)
        errors = [square(fixed, fixed.valid(threshold))]
        if 2**power <= twice:
            again = replace(patches.traced, face_seed=patches.traced.face_seed ^ _SECOND)
            other = _fixed(tracer, again, settings, 2**power)
            errors.append(square(other, other.valid(threshold)))
        curve[2**power] = np.mean(errors, axis=0)
        known[2**power] = float(square(fixed, kept)[0])
    begin = time.perf_counter()
    importance = SampleImportance(tracer.world, samples, settings)
    sent, plan = drained(trace_adaptively(tracer, samples, importance.of, settings))
    seconds = time.perf_counter() - begin
    rows = patches.rows
    own = Tally(sent.ao[rows], sent.rays[rows], sent.hits[rows], sent.back_faces[rows])
    valid = own.valid(threshold)
    alone = float(square(own, kept)[0])
    return _Trial(curve, known, _Run(plan, square(own, valid), alone, seconds, float((valid != kept).mean())))


def _pooled(name: str, trials: Sequence[_Trial], ray: float, settings: BakeSettings) -> Mapping[str, Any]:
    """A scene's figures; `ray` is what one ray of every sample takes with fixed counts, in seconds."""
    runs = [trial.run for trial in trials]
    sent = [float(run.plan.rays.mean()) for run in runs]
    rays, seconds = float(np.mean(sent)), float(np.mean([run.seconds for run in runs]))
    error = np.sqrt(np.mean([run.square for run in runs], axis=0))
    curve = {count: np.sqrt(np.mean([trial.fixed[count] for trial in trials], axis=0)) for count in trials[0].fixed}
    known = {count: math.sqrt(np.mean([trial.known[count] for trial in trials])) for count in trials[0].known}
    equal = [_count_of(float(error[k]), {n: float(own[k]) for n, own in curve.items()}) for k in range(len(error))]
    alone = _count_of(math.sqrt(np.mean([run.known for run in runs])), known)
    each = [
        _count_of(math.sqrt(run.square[0]), {n: math.sqrt(own[0]) for n, own in trial.fixed.items()}) / count
        for run, trial, count in zip(runs, trials, sent, strict=True)
    ]
    estimated = math.sqrt(np.mean([run.plan.noise**2 + run.plan.doubt**2 for run in runs]))
    return {
        "scene": name,
        "bound": settings.adaptive_error,
        "rays a sample": rays,
        "estimated": estimated,
        "RMSE": float(error[0]),
        "equal fixed count": equal[0],
        "saving": equal[0] / rays,
        **({"spread": f"{min(each):.2g} to {max(each):.2g}"} if len(each) > 1 else {}),
        **{
            f"saving {distance:g} m": count / rays
            for distance, count in zip(settings.column_distances, equal[1:], strict=True)
        },
        "saving, noise alone": alone / rays,
        "seconds": seconds,
        "equal fixed seconds": ray * equal[0],
        "saving in seconds": ray * equal[0] / seconds,
        "buried %": 100.0 * float(np.mean([run.plan.buried.mean() for run in runs])),
        "in the open %": 100.0 * float(np.mean([run.plan.unreachable.mean() for run in runs])),
        "flipped %": 100.0 * float(np.mean([run.flipped for run in runs])),
        "passed": equal[0] / rays >= SAVING,
    }


def _count_of(error: float, curve: Mapping[int, float]) -> float:
    """The least fixed count of an error, interpolated between powers of two; the last where the error is below all."""
    counts, errors = [*curve], [*curve.values()]
    for i, own in enumerate(errors):
        if own <= error:
            if i == 0:
                return float(counts[0])
            part = math.log(errors[i - 1] / error) / math.log(errors[i - 1] / own)
            return float(counts[i - 1] * (counts[i] / counts[i - 1]) ** part)
    return float(counts[-1])


def _fixed(tracer: Tracer, samples: SampleSet, settings: BakeSettings, rays: int) -> Tally:
    """What a bake of a fixed count finds."""
    tally = Tally.empty(len(samples), settings.distance_count)
    for batch in samples.batches(max(64, tracer.batch_size * settings.rays // rays)):
        tracer.accumulate(samples, batch, tally, rays=rays)
    return tally


def _reference(tracer: Tracer, samples: SampleSet, settings: BakeSettings) -> Tally:
    """Many rays of each sample, and more where it is close whether it is valid."""
    passes = RayPasses(tracer, samples, settings.replaced(rays=SETTLED_RAYS))
    every = np.arange(len(samples))
    drained(passes.run(every, 0, REFERENCE_RAYS))
    hits, backs = passes.found(every)
    near = np.abs(backs - settings.back_face_threshold * hits) < _OPEN * hits
    sent = REFERENCE_RAYS
    while sent < SETTLED_RAYS:
        drained(passes.run(np.flatnonzero(near), sent, sent))
        sent *= 2
    rays = np.where(near, SETTLED_RAYS, REFERENCE_RAYS)
    ao = np.clip(passes.ao / rays[:, None].astype(np.float32), 0.0, 1.0)
    counts = [part.astype(np.uint16) for part in (rays, passes.hits, passes.back_faces)]
    return Tally(ao, *counts)
