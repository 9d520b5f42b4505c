"""What adaptive rays save: the fixed count that comes to the same error, over the rays that they sent.

Measured on patches of a scene, drawn half by area and half by faces, with all of the scene around them. A patch's
samples send 4 to 256 rays each, as bakes of these counts do, and as many as adaptive rays choose; all are mapped to
vertices the same way and compared with a mapped reference that has rays of its own. Only vertices all of whose faces
lie in a patch count. What linear interpolation cannot represent is no part of the error, since it is the same for all.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from bake.bench.patches import PATCH_FACES, Patches, patches_of
from bake.bench.scaled import scaled
from bake.bench.table import Measurements, bake_seed
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
from bake.trace.adaptive import Importance, trace_adaptively
from bake.types import Float64Array, SampleSet, Tally, World

RAYS = 256
BOUNDS = (0.016, 0.008, 0.004, 0.002)
REFERENCE_RAYS = 4096
SAVING, AT = 2.0, 0.008
"""Rays of the fixed count of equal error over those sent, all distances together, and the bound it is asked for at."""

SAMPLES = 20_000
"""Samples of all patches, about."""

_T = TypeVar("_T")


def measure_adaptive(scenes: Iterable[Path], options: Mapping[str, Any], *, scale: float = 1.0) -> Measurements:
    """One row a scene and bound.

    Args:
        scenes: Scene files.
        options: Bake options by long name; `rays` is the most of a sample.
        scale: Metres in a unit of the files.
    """
    rows: list[Mapping[str, Any]] = []
    for path in scenes:
        settings = settings_for(path, {"rays": RAYS, **options})
        scene = scaled(load_scene(path, crease_angle=settings.crease_angle), scale)
        rows += _rows(path.name, flatten(scene, settings), settings)
    return Measurements(
        "adaptive rays",
        rows,
        [
            f"gate: at bound {AT:g}, at least {SAVING:g} times fewer rays than the least fixed count of equal error, "
            "all distances together",
            f"patches of {PATCH_FACES} faces and {SAMPLES:,} samples; reference of {REFERENCE_RAYS:,} rays a sample; "
            "errors of vertex values, half by area and half by faces; each bake throws its own invalid samples away",
            "RMSE: over all distances together, then by distance; flipped: samples whose validity differs from the "
            "reference's, with adaptive rays and with all; settling: rays a sample sent only for validity",
        ],
        seeds={"bake and patches": bake_seed(options)},
    )


def _rows(name: str, world: World, settings: BakeSettings) -> list[Mapping[str, Any]]:
    samples = place_samples(world, settings)
    patches = patches_of(world, samples, settings.seed, SAMPLES)
    mapper = VertexMapper(patches.world, patches.samples, settings)
    importance = _importance(world, samples, patches, settings)
    threshold = settings.back_face_threshold

    def values(tally: Tally) -> Float64Array:
        return mapper.solve(tally.ao, tally.valid(threshold)).ao.astype(np.float64)

    with create_tracer(world, settings, resolve(settings.device), fog=make_fog(world, settings)) as tracer:
        other = replace(patches.traced, face_seed=~patches.traced.face_seed)
        reference = _fixed(tracer, other, settings, REFERENCE_RAYS)
        truth = values(reference)
        counted = (patches.share > 0.0) & np.isfinite(truth).all(axis=1)

        def error(tally: Tally) -> Float64Array:
            """Of all distances together, then of each."""
            square = (values(tally) - truth)[counted] ** 2
            each = patches.share[counted] @ square / patches.share[counted].sum()
            return np.sqrt(np.concatenate([[each.mean()], each]))

        counts = [2**power for power in range(2, int(math.log2(settings.rays)) + 1)]
        fixed = {count: _fixed(tracer, patches.traced, settings, count) for count in counts}
        curve = {count: error(tally) for count, tally in fixed.items()}
        valid = reference.valid(threshold)
        flipped = float((fixed[settings.rays].valid(threshold) != valid).mean())
        rows: list[Mapping[str, Any]] = []
        for bound in BOUNDS:
            adaptive = settings.replaced(adaptive_error=bound)
            tally, plan = drained(trace_adaptively(tracer, patches.traced, importance, adaptive))

            def mean(values: np.ndarray) -> float:
                return float(np.average(values, weights=patches.stands_for))

            own, sent = error(tally), mean(plan.rays)
            equal = [_count_of(float(own[k]), curve, k) for k in range(len(own))]
            rows.append(
                {
                    "scene": name,
                    "bound": bound,
                    "rays a sample": sent,
                    "noise": plan.noise,
                    "doubt": plan.doubt,
                    "settling": plan.settling / len(plan.rays),
                    "buried %": 100.0 * mean(plan.buried),
                    "in the open %": 100.0 * mean(plan.unreachable),
                    **_by_distance("RMSE", own, settings),
                    **_by_distance("equal fixed count", equal, settings),
                    **_by_distance("saving", [count / sent for count in equal], settings),
                    "flipped %": 100.0 * float((tally.valid(threshold) != valid).mean()),
                    "flipped % with all": 100.0 * flipped,
                    **({"passed": equal[0] / sent >= SAVING} if bound == AT else {}),
                }
            )
        return rows


def _importance(world: World, samples: SampleSet, patches: Patches, settings: BakeSettings) -> Importance:
    """What the patches' samples weigh, as if the patches were the scene."""
    whole = SampleImportance(world, samples, settings).of()
    inside = SampleImportance(patches.world, patches.samples, settings)
    own = whole[patches.rows] * (whole.sum() / whole[patches.rows].sum())
    before = inside.of()
    return lambda valid: own * inside.of(valid) / before


def _by_distance(what: str, values: Iterable[float], settings: BakeSettings) -> dict[str, float]:
    names = [what, *(f"{what} {distance:g} m" for distance in settings.column_distances)]
    return {name: float(value) for name, value in zip(names, values, strict=True)}


def _count_of(error: float, curve: Mapping[int, Float64Array], column: int) -> float:
    """The least fixed count of an error, interpolated between powers of two; the last where the error is below all."""
    counts, errors = [*curve], [float(values[column]) for values in curve.values()]
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
