"""What resampling over the surfaces of lower levels of detail gains over resampling at their vertices."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from bake.bench.table import Measurements, bake_seed
from bake.decorators.lods import RAYS, FinestSearch, finest_levels, lod_world
from bake.decorators.resample import BakedSurface
from bake.decorators.small import objects_of
from bake.devices import Device, resolve
from bake.geometry import as_traced, face_normals
from bake.pipeline import bake, settings_for
from bake.samples import place_samples
from bake.scene import load_scene, samplable_faces
from bake.settings import BakeSettings
from bake.stages import StageClock, drained
from bake.trace import create_tracer
from bake.types import BakeResult, Float32Array, Float64Array, Int32Array, Int64Array, Role, SampleSet, Tally, World

_TRUTH_SAMPLES, _TRUTH_RAYS = (16, 16), 1024
_FINEST_SAMPLES = (64, 64)
_NEIGHBOURS = 16


def measure_lods(scenes: Sequence[Path], options: Mapping[str, Any]) -> Measurements:
    """Bakes scenes and compares three ways to give their lower levels AO with what is traced on the finest one.

    Args:
        scenes: Scene files.
        options: Bake options by long name.
    """
    rows: list[dict[str, Any]] = []
    for path in scenes:
        settings = settings_for(path, {**options, "skip": "fog,trees"})
        device = resolve(settings.device)
        scene = load_scene(path, crease_angle=settings.crease_angle)
        result = drained(bake(scene, settings, device, StageClock()))
        rows += [{"scene": path.stem, **row} for row in compare_lods(result, settings, device)]
    notes = [
        f"reference: {_TRUTH_SAMPLES[0]} points a face of the lower level; at each, the AO traced with "
        f"{_TRUTH_RAYS} rays at the closest point of the finest level that faces the same way",
        "surface + fit: what the bake does; at vertices: the same spheres around the vertices, as many rays in all; "
        "nearest vertex: a copy from the finest level's vertices",
        "gate: surface + fit has the least error of the three",
    ]
    seed = bake_seed(options)
    seeds = {"bake": seed, "reference": seed ^ 1, "samples of the finest": seed ^ 2}
    return Measurements("lower levels of detail", rows, notes, seeds=seeds)


def compare_lods(result: BakeResult, settings: BakeSettings, device: Device) -> list[dict[str, Any]]:
    """One row for each lower level and distance: the error of each way, root of the mean square over its surface."""
    world, lods = result.world, objects_of(result.world, Role.LOD)
    if not len(lods):
        return []
    surface = BakedSurface.of(world, dataclasses.replace(result.field, ao=_without(world, lods, result.field.ao)))
    alone = lod_world(world, lods, samplable_faces)
    finest = finest_levels(world, lods)
    checks = place_samples(alone, settings.replaced(samples_per_face=_TRUTH_SAMPLES, seed=settings.seed ^ 1))
    truth, known = _truth(world, checks, np.logical_or.reduce(finest, axis=0), settings, device)
    baked = place_samples(alone, settings)
    vertices, corners = _vertex_samples(alone, lods)
    each = max(1, round(len(baked) * RAYS / max(len(vertices), 1)))
    with create_tracer(dataclasses.replace(world, face_casts=surface.carries), settings, device) as caster:
        search = FinestSearch(world, surface, caster, corners, lods, finest, rays_each=each)
        drained(search.run())
    ways = {
        "surface + fit": result.field.ao.astype(np.float64),
        "at vertices": _scattered(world, vertices, search.ao),
        "nearest vertex": _scattered(world, vertices, _nearest(world, surface, vertices, lods, finest)),
    }
    rows: list[dict[str, Any]] = []
    for number in lods.tolist():
        own = known & (world.face_object[checks.face] == number)
        for column, distance in enumerate(settings.column_distances):
            errors = {name: _rmse(world, checks, values, truth, own, column) for name, values in ways.items()}
            row: dict[str, Any] = {"object": world.object_paths[number], "distance m": distance}
            row |= {"faces": int(np.diff(world.first_face)[number]), "points": int(own.sum())}
            row |= {f"RMSE {name}": error for name, error in errors.items()}
            rows.append({**row, "passed": errors["surface + fit"] == min(errors.values())})
    return rows


def _without(world: World, lods: Int32Array, ao: Float32Array) -> Float32Array:
    """AO as it was before the lower levels had any."""
    ao = ao.copy()
    for number in lods.tolist():
        ao[int(world.first_vertex[number]) : int(world.first_vertex[number + 1])] = np.nan
    return ao


def points_of(world: World, samples: SampleSet) -> Float64Array:
    """Where samples lie, shape (n, 3), metres from the world's origin."""
    return np.einsum("ij,ijk->ik", _phi(samples), as_traced(world.positions)[world.faces[samples.face]])


