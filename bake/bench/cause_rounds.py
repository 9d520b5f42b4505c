"""One bake of a real scene with many injected defects, and what is true at their spots."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bake.arrays import BoolArray, Float64Array, Int64Array
from bake.bench.bystanders import only_near
from bake.bench.injection import Injection, Placed, cured, inject
from bake.bench.placements import free_places
from bake.devices import resolve
from bake.explain.cause_names import CauseKind
from bake.explain.looks import follow
from bake.explain.retrace import rho_of
from bake.geometry import cosine_direction
from bake.low_discrepancy import owen_sobol
from bake.pipeline import bake
from bake.scene import flatten
from bake.scene.validate import find_problems
from bake.settings import BakeSettings
from bake.stages import StageClock
from bake.trace import Tracer, create_tracer
from bake.types import BakeResult, Scene, World

TRUTH_RAYS = 1024
PLINTH = 0.35  # how far the top of the plinth is above the ground
NEARBY = 2.5  # metres of the injection around it within which the level is baked


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
        value: Shape (n,): baked AO at each spot, at the injection's distance.
        truth: Shape (n,): AO at each spot by rays from there, in the scene with all cures applied.
        shown: Shape (n,), bool: whether the spot can be seen: by the rule of the bake, so few of its rays' hits are
            backs of one-sided faces that it does not lie in something.
        face: Shape (n,): the face of each spot.
        weights: Shape (n, 3): barycentric weights of the spot on it.
    """

    result: BakeResult
    scene: Scene
    placed: tuple[Placed, ...]
    value: Float64Array
    truth: Float64Array
    shown: BoolArray
    face: Int64Array
    weights: Float64Array

    def manifest(self, number: int) -> bool:
        """Whether an injection came out as meant: defects too dark, seams with a step, sound spots dark and right."""
        value, truth = float(self.value[number]), float(self.truth[number])
        if self.placed[number].injection.cause is CauseKind.CREVICE:
            return abs(value - truth) < 0.1 and value < 0.45 and bool(self.shown[number])
        if self.placed[number].injection.cause is CauseKind.SEAM and self._step(number) < 0.1:
            return False
        return value < truth - 0.08

    def _step(self, number: int) -> float:
        """Largest difference between the spot's vertices and others at the same place that look the same way."""
        world, ao = self.result.world, self.result.field.ao[:, 0]
        step = 0.0
        for vertex in world.faces[self.face[number]][self.weights[number] > 0.2].tolist():
            near = np.all(np.abs(world.positions - world.positions[vertex]) < 1e-3, axis=1)
            near &= world.normals @ world.normals[vertex] > 0.8
            step = max(step, float(np.nanmax(np.abs(ao[near] - ao[vertex]), initial=0.0)))
        return step


def find_places(site: Site, random: np.random.Generator, most: int) -> Float64Array:
    """Free places in the site, shape (p, 3), world metres."""
    world = flatten(site.scene, site.settings)
    with create_tracer(world, site.settings, resolve("cpu")) as tracer:
        size, up = site.scale, up_axis(site.scene)
        return world.origin + free_places(
            world, tracer, random, up_axis=up, radius=1.5 * size, height=2.2 * size, most=most
        )


def make_round(site: Site, injections: Sequence[Injection], places: Float64Array, random: np.random.Generator) -> Round:
    """Bakes the site with one injection at each place.

    Args:
        site: Where.
        injections: n of them.
        places: Shape (n, 3), world metres, on the ground.
        random: Decides the turns.
    """
    scene, placed = put(site, injections, places, random)
    return bake_round(scene, placed, site.settings, cured(scene, placed), placed)


def put(
    site: Site, injections: Sequence[Injection], places: Float64Array, random: np.random.Generator
) -> tuple[Scene, list[Placed]]:
    """The site's scene with one injection on a plinth at each place; arguments as for `make_round`.

    What lies far from all of them is a blocker.
    """
    turns: list[float] = random.uniform(0.0, 2.0 * np.pi, len(injections)).tolist()
    tops = places.copy()
    tops[:, up_axis(site.scene)] += PLINTH * site.scale
    return inject(only_near(site.scene, tops, NEARBY * site.scale), injections, tops, turns, site.scale)


def bake_round(
    scene: Scene, placed: Sequence[Placed], settings: BakeSettings, sound: Scene, sound_placed: Sequence[Placed]
) -> Round:
    """Bakes a scene with injections and finds out what is true at their spots.

    Args:
        scene: With injections.
        placed: Them.
        settings: Of the bake.
        sound: The scene with everything mended.
        sound_placed: The same injections there.
    """
    result = bake_scene(scene, settings)
    spots = [locate(result.world, item) for item in placed]
    face = np.array([spot[0] for spot in spots], np.int64)
    weights = np.array([spot[1] for spot in spots])
    columns = np.array([item.injection.column for item in placed])
    values = result.field.ao.astype(np.float64)[result.world.faces[face], columns[:, None]]
    world = flatten(sound, settings)
    with create_tracer(world, settings, resolve("cpu")) as tracer:
        seen = [direct_look(tracer, item, world.origin) for item in sound_placed]
    truth, backs = np.array(seen).reshape(-1, 2).T
    shown = backs <= settings.back_face_threshold
    return Round(result, scene, tuple(placed), np.einsum("ij,ij->i", values, weights), truth, shown, face, weights)


def bake_scene(scene: Scene, settings: BakeSettings) -> BakeResult:
    """A bake of a scene in memory, its findings made anew."""
    scene = dataclasses.replace(scene, findings=tuple(find_problems(scene)))
    work = bake(scene, settings, resolve("cpu"), StageClock())
    while True:
        try:
            next(work)
        except StopIteration as done:
            return done.value


def up_axis(scene: Scene) -> int:
    """Which way is up; y where the file does not say."""
    return scene.up_axis if scene.up_axis >= 0 else 1


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


def direct_look(tracer: Tracer, item: Placed, origin: Float64Array) -> tuple[float, float]:
    """AO at a spot by rays from there, and what share of their hits are backs of one-sided faces."""
    start = item.spot - origin + 2e-3 * item.scale * item.normal
    u, v = owen_sobol(np.arange(TRUTH_RAYS), np.full(TRUTH_RAYS, 7, np.uint32))
    ways = cosine_direction(u, v, np.tile(item.normal, (TRUTH_RAYS, 1)))
    ends = follow(tracer, np.tile(start, (TRUTH_RAYS, 1)), ways, tracer.settings.trace_distance)
    rho = rho_of(ends.distance, tracer.settings)[:, item.injection.column].astype(np.float64)
    struck = ends.face >= 0
    return float(np.where(struck, rho, 1.0).mean()), float((ends.proof & struck).sum() / max(int(struck.sum()), 1))


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
