"""What adaptive rays save: the fixed count that comes to the same error, over the rays that they sent.

Measured on patches of a scene, spread evenly over its faces, with all rays of the scene around them. A patch's samples
send 4 to 256 rays each, as fixed counts, and as many as adaptive rays choose; all are mapped to vertices the same way
and compared with a mapped reference that has rays of its own. Only vertices all of whose faces lie in a patch count.
What linear interpolation cannot represent is no part of the error, since it is the same for all.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from scipy.spatial import cKDTree

from bake.bench.table import Measurements
from bake.devices import resolve
from bake.geometry import face_normals
from bake.pipeline import settings_for
from bake.samples import place_samples
from bake.scene import flatten, load_scene
from bake.settings import BakeSettings
from bake.solve import VertexMapper
from bake.solve.importance import sample_importance
from bake.trace import Tracer, create_tracer
from bake.trace.adaptive import PILOT, RayPasses, trace_adaptively
from bake.types import BoolArray, Float64Array, Int64Array, SampleSet, Tally, World

RAYS = 256
BOUNDS = (0.016, 0.008, 0.004)
REFERENCE_RAYS = 1024
SAVING = 2.0
"""Rays of the fixed count of equal error over those sent, at the smallest bound."""

PATCHES, PATCH_FACES = 60, 60

_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class _Patches:
    """Parts of a scene.

    Attributes:
        world: Their faces alone; vertices as in the whole.
        samples: Theirs, with faces of the patches' own world.
        traced: The same with faces of the whole.
        rows: Their rows among the scene's samples.
        share: Shape (n,): what each vertex counts for; 0 where faces are missing.
    """

    world: World
    samples: SampleSet
    traced: SampleSet
    rows: Int64Array
    share: Float64Array


def measure_adaptive(scenes: Iterable[Path], options: Mapping[str, Any]) -> Measurements:
    """One row a scene and bound.

    Args:
        scenes: Scene files.
        options: Bake options by long name; `rays` is the most of a sample.
    """
    rows: list[Mapping[str, Any]] = []
    for path in scenes:
        settings = settings_for(path, {"rays": RAYS, **options})
        world = flatten(load_scene(path, crease_angle=settings.crease_angle), settings)
        rows += _rows(path.name, world, settings)
    return Measurements(
        "adaptive rays",
        rows,
        [
            f"gate: at the smallest bound, at least {SAVING:g} times fewer rays than the fixed count of equal error, "
            "at the first distance",
            f"{PATCHES} patches of {PATCH_FACES} faces; reference of {REFERENCE_RAYS} rays a sample; errors of vertex "
            "values, half by area and half by faces; each bake throws its own invalid samples away",
            "flipped: samples whose validity differs from the reference's, with adaptive rays and with all",
        ],
    )


def _rows(name: str, world: World, settings: BakeSettings) -> list[Mapping[str, Any]]:
    samples = place_samples(world, settings)
    patches = _patches(world, samples, settings)
    mapper = VertexMapper(patches.world, patches.samples, settings)
    whole = sample_importance(world, samples, settings)
    importance = whole[patches.rows] * (whole.sum() / whole[patches.rows].sum())  # as if the patches were all
    threshold = settings.back_face_threshold

    def values(tally: Tally) -> Float64Array:
        return mapper.solve(tally.ao, tally.valid(threshold)).ao.astype(np.float64)

    with create_tracer(world, settings, resolve(settings.device)) as tracer:
        reference = _reference(tracer, patches.traced, settings)
        truth = values(reference)
        counted = (patches.share > 0.0) & np.isfinite(truth).all(axis=1)

        def error(tally: Tally) -> Float64Array:
            square = (values(tally) - truth)[counted] ** 2
            return np.sqrt(patches.share[counted] @ square / patches.share[counted].sum())

        fixed = dict(_prefixes(tracer, patches.traced, settings))
        curve = {count: error(tally) for count, tally in fixed.items()}
        valid = reference.valid(threshold)
        flipped = float((fixed[settings.rays].valid(threshold) != valid).mean())
        rows: list[Mapping[str, Any]] = []
        for bound in BOUNDS:
            adaptive = settings.replaced(adaptive_error=bound)
            tally, plan = _drained(trace_adaptively(tracer, patches.traced, importance, adaptive))
            own, mean = error(tally), float(plan.rays.mean())
            equal = [_count_of(float(own[k]), curve, k) for k in range(len(own))]
            gate = {"passed": equal[0] / mean >= SAVING} if bound == min(BOUNDS) else {}
            rows.append(
                {
                    "scene": name,
                    "bound": bound,
                    "rays a sample": mean,
                    "buried %": 100.0 * float(plan.buried.mean()),
                    "in the open %": 100.0 * float(plan.unreachable.mean()),
                    **_by_distance("RMSE", own, settings),
                    **_by_distance("equal fixed count", equal, settings),
                    **_by_distance("saving", [count / mean for count in equal], settings),
                    "flipped %": 100.0 * float((tally.valid(threshold) != valid).mean()),
                    "flipped % with all": 100.0 * flipped,
                    **gate,
                }
            )
        return rows


def _by_distance(what: str, values: Iterable[float], settings: BakeSettings) -> dict[str, float]:
    return {f"{what} {d:g} m": float(value) for d, value in zip(settings.column_distances, values, strict=True)}


def _count_of(error: float, curve: Mapping[int, Float64Array], column: int) -> float:
    """The fixed count of an error, interpolated between powers of two; the last where the error is below all."""
    counts = np.array([*curve], np.float64)
    errors: Float64Array = np.array([float(values[column]) for values in curve.values()], np.float64)
    return float(np.exp(np.interp(-math.log(error), -np.log(errors), np.log(counts))))


def _prefixes(tracer: Tracer, samples: SampleSet, settings: BakeSettings) -> Generator[tuple[int, Tally]]:
    """Tallies of 4, 8, … rays a sample, up to all."""
    passes, every = RayPasses(tracer, samples, settings), np.arange(len(samples))
    sent = PILOT // 2
    _drained(passes.run(every, 0, sent))
    while True:
        counts = [values.astype(np.uint16) for values in (passes.hits, passes.back_faces)]
        yield sent, Tally(np.clip(passes.mean(sent), 0.0, 1.0), np.full(len(samples), sent, np.uint16), *counts)
        if sent >= settings.rays:
            return
        _drained(passes.run(every, sent, sent))
        sent *= 2


def _reference(tracer: Tracer, samples: SampleSet, settings: BakeSettings) -> Tally:
    """Rays of another seed."""
    other = replace(samples, face_seed=~samples.face_seed)
    tally = Tally.empty(len(samples), settings.distance_count)
    for batch in other.batches(max(64, tracer.batch_size * settings.rays // REFERENCE_RAYS)):
        tracer.accumulate(other, batch, tally, rays=REFERENCE_RAYS)
    return tally


def _patches(world: World, samples: SampleSet, settings: BakeSettings) -> _Patches:
    sampled = np.unique(samples.face)
    centres = world.positions[world.faces[sampled]].mean(axis=1)
    middles = np.random.default_rng(settings.seed).choice(len(sampled), min(PATCHES, len(sampled)), replace=False)
    near = np.asarray(cKDTree(centres).query(centres[middles], min(PATCH_FACES, len(sampled)))[1]).ravel()
    faces = sampled[np.unique(near)].astype(np.int64)
    here: BoolArray = np.zeros(world.face_count, np.bool_)
    here[faces] = True
    touching = here | ~world.face_samples  # slivers have no samples and can be missed
    missing = np.bincount(world.faces[~touching].ravel(), minlength=world.vertex_count) > 0
    area = face_normals(world.positions, world.faces[faces])[1]
    by_area = np.bincount(world.faces[faces].ravel(), np.repeat(area, 3), world.vertex_count)
    by_face = np.bincount(world.faces[faces].ravel(), minlength=world.vertex_count)
    share = np.where(missing, 0.0, by_area / by_area.sum() + by_face / by_face.sum())
    rows = np.flatnonzero(here[samples.face])
    traced = samples.only(rows)
    own = replace(
        traced,
        face=np.searchsorted(faces, traced.face).astype(np.int32),
        face_seed=samples.face_seed[faces],
    )
    return _Patches(_faces_of(world, faces), own, traced, rows, share)


def _faces_of(world: World, faces: Int64Array) -> World:
    """A world of some faces, in their order."""
    return replace(
        world,
        faces=world.faces[faces],
        face_object=world.face_object[faces],
        face_casts=world.face_casts[faces],
        face_samples=world.face_samples[faces],
        face_two_sided=world.face_two_sided[faces],
        face_openness=world.face_openness[faces],
        first_face=np.searchsorted(faces, world.first_face).astype(np.int64),
        face_texture=None if world.face_texture is None else world.face_texture[faces],
    )


def _drained(work: Generator[Any, None, _T]) -> _T:
    while True:
        try:
            next(work)
        except StopIteration as ended:
            return ended.value