def _phi(samples: SampleSet) -> Float64Array:
    weights = samples.barycentric.astype(np.float64)
    return np.concatenate([weights, 1.0 - weights.sum(axis=1, keepdims=True)], axis=1)


def _truth(
    world: World, checks: SampleSet, is_finest: np.ndarray, settings: BakeSettings, device: Device
) -> tuple[Float64Array, np.ndarray]:
    """AO traced on the finest level at the closest point to each check, and where there is a valid one."""
    on_finest = dataclasses.replace(world, face_samples=world.face_samples & is_finest[world.face_object])
    dense = place_samples(on_finest, settings.replaced(samples_per_face=_FINEST_SAMPLES, seed=settings.seed ^ 2))
    normals = face_normals(world.positions, world.faces)[0]
    near: Int64Array = np.asarray(cKDTree(points_of(world, dense)).query(points_of(world, checks), k=_NEIGHBOURS)[1])
    agrees = np.einsum("ik,ijk->ij", normals[checks.face], normals[dense.face[near]]) > 0.0
    chosen = near[np.arange(len(near)), agrees.argmax(axis=1)]
    needed, where = np.unique(chosen, return_inverse=True)
    some = SampleSet(
        dense.face[needed], dense.barycentric[needed], dense.area[needed], dense.index[needed], dense.face_seed
    )
    tally = Tally.empty(len(some), settings.distance_count)
    with create_tracer(world, settings.replaced(rays=_TRUTH_RAYS), device) as tracer:
        for batch in some.batches(tracer.batch_size):
            tracer.accumulate(some, batch, tally)
    valid = tally.valid(settings.back_face_threshold)
    return tally.ao[where].astype(np.float64), agrees.any(axis=1) & valid[where]


def _vertex_samples(alone: World, lods: Int32Array) -> tuple[np.ndarray, SampleSet]:
    """The lower levels' vertices as samples, each at a corner of one of its faces, for its share of the surface."""
    chosen = np.flatnonzero(np.isin(alone.face_object, lods) & alone.face_samples)
    corner = alone.faces[chosen]
    areas = face_normals(alone.positions, corner)[1]
    share = np.bincount(corner.ravel(), np.repeat(areas / 3.0, 3), alone.vertex_count)
    vertices, first = np.unique(corner.ravel(), return_index=True)
    weights = np.eye(3, dtype=np.float32)[first % 3][:, :2]
    face = chosen[first // 3].astype(np.int32)
    zero = np.zeros(len(face), np.int32)
    return vertices, SampleSet(face, weights, share[vertices].astype(np.float32), zero, np.zeros(0, np.uint32))


def _nearest(
    world: World, surface: BakedSurface, vertices: np.ndarray, lods: Int32Array, finest: np.ndarray
) -> Float64Array:
    owner = np.repeat(np.arange(world.object_count), np.diff(world.first_vertex))
    found = np.ones((len(vertices), surface.ao.shape[1]))
    for row, number in enumerate(lods.tolist()):
        sources = np.flatnonzero(np.isfinite(surface.ao[:, 0]) & finest[row][owner])
        own = owner[vertices] == number
        if len(sources) and own.any():
            found[own] = surface.ao[sources[cKDTree(world.positions[sources]).query(world.positions[vertices[own]])[1]]]
    return found


def _scattered(world: World, vertices: np.ndarray, values: np.ndarray) -> Float64Array:
    ao = np.full((world.vertex_count, values.shape[1]), np.nan)
    ao[vertices] = values
    return ao


def _rmse(
    world: World, checks: SampleSet, values: Float64Array, truth: Float64Array, own: np.ndarray, column: int
) -> float:
    corners = values[:, column][world.faces[checks.face[own]]]
    error = (_phi(checks)[own] * corners).sum(axis=1) - truth[own, column]
    area = checks.area[own].astype(np.float64)
    return float(np.sqrt((area * error**2).sum() / max(float(area.sum()), 1e-300)))
