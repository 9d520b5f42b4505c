"""What fog costs beside the opaque rays, and what it is worth beside the real foliage."""

from __future__ import annotations

import dataclasses
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bake.bench.synthetic import Geometry, field_with_props, height_field, write_ply
from bake.bench.table import Measurements
from bake.decorator_types import FogBoxes
from bake.decorators.fog import make_fog
from bake.decorators.fog_density import without_overlap
from bake.devices import Device, resolve
from bake.pipeline import settings_for
from bake.samples import place_samples
from bake.scene import flatten, load_scene
from bake.settings import BakeSettings
from bake.trace import Tracer, create_tracer
from bake.types import BoolArray, Float32Array, Role, SampleSet, Tally, World

COST_GATE = 1.0
_BOXES = 8000
_SAMPLES = 1 << 15
_ROUNDS = 5
_CELLS = 670
_NEAR_M = 1.0
_TRUTH_RAYS = 256


def measure_fog(scenes: Sequence[Path], options: Mapping[str, Any]) -> Measurements:
    """Rows for the cost of 8,000 boxes over fields of a million triangles, and four rows a scene with shrubs.

    Args:
        scenes: Scene files; shrubs in them are also traced as real geometry.
        options: Bake options by long name.
    """
    rows: list[dict[str, Any]] = []
    fields = {"bare field": height_field(_CELLS), "field with props": field_with_props(_CELLS, subdivisions=2)}
    rows += [{"scene": name, **_cost(field, BakeSettings.from_options(options))} for name, field in fields.items()]
    for path in scenes:
        rows += [{"scene": path.stem, **row} for row in _worth(path, options)]
    notes = [
        f"cost: {_SAMPLES:,} samples spread over the field, with and without fog in turn, median of {_ROUNDS} rounds; "
        f"gate: fog costs at most {COST_GATE:g} of the opaque pass",
        f"worth: RMSE of AO at the surface samples within {_NEAR_M:g} m of a shrub's box against the real foliage "
        f"traced with {_TRUTH_RAYS} rays; fog has the densities that the scene gives, fitted fog those of its meshes",
        "gate: fog, with given and with fitted densities, has less error than leaving the shrubs out",
    ]
    return Measurements("fog", rows, notes)


def _cost(field: Geometry, settings: BakeSettings) -> dict[str, Any]:
    device = resolve(settings.device)
    settings = settings.replaced(samples_per_face=(1, 1))
    with tempfile.TemporaryDirectory() as folder:
        write_ply(Path(folder) / "field.ply", field)
        world = flatten(load_scene(Path(folder) / "field.ply"), settings)
    fog, rng = _scattered(world), np.random.default_rng(2)
    samples = place_samples(world, settings)
    some = np.sort(rng.permutation(len(samples))[:_SAMPLES])
    samples = dataclasses.replace(
        samples,
        face=samples.face[some],
        barycentric=samples.barycentric[some],
        area=samples.area[some],
        index=samples.index[some],
    )
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
            one, other = (_traced(tracer, samples, settings)[1] for tracer in (plain, foggy))
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
    near = _near(world, samples, fog)
    begin = time.perf_counter()
    fitted = make_fog(_without_densities(world), settings.replaced(fit_fog=True))
    fit_s = time.perf_counter() - begin
    shrub = np.array([role is Role.SHRUB for role in world.object_roles], np.bool_)[world.face_object]
    foliage = dataclasses.replace(world, face_casts=world.face_casts | shrub)
    truth = _variant(foliage, None, samples, settings.replaced(rays=_TRUTH_RAYS), device)[0].ao[near]
    rows: list[dict[str, Any]] = []
    for name, seen, boxes in (
        (f"real foliage, {int(shrub.sum()):,} triangles", foliage, None),
        (f"fog, {len(fog):,} boxes", world, fog),
        (f"fitted fog, {len(fog):,} boxes", world, fitted),
        ("left out", world, None),
    ):
        tally, trace_s, build_s = _variant(seen, boxes, samples, settings, device)
        difference = tally.ao[near].astype(np.float64) - truth
        rows.append({"occluders": name, "build s": build_s, "trace s": trace_s})
        for column, distance in enumerate(settings.column_distances):
            rows[-1] |= {
                f"RMSE {distance:g} m": float(np.sqrt((difference[:, column] ** 2).mean())),
                f"mean {distance:g} m": float(tally.ao[near, column].mean()),
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


def _variant(
    world: World, fog: FogBoxes | None, samples: SampleSet, settings: BakeSettings, device: Device
) -> tuple[Tally, float, float]:
    """The tally, and the seconds that tracing and building took."""
    begin = time.perf_counter()
    with create_tracer(world, settings, device, fog=fog) as tracer:
        built = time.perf_counter() - begin
        return (*_traced(tracer, samples, settings), built)


def _traced(tracer: Tracer, samples: SampleSet, settings: BakeSettings) -> tuple[Tally, float]:
    tally = Tally.empty(len(samples), settings.distance_count)
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
