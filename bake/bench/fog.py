"""What fog costs beside the opaque rays, and what it is worth beside the real foliage."""

from __future__ import annotations

import contextlib
import dataclasses
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bake.bench.synthetic import Geometry, field_with_props, height_field, write_ply
from bake.bench.table import Measurements, bake_seed
from bake.decorator_types import FogBoxes
from bake.decorators.fog import make_fog
from bake.decorators.fog_density import without_overlap
from bake.devices import resolve
from bake.pipeline import settings_for
from bake.samples import place_samples
from bake.scene import flatten, load_scene
from bake.settings import BakeSettings
from bake.trace import Tracer, create_tracer
from bake.types import BoolArray, Float32Array, Int64Array, Role, SampleSet, Tally, World

COST_GATE = 1.0
_BOXES = 8000
_SAMPLES = 1 << 14
_ROUNDS, _WORTH_ROUNDS = 15, 5
_CELLS = 670
_NEAR_M = 1.0
_TRUTH_RAYS = 256


def measure_fog(scenes: Sequence[Path], options: Mapping[str, Any]) -> tuple[Measurements, ...]:
    """Two tables: what 8,000 boxes cost over fields of a million triangles; and four rows a scene with shrubs.

    Args:
        scenes: Scene files; shrubs in them are also traced as real geometry.
        options: Bake options by long name.
    """
    fields = {"bare field": height_field(_CELLS), "field with props": field_with_props(_CELLS, subdivisions=2)}
    cost = [{"scene": name, **_cost(field, BakeSettings.from_options(options))} for name, field in fields.items()]
    cost_notes = [
        f"{_SAMPLES:,} samples spread over the field, with and without fog in turn, median of {_ROUNDS} rounds; "
        f"gate: fog costs at most {COST_GATE:g} of the opaque pass",
    ]
    worth = [{"scene": path.stem, **row} for path in scenes for row in _worth(path, options)]
    worth_notes = [
        f"up to {_SAMPLES:,} surface samples within {_NEAR_M:g} m of a shrub's box; RMSE of AO against the real "
        f"foliage traced with {_TRUTH_RAYS} rays; fog has the densities that the scene gives, fitted fog those of its "
        f"meshes; seconds are medians of {_WORTH_ROUNDS} rounds in turn",
        "gate: fog, with given and with fitted densities, has less error than leaving the shrubs out",
    ]
    seeds = {"bake": bake_seed(options), "boxes": 1, "samples for the cost": 2, "samples for the worth": 3}
    tables = (
        Measurements("cost of fog", cost, cost_notes, seeds=seeds),
        Measurements("worth of fog", worth, worth_notes, seeds=seeds),
    )
    return tables if worth else tables[:1]


def _cost(field: Geometry, settings: BakeSettings) -> dict[str, Any]:
    device = resolve(settings.device)
    settings = settings.replaced(samples_per_face=(1, 1))
    with tempfile.TemporaryDirectory() as folder:
        write_ply(Path(folder) / "field.ply", field)
        world = flatten(load_scene(Path(folder) / "field.ply"), settings)
    fog, rng = _scattered(world), np.random.default_rng(2)
    samples = place_samples(world, settings)
    samples = _subset(samples, np.sort(rng.permutation(len(samples))[:_SAMPLES]))
    begin = time.perf_counter()
    without_overlap(fog.minimum, fog.maximum, fog.given_density)
    overlap_s = time.perf_counter() - begin
    seconds: list[tuple[float, float]] = []
    with (
        create_tracer(world, settings, device) as plain,
        create_tracer(world, settings, device, fog=fog) as foggy,
    ):
        for tracer in (plain, foggy):
            tracer.accumulate(samples, slice(0, 256), Tally.empty(len(samples), settings.distance_count))
        for _ in range(_ROUNDS):
            one, other = (_traced(tracer, samples)[1] for tracer in (plain, foggy))
            seconds.append((one, other))
        name = f"{plain.name} on {plain.device}"
    opaque, both = np.median(np.array(seconds), axis=0).tolist()
    cost = float(np.median([other / one - 1.0 for one, other in seconds]))
    return {
        "occluders": f"{len(fog):,} boxes",
        "tracer": name,
        "overlap s": overlap_s,
        "opaque Mrays/s": len(samples) * settings.rays / opaque / 1e6,
        "with fog Mrays/s": len(samples) * settings.rays / both / 1e6,
        "fog / opaque": cost,
        "passed": cost <= COST_GATE,
    }


