"""How well values at vertices, interpolated over the surface, meet the truth: the mappings compared at equal rays.

The truth is that of `bake/bench/surface_truth.py`. Rays cast from the vertices instead of from samples are the third
contender: as many rays in total, spread evenly over the vertices.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bake.bench.isolation import isolated
from bake.bench.scaled import scaled
from bake.bench.scenes import find_scenes
from bake.bench.surface_truth import POINTS, REFERENCE_RAYS, surface_truth, trace_samples
from bake.bench.table import Measurements, bake_seed
from bake.errors import ObscuraError
from bake.geometry import face_normals
from bake.pipeline import settings_for
from bake.samples import place_samples
from bake.scene import flatten, load_scene
from bake.settings import BakeSettings, MappingKind
from bake.solve import VertexMapper
from bake.types import SampleSet, VertexField, World

GATE = 0.95
"""Least squares must leave at most this share of the weighted average's error, at each distance."""

MOST_ITERATIONS = 200


def measure_mappings(paths: Iterable[Path], options: Mapping[str, Any], *, scale: float = 1.0) -> Measurements:
    """Three rows a scene: weighted average, least squares, rays from the vertices. A lone scene's name is the table's.

    Args:
        paths: Scene files, or folders that are searched for them.
        options: Bake options by long name.
        scale: Metres in a unit of the files.
    """
    rows: list[dict[str, Any]] = []
    scenes = find_scenes(paths)
    for scene in scenes:
        outcome = isolated(_rows_or_refusal, scene, options, scale)
        rows += outcome.get("rows", [outcome])
    seed = bake_seed(options)
    return Measurements(
        f"mapping: {scenes[0].name}" if len(scenes) == 1 else "mapping",
        rows,
        [
            f"root mean square error of the interpolated AO against {REFERENCE_RAYS:,} rays at {POINTS:,} points, half "
            "spread by area and half evenly over the faces; `area` columns: all spread by area",
            "ratio: error over that of the weighted average of the same samples; "
            f"gate: at most {GATE:g} at each distance, below the rays from vertices, values within 0 to 1, at most "
            f"{MOST_ITERATIONS} iterations",
        ],
        seeds={"bake": seed, "reference": (seed + 1) % 2**32},
    )


def compare_mappings(
    path: Path, options: Mapping[str, Any], *, scale: float = 1.0, points: int = POINTS
) -> list[dict[str, Any]]:
    """The rows of one scene.

    Args:
        path: The scene's file.
        options: Bake options by long name.
        scale: Metres in a unit of the file.
        points: Points of the comparison.

    Raises:
        InputError: the scene or the options cannot be used.
    """
    settings = settings_for(path, options)
    world = flatten(scaled(load_scene(path), scale), settings)
    samples = place_samples(world, settings)
    tally = trace_samples(world, samples, settings)
    truth = surface_truth(
        world, settings.replaced(rays=REFERENCE_RAYS, seed=(settings.seed + 1) % 2**32), points=points
    )

    begin = time.perf_counter()
    mapper = VertexMapper(world, samples, settings)
    valid = tally.valid(settings.back_face_threshold)
    built = time.perf_counter() - begin
    average = mapper.solve(tally.ao, valid, mapping=MappingKind.AVERAGE)
    begin = time.perf_counter()
    squares = mapper.solve(tally.ao, valid, mapping=MappingKind.LEAST_SQUARES)
    seconds = built + time.perf_counter() - begin
    from_vertices, vertex_rays = _cast_from_vertices(world, settings, len(samples) * settings.rays)

    name = path.name
    base = truth.errors(average.ao)
    rival = truth.errors(from_vertices)
    own = truth.errors(squares.ao)
    finite = squares.ao[np.isfinite(squares.ao)]
    low, high = float(finite.min(initial=1.0)), float(finite.max(initial=0.0))
    iterations = squares.report.iterations
    passed = (
        all(own[key] <= GATE * base[key] and own[key] < rival[key] for key in own if not key.startswith("area"))
        and low >= 0.0
        and high <= 1.0
        and iterations <= MOST_ITERATIONS
    )
    columns = settings.column_distances
    return [
        {"scene": name, "mapping": "weighted average", "rays": settings.rays, **_labelled(base, columns)},
        {
            "scene": name,
            "mapping": f"least squares, alpha {settings.alpha:g}",
            "rays": settings.rays,
            **_labelled(own, columns),
            **{f"ratio {d:g} m": own[f"mixed {k}"] / base[f"mixed {k}"] for k, d in enumerate(columns)},
            **{f"area ratio {d:g} m": own[f"area {k}"] / base[f"area {k}"] for k, d in enumerate(columns)},
            "unknowns": squares.report.unknowns,
            "iterations": iterations,
            "least": low,
            "greatest": high,
            "held": _both(squares),
            "seconds": seconds,
            "passed": passed,
        },
        {"scene": name, "mapping": "rays from vertices", "rays": vertex_rays, **_labelled(rival, columns)},
    ]


def _cast_from_vertices(world: World, settings: BakeSettings, budget: int) -> tuple[np.ndarray, int]:
    """AO at vertices from `budget` rays that start there, shape (n, k); and how many rays each vertex got."""
    sampled = np.flatnonzero(world.face_samples)
    corner = world.faces[sampled]
    largest_last = np.argsort(face_normals(world.positions, corner)[1], kind="stable")
    side = np.full(world.vertex_count, -1, np.int64)  # the corner of its largest face
    for k in range(3):
        side[corner[largest_last, k]] = 3 * sampled[largest_last] + k
    vertex = np.flatnonzero(side >= 0)
    vertex = vertex[np.argsort(side[vertex], kind="stable")]
    rays = int(np.clip(budget // max(len(vertex), 1), 1, 65535))
    casting = settings.replaced(rays=rays)
    face, at = np.divmod(side[vertex], 3)
    samples = SampleSet(
        face=face.astype(np.int32),
        barycentric=np.eye(3, 2, dtype=np.float32)[at],
        area=np.ones(len(vertex), np.float32),
        index=at.astype(np.int32),
        face_seed=place_samples(world, casting).face_seed,
    )
    ao = np.full((world.vertex_count, settings.distance_count), np.nan, np.float32)
    ao[vertex] = trace_samples(world, samples, casting).ao
    return ao, rays


def _labelled(errors: Mapping[str, float], distances: Sequence[float]) -> dict[str, float]:
    labels = {"mixed": "RMSE", "area": "area RMSE"}
    return {f"{labels[name]} {d:g} m": errors[f"{name} {k}"] for name in labels for k, d in enumerate(distances)}


def _both(field: VertexField) -> str:
    return " / ".join(f"{count:,}" for count in field.report.bounded)


def _rows_or_refusal(path: Path, options: Mapping[str, Any], scale: float) -> dict[str, Any]:
    try:
        return {"rows": compare_mappings(path, options, scale=scale)}
    except ObscuraError as error:
        return {"scene": path.name, "refused": str(error).replace(str(path.parent), "…")}
