"""How exact explanations are, and how fast: shares against values, and counterfactuals against whole bakes."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bake.bench.isolation import isolated
from bake.bench.scaled import scaled
from bake.bench.table import Measurements, bake_seed
from bake.devices import resolve
from bake.errors import ObscuraError
from bake.explain.explainer import Explainer
from bake.explain.retrace import tracer_like
from bake.explain.spot import vertex_spot
from bake.explain.types import Explanation, ShareKind
from bake.pipeline import bake, settings_for, trace
from bake.scene import load_scene
from bake.solve import map_to_vertices
from bake.stages import StageClock, drained
from bake.types import BakeResult, Float64Array, Int64Array, Role, VertexField, VertexState

SPOTS = 200
"""Random vertices that are explained."""

OBJECTS = 4
"""Objects that are taken away; the spots without them are as many again, shared among them."""

SUM_GATE = 1e-4
"""Largest error of the sum of shares, and of the sum of weights."""

WITHOUT_GATE = 1e-3
"""Largest error of a counterfactual against a bake without the object."""

SECONDS_GATE = 0.3
"""Median time of an explanation, warm."""


def measure_explanations(
    scenes: Sequence[Path], options: Mapping[str, Any], *, scales: Sequence[float] = ()
) -> list[Measurements]:
    """Two tables, a row a scene each: explanations, and counterfactuals.

    Args:
        scenes: Scene files.
        options: Bake options by long name.
        scales: Metres in a unit of each file; 1 for those without.
    """
    shares: list[dict[str, Any]] = []
    without: list[dict[str, Any]] = []
    for number, scene in enumerate(scenes):
        outcome = isolated(_rows_or_refusal, scene, options, scales[number] if number < len(scales) else 1.0)
        shares.append(outcome.get("shares", outcome))
        without += outcome.get("without", [])
    seeds = {"bake, vertices and objects": bake_seed(options)}
    return [
        Measurements(
            "explanations",
            shares,
            [
                f"{SPOTS} random vertices; sum: largest difference between the shares of objects, bounds and untraced "
                "samples and 1 - AO; weights: of the sum of the samples' weights and 1; rays: of a sample's AO traced "
                "again and as stored",
                "first: from the result to the first explanation, the structures of its tracer and its solver "
                "included; warm: median of all others",
                f"gate: sum and weights at most {SUM_GATE:g}, warm at most {SECONDS_GATE:g} s",
            ],
            seeds=seeds,
        ),
        Measurements(
            "counterfactuals",
            without,
            [
                f"against a whole bake in which the object does not cast: up to {OBJECTS} objects that take most at "
                "random vertices; surface: all vertices; spots: the vertices that the object was chosen for",
                "estimate: error at a spot before the whole surface was seen; apart: vertices of the surface that "
                f"differ by more than {WITHOUT_GATE:g}",
                f"gate: at most {WITHOUT_GATE:g} at the spots, and one vertex in a thousand apart",
            ],
            seeds=seeds,
        ),
    ]


def explain_scene(path: Path, options: Mapping[str, Any], *, scale: float = 1.0) -> dict[str, Any]:
    """The row of explanations under "shares", the rows of counterfactuals under "without".

    Args:
        path: The scene's file.
        options: Bake options by long name.
        scale: Metres in a unit of the file.

    Raises:
        InputError: the scene or the options cannot be used.
    """
    settings = settings_for(path, options)
    clock = StageClock()
    result = drained(bake(scaled(load_scene(path), scale), settings, resolve(settings.device), clock))
    rng = np.random.default_rng(settings.seed)
    vertices = rng.choice(np.flatnonzero(_explicable(result)), SPOTS)
    begin = time.perf_counter()
    with Explainer(result) as explainer:
        explainer.explain_vertex(int(vertices[0]))
        first = time.perf_counter() - begin
        found = [explainer.explain_vertex(int(vertex)) for vertex in vertices]
        row = _shares_row(path, result, found, first)
        return {"shares": row, "without": _without_rows(path, explainer, found)}


def _explicable(result: BakeResult) -> np.ndarray:
    """Vertices that the fit has given a value, shape (n,)."""
    roles = result.world.object_roles
    receives = np.repeat([role.receives_per_vertex for role in roles], np.diff(result.world.first_vertex))
    return receives & (result.field.state <= VertexState.FILLED)


def _shares_row(path: Path, result: BakeResult, found: Sequence[Explanation], first: float) -> dict[str, Any]:
    summed = max(_sum_error(result, item) for item in found)
    weights = max(abs(item.weight_sum - 1.0) for item in found)
    seconds = np.array([item.seconds for item in found])
    return {
        "scene": path.name,
        "faces": result.world.face_count,
        "samples": len(result.samples),
        "rays": result.settings.rays,
        "sum": summed,
        "weights": weights,
        "rays again": max(item.retrace_error for item in found),
        "samples a spot": float(np.median([len(item.samples) for item in found])),
        "most samples": max(len(item.samples) for item in found),
        "own weight": float(np.median([item.own_weight for item in found])),
        "first s": first,
        "warm s": float(np.median(seconds)),
        "warm 95 % s": float(np.quantile(seconds, 0.95)),
        "passed": summed <= SUM_GATE and weights <= SUM_GATE and float(np.median(seconds)) <= SECONDS_GATE,
    }


def _sum_error(result: BakeResult, item: Explanation) -> float:
    """By how much the shares that can be named miss 1 - AO as stored."""
    named = np.sum([share.share for share in item.shares if share.kind is not ShareKind.RESIDUAL], axis=0)
    stored: Float64Array = result.field.ao[item.spot.vertices[0]].astype(np.float64)
    return float(np.abs(named - (1.0 - stored)).max())


@dataclass(frozen=True, slots=True)
class _Target:
    """An object to take away, and the vertices that it darkens."""

    wanted: int
    vertices: Int64Array


def _targets(found: Sequence[Explanation]) -> list[_Target]:
    """The objects that take the most at some of the spots, with those spots; the object under a spot if none other."""
    spots: dict[int, list[int]] = {}
    for item in found:
        others = [share for share in item.occluders if not share.is_self and abs(float(share.share[-1])) > 0.01]
        chosen = (others or list(item.occluders))[:1]
        for share in chosen:
            spots.setdefault(share.object, []).append(int(item.spot.vertices[0]))
    most = sorted(spots, key=lambda number: -len(spots[number]))[:OBJECTS]
    return [_Target(number, np.array(spots[number], np.int64)) for number in most]


def _without_rows(path: Path, explainer: Explainer, found: Sequence[Explanation]) -> list[dict[str, Any]]:
    result = explainer.result
    rows: list[dict[str, Any]] = []
    for target in _targets(found):
        spots = [vertex_spot(result, int(vertex)) for vertex in target.vertices]
        explainer.spot_without(spots[0], target.wanted)  # makes what all spots share
        guesses = [explainer.spot_without(spot, target.wanted) for spot in spots]
        surface = explainer.without_object(target.wanted)
        exact = [explainer.spot_without(spot, target.wanted) for spot in spots]
        begin = time.perf_counter()
        truth = _bake_without(result, target.wanted)
        seconds = time.perf_counter() - begin
        apart = np.abs(surface.ao - truth.ao).max(axis=1)
        apart = apart[np.isfinite(apart)]
        at_spots = truth.ao[target.vertices].astype(np.float64)
        error = float(np.abs(np.array([item.after for item in exact]) - at_spots).max())
        beyond = int(np.count_nonzero(apart > WITHOUT_GATE))
        rows.append(
            {
                "scene": path.name,
                "object": result.world.object_paths[target.wanted],
                "spots": len(spots),
                "samples seeing it": surface.samples,
                "spot error": error,
                "estimate": float(np.quantile(np.abs(np.array([item.after for item in guesses]) - at_spots), 0.95)),
                "surface error": float(apart.max(initial=0.0)),
                "apart": beyond,
                "vertices": len(apart),
                "spot s": float(np.median([item.seconds for item in exact])),
                "surface s": surface.seconds,
                "bake s": seconds,
                "passed": error <= WITHOUT_GATE and beyond <= 1e-3 * len(apart),
            }
        )
    return rows


def _bake_without(result: BakeResult, wanted: int) -> VertexField:
    """Traces and solves everything in a world in which the object does not cast."""
    world, settings = result.world, result.settings
    roles = list(world.object_roles)
    fog = None if result.decorators is None else result.decorators.fog
    if roles[wanted] in (Role.TREE, Role.SHRUB):
        roles[wanted] = Role.IGNORE
    if fog is not None and wanted in fog.object:
        from bake.decorators.fog import make_fog

        fog = make_fog(replace(world, object_roles=tuple(roles)), settings)
    casts = world.face_casts & (world.face_object != wanted)
    bare = replace(world, face_casts=casts, object_roles=tuple(roles))
    with tracer_like(result, bare, fog) as tracer:
        tally = drained(trace(tracer, result.samples, settings, StageClock()))
    return map_to_vertices(world, result.samples, tally.ao, tally.valid(settings.back_face_threshold), settings)


def _rows_or_refusal(path: Path, options: Mapping[str, Any], scale: float) -> dict[str, Any]:
    try:
        return explain_scene(path, options, scale=scale)
    except ObscuraError as error:
        return {"scene": path.name, "refused": str(error).replace(str(path.parent), "…")}
