"""One bake of a real scene with many injected defects, and what is true at their spots."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bake.arrays import Float64Array, Int64Array
from bake.bench.injected_defects import make_injection
from bake.bench.injection import Injection, Placed, cured, inject
from bake.bench.placements import free_places
from bake.devices import resolve
from bake.explain.cause_names import CauseKind
from bake.geometry import cosine_direction
from bake.low_discrepancy import owen_sobol
from bake.pipeline import bake
from bake.scene import flatten
from bake.scene.validate import find_problems
from bake.settings import BakeSettings, Kernel
from bake.stages import StageClock
from bake.trace import Tracer, create_tracer
from bake.types import BakeResult, Scene, World

TRUTH_RAYS = 1024
PLINTH = 0.35  # how far the top of the plinth is above the ground


@dataclass(frozen=True, slots=True)
class Site:
    """A scene to inject into.

    Attributes:
        name: For tables.
        scene: In metres.
        scale: Size of the injections.
        settings: Of the bakes.
    """

    name: str
    scene: Scene
    scale: float
    settings: BakeSettings


@dataclass(frozen=True, slots=True)
class Round:
    """A baked scene with its injections.

    Attributes:
        result: The bake.
        scene: What was baked.
        placed: The injections, n of them.
        value: Shape (n,): baked AO at each spot, at the shortest distance.
        truth: Shape (n,): AO at each spot by rays from there, in the scene with all cures applied.
        face: Shape (n,): the face of each spot.
        weights: Shape (n, 3): barycentric weights of the spot on it.
    """

    result: BakeResult
    scene: Scene
    placed: tuple[Placed, ...]
    value: Float64Array
    truth: Float64Array
    face: Int64Array
    weights: Float64Array

    def manifest(self, number: int) -> bool:
        """Whether an injection came out as meant: defects too dark, sound spots dark and right."""
        value, truth = float(self.value[number]), float(self.truth[number])
        if self.placed[number].injection.cause is CauseKind.CREVICE:
            return abs(value - truth) < 0.1 and value < 0.45
        return value < truth - 0.08


def find_places(site: Site, random: np.random.Generator, most: int) -> Float64Array:
    """Free places in the site, shape (p, 3), world metres."""
    world = flatten(site.scene, site.settings)
    with create_tracer(world, site.settings, resolve("cpu")) as tracer:
        up = site.scene.up_axis if site.scene.up_axis >= 0 else 1
        size = site.scale
        return world.origin + free_places(
            world, tracer, random, up_axis=up, radius=1.5 * size, height=2.2 * size, most=most
        )


def make_round(site: Site, causes: Sequence[CauseKind], places: Float64Array, random: np.random.Generator) -> Round:
    """Bakes the site with one injection of each listed cause.

    Args:
        site: Where.
        causes: n of them.
        places: Shape (n, 3), world metres.
        random: Decides the measures and the turns.
    """
    injections: list[Injection] = [make_injection(cause, random) for cause in causes]
    up = site.scene.up_axis if site.scene.up_axis >= 0 else 1
    turns: list[float] = random.uniform(0.0, 2.0 * np.pi, len(causes)).tolist()
    tops = places.copy()
    tops[:, up] += PLINTH * site.scale
    scene, placed = inject(site.scene, injections, tops, turns, site.scale)
    return bake_round(scene, placed, site.settings)


def bake_round(scene: Scene, placed: Sequence[Placed], settings: BakeSettings) -> Round:
    """Bakes a scene with injections and finds out what is true at their spots."""
    scene = dataclasses.replace(scene, findings=tuple(find_problems(scene)))
    work = bake(scene, settings, resolve("cpu"), StageClock())
    while True:
        try:
            next(work)
        except StopIteration as done:
            result: BakeResult = done.value
            break
    spots = [locate(result.world, item) for item in placed]
    face = np.array([spot[0] for spot in spots], np.int64)
    weights = np.array([spot[1] for spot in spots])
    values = result.field.ao[:, 0].astype(np.float64)
    value = np.einsum("ij,ij->i", values[result.world.faces[face]], weights)
    sound = flatten(cured(scene, placed), settings)
    with create_tracer(sound, settings, resolve("cpu")) as tracer:
        truth = np.array([direct_ao(tracer, item, sound.origin, settings) for item in placed])
    return Round(result, scene, tuple(placed), value, truth, face, weights)


def locate(world: World, item: Placed) -> tuple[int, Float64Array]:
    """The face of the spot's object next to the spot, and the weights of its corners there."""
    number = world.object_paths.index(item.dark_path)
    begin, end = int(world.first_face[number]), int(world.first_face[number + 1])
    corners = world.positions[world.faces[begin:end]]
    weights, away = _nearest(corners, item.spot - world.origin)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing = across @ item.normal > 0.0
    # of faces at the same place, the one that is looked at; of others, the nearest
    best = int(np.lexsort((~facing, np.round(away, 6)))[0])
    return begin + best, weights[best]


def direct_ao(tracer: Tracer, item: Placed, origin: Float64Array, settings: BakeSettings) -> float:
    """AO at a spot by rays from there, at the shortest distance."""
    start = item.spot - origin + 2e-3 * item.scale * item.normal
    u, v = owen_sobol(np.arange(TRUTH_RAYS), np.full(TRUTH_RAYS, 7, np.uint32))
    ways = cosine_direction(u, v, np.tile(item.normal, (TRUTH_RAYS, 1))).astype(np.float32)
    origins = np.tile(start, (TRUTH_RAYS, 1)).astype(np.float32)
    hits = tracer.nearest(origins, ways, settings.trace_distance)
    if settings.kernel is Kernel.OCCLUSION:
        return float((hits.face < 0).mean())
    return float(np.where(hits.face < 0, 1.0, 1.0 - 2.0 ** (-hits.distance / min(settings.distances))).mean())


def _nearest(corners: Float64Array, point: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Weights of the nearest point on each triangle, shape (m, 3), and its distance from `point`, shape (m,)."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    u, v, w = b - a, c - a, point - a
    uu, uv, vv = (np.einsum("ij,ij->i", *pair) for pair in ((u, u), (u, v), (v, v)))
    wu, wv = np.einsum("ij,ij->i", w, u), np.einsum("ij,ij->i", w, v)
    determinant = np.maximum(uu * vv - uv * uv, 1e-300)
    s, t = (vv * wu - uv * wv) / determinant, (uu * wv - uv * wu) / determinant
    # outside, clamping and renormalising is near enough: the spots lie on their faces
    weights = np.clip(np.stack([1.0 - s - t, s, t], axis=1), 0.0, 1.0)
    weights /= weights.sum(axis=1, keepdims=True)
    away = np.linalg.norm(np.einsum("ij,ijk->ik", weights, corners) - point, axis=1)
    return weights, away