def _scattered(world: World) -> FogBoxes:
    """Boxes of shrub size that stand all over a field whose up is z."""
    rng = np.random.default_rng(1)
    half = rng.uniform((0.3, 0.3, 0.2), (1.0, 1.0, 0.7), (_BOXES, 3))
    foot = world.positions[rng.integers(0, (_CELLS + 1) ** 2, _BOXES)]  # the field's vertices come first
    centre = foot + half * (0.0, 0.0, 1.0)
    low, high = (centre - half).astype(np.float32), (centre + half).astype(np.float32)
    given = np.full(_BOXES, 0.7, np.float32)
    return FogBoxes(np.arange(_BOXES, dtype=np.int32), low, high, given, without_overlap(low, high, given))


def _worth(path: Path, options: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The shrubs of a scene as real foliage, as fog, as fitted fog, and left out."""
    settings = settings_for(path, {**options, "fit-fog": False})
    world = flatten(load_scene(path, crease_angle=settings.crease_angle), settings)
    fog = make_fog(world, settings)
    if fog is None:
        return []
    device, samples = resolve(settings.device), place_samples(world, settings)
    near = np.flatnonzero(_near(world, samples, fog))
    some = np.random.default_rng(3).permutation(near)[:_SAMPLES]
    samples = _subset(samples, np.sort(some))
    begin = time.perf_counter()
    fitted = make_fog(_without_densities(world), settings.replaced(fit_fog=True))
    fit_s = time.perf_counter() - begin
    shrub = np.array([role is Role.SHRUB for role in world.object_roles], np.bool_)[world.face_object]
    foliage = dataclasses.replace(world, face_casts=world.face_casts | shrub)
    with create_tracer(foliage, settings.replaced(rays=_TRUTH_RAYS), device) as tracer:
        truth = _traced(tracer, samples)[0].ao
    variants = {
        f"real foliage, {int(shrub.sum()):,} triangles": (foliage, None),
        f"fog, {len(fog):,} boxes": (world, fog),
        f"fitted fog, {len(fog):,} boxes": (world, fitted),
        "left out": (world, None),
    }
    rows: list[dict[str, Any]] = []
    with contextlib.ExitStack() as stack:
        tracers: list[Tracer] = []
        for name, (seen, boxes) in variants.items():
            begin = time.perf_counter()
            tracers.append(stack.enter_context(create_tracer(seen, settings, device, fog=boxes)))
            rows.append({"occluders": name, "samples near": len(samples), "build s": time.perf_counter() - begin})
        tallies = [_traced(tracer, samples)[0] for tracer in tracers]  # warms them up
        seconds = np.array([[_traced(tracer, samples)[1] for tracer in tracers] for _ in range(_WORTH_ROUNDS)])
    dearer = np.median(seconds / seconds[:, -1:], axis=0)
    for row, tally, trace_s, ratio in zip(rows, tallies, np.median(seconds, axis=0), dearer, strict=True):
        difference = tally.ao.astype(np.float64) - truth
        row |= {"trace s": float(trace_s), "trace / left out": float(ratio)}
        for column, distance in enumerate(settings.column_distances):
            row |= {
                f"RMSE {distance:g} m": float(np.sqrt((difference[:, column] ** 2).mean())),
                f"mean {distance:g} m": float(tally.ao[:, column].mean()),
            }
    rows[2]["fit s"] = fit_s
    keys = [f"RMSE {distance:g} m" for distance in settings.column_distances]
    for row in rows[1:3]:
        row["passed"] = all(row[key] < rows[3][key] for key in keys)
    return rows


def _without_densities(world: World) -> World:
    """The same, but no object says its own density."""
    keys = tuple(dataclasses.replace(own, density=None) for own in world.object_keys)
    return dataclasses.replace(world, object_keys=keys)


def _subset(samples: SampleSet, some: Int64Array) -> SampleSet:
    """Some of the samples, by number."""
    return dataclasses.replace(
        samples,
        face=samples.face[some],
        barycentric=samples.barycentric[some],
        area=samples.area[some],
        index=samples.index[some],
    )


def _traced(tracer: Tracer, samples: SampleSet) -> tuple[Tally, float]:
    tally = Tally.empty(len(samples), tracer.settings.distance_count)
    begin = time.perf_counter()
    for batch in samples.batches(tracer.batch_size):
        tracer.accumulate(samples, batch, tally)
    return tally, time.perf_counter() - begin


def _near(world: World, samples: SampleSet, fog: FogBoxes) -> BoolArray:
    """Samples close to a shrub's box, shape (n,)."""
    corners = world.positions[world.faces[samples.face]]
    third = 1.0 - samples.barycentric.sum(axis=1, keepdims=True)
    weights = np.concatenate([samples.barycentric, third], axis=1)
    point: Float32Array = np.einsum("ij,ijk->ik", weights, corners).astype(np.float32)
    near = np.zeros(len(samples), np.bool_)
    for low, high in zip(fog.minimum, fog.maximum, strict=True):
        near |= ((point >= low - _NEAR_M) & (point <= high + _NEAR_M)).all(axis=1)
    return near
