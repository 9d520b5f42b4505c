"""Ways to choose a sample's directions: the error of its AO by rays, and how fast that falls.

All of them are traced from the same points by the same tracer and weighed alike, so that only the directions differ.
Two scenes are made: a closed room, where AO is smooth in the direction but for the room's edges, and an open place of
silhouettes; and the samples of any level can be taken besides.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bake import geometry
from bake.bench.point_sets import POINT_SETS, scrambled_sobol
from bake.bench.scaled import scaled
from bake.bench.surface_truth import trace_samples
from bake.bench.synthetic import Geometry, cube, height_field, icosahedron, joined, subdivided, write_ply
from bake.bench.table import Measurements
from bake.devices import resolve
from bake.pipeline import settings_for
from bake.samples import place_samples
from bake.scene import flatten, load_scene
from bake.settings import BakeSettings
from bake.trace import Tracer, create_tracer
from bake.trace.brute import drawn_rays
from bake.types import Float32Array, Float64Array, SampleSet, World

RAYS = (16, 64, 256, 1024)
SETS, POINTS = 32, 48
REFERENCE_RAYS = 1 << 15  # and as many again, by which its own error is told
OURS, JITTER, RANDOM = "Sobol, Owen-scrambled", "stratified jitter", "random"
ROOM, OPEN = "closed room", "open place"

AT, SHARE_OF_JITTER = 256, 0.6
STEEPEST = {ROOM: -1.1, OPEN: -0.7}
"""Gates: our error at so many rays is at most this share of jitter's in the room, and our slopes at most these."""


@dataclass(frozen=True, slots=True)
class SamplerCurve:
    """One way to choose directions in one scene.

    Attributes:
        sampler, disc: Points of the unit square, and how they come to the disc below the hemisphere.
        rmse: At each of `RAYS`, over all points and sets.
    """

    sampler: str
    disc: str
    rmse: tuple[float, ...]

    @property
    def slope(self) -> float:
        """Of the logarithm of the error over that of the rays, least squares."""
        return float(np.polyfit(np.log(RAYS), np.log(np.maximum(self.rmse, 1e-12)), 1)[0])

    @property
    def named(self) -> str:
        """Both names; the usual map goes without saying."""
        return self.sampler if self.disc == "concentric" else f"{self.sampler}, {self.disc}"


@dataclass(frozen=True, slots=True)
class SamplerScene:
    """All curves of a scene.

    Attributes:
        name: Of the scene.
        curves: One a way.
        reference_error: RMSE of the reference itself.
        settings: That decide samples, rays' length and the first distance; their seed is that of points and sets.
    """

    name: str
    curves: Sequence[SamplerCurve]
    reference_error: float
    settings: BakeSettings

    @property
    def distance(self) -> float:
        """At which a blocker counts half, metres."""
        return self.settings.column_distances[0]


class _Points(NamedTuple):
    """Where rays start, shape (p, 3) each: just above the faces; and what their directions are about."""

    origin: Float32Array
    face_normal: Float64Array
    normal: Float64Array


def measure_samplers(
    scenes: Iterable[Path], options: Mapping[str, Any], *, scale: float = 1.0, sets: int = SETS, points: int = POINTS
) -> Iterator[SamplerScene]:
    """The curves of each scene, as they come; without a scene, of the two that it makes.

    Args:
        scenes: Scene files.
        options: Bake options by long name; the first distance is that of the obscurance.
        scale: Metres in a unit of the scenes.
        sets: Scramblings, shifts or draws at each point.
        points: Places on the surface, spread by area, whose back faces do not forbid them.
    """
    for name, world, settings in _worlds(list(scenes), options, scale):
        yield _measured(name, world, settings, sets, points)


def samplers_table(measured: Sequence[SamplerScene]) -> Measurements:
    """A row a way and scene, the gates at ours."""
    rows: list[dict[str, Any]] = []
    for scene in measured:
        by_name = {curve.named: curve for curve in scene.curves}
        for curve in scene.curves:
            row: dict[str, Any] = {"scene": scene.name, "directions": curve.sampler, "disc": curve.disc}
            row |= {f"RMSE, {rays:,} rays": error for rays, error in zip(RAYS, curve.rmse, strict=True)}
            row |= {"slope": curve.slope, f"random rays as good as {AT}": _equal_rays(curve, by_name.get(RANDOM))}
            if curve.named == OURS and scene.name in STEEPEST:
                row["passed"] = _holds(scene.name, curve, by_name[JITTER])
            rows.append(row)
    names = [scene.name for scene in measured]
    notes = [
        f"AO at {POINTS} points by area, {SETS} sets of directions each, all traced by one tracer; obscurance at "
        f"{measured[0].distance:g} m; reference of {2 * REFERENCE_RAYS:,} rays, good to "
        + ", ".join(f"{scene.reference_error:.1e}" for scene in measured),
        "slope: of log RMSE over log rays, least squares; random: as many rays as random directions would need, by the "
        "square root's law",
    ]
    if any(name in STEEPEST for name in names):
        notes.append(
            f"gates for {OURS}: a slope of at most {STEEPEST[ROOM]:g} in the room and {STEEPEST[OPEN]:g} in the open, "
            f"and {SHARE_OF_JITTER:g} of the error of {JITTER} at {AT} rays in the room"
        )
    made = all(name in STEEPEST for name in names)
    title = "samplers" if made else f"samplers: {', '.join(names)}"
    settings = measured[0].settings
    seeds = {"points and sets": settings.seed, "reference": (settings.seed + 1) % 2**32, "scene": 1}
    return Measurements(title, rows, notes, seeds=seeds, settings=settings.to_json())


def _equal_rays(curve: SamplerCurve, random: SamplerCurve | None) -> int | None:
    if random is None:
        return None
    where = RAYS.index(AT)
    return round(AT * (random.rmse[where] / max(curve.rmse[where], 1e-12)) ** 2)


def _holds(scene: str, ours: SamplerCurve, jitter: SamplerCurve) -> bool:
    where = RAYS.index(AT)
    near = scene != ROOM or ours.rmse[where] <= SHARE_OF_JITTER * jitter.rmse[where]
    return near and ours.slope <= STEEPEST[scene]


def _worlds(
    scenes: Sequence[Path], options: Mapping[str, Any], scale: float
) -> Iterator[tuple[str, World, BakeSettings]]:
    for path in scenes:
        settings = settings_for(path, options)
        yield path.name, flatten(scaled(load_scene(path), scale), settings), settings
    if not scenes:
        settings = BakeSettings.from_options(options)
        with tempfile.TemporaryDirectory(prefix="obscura-samplers-") as folder:
            for name, made in ((ROOM, closed_room()), (OPEN, open_place())):
                mesh = Path(folder) / f"{name}.ply"
                write_ply(mesh, made)
                yield name, flatten(load_scene(mesh), settings), settings


def closed_room() -> Geometry:
    """A box of 8 × 6 × 3 m seen from inside."""
    positions, faces = cube()
    return positions * [8.0, 6.0, 3.0], np.ascontiguousarray(faces[:, ::-1])


def open_place(*, seed: int = 1) -> Geometry:
    """Flat ground, a wall and a dozen balls above it."""
    rng = np.random.default_rng(seed)
    ground, faces = height_field(8, 10.0)
    walls = cube()[0] * [0.3, 6.0, 2.5] + [-2.5, 0.0, 1.25]
    parts: list[Geometry] = [(ground * [1.0, 1.0, 0.0], faces), (walls, cube()[1])]
    for _ in range(12):
        ball, around = subdivided(icosahedron(), 3, radius=rng.uniform(0.2, 0.8))
        parts.append((ball + rng.uniform([-4.0, -4.0, 0.9], [4.0, 4.0, 2.0]), around))
    return joined(parts)


def _measured(name: str, world: World, settings: BakeSettings, sets: int, points: int) -> SamplerScene:
    here = _places(world, settings, points)
    with create_tracer(world, settings, resolve(settings.device)) as tracer:
        seed = settings.seed
        halves = [
            _gather(tracer, here, scrambled_sobol(REFERENCE_RAYS, len(here.origin), (seed + which) % 2**32))
            for which in (1, 2)
        ]
        truth = (halves[0] + halves[1]) / 2.0
        curves: list[SamplerCurve] = []
        for sampler, make in POINT_SETS.items():
            for disc in ("concentric", "polar") if sampler in (JITTER, OURS) else ("concentric",):
                errors: list[float] = []
                for rays in RAYS:
                    made = make(rays, len(here.origin) * sets, seed)
                    wrong = _gather(tracer, here, made, disc=disc).reshape(len(truth), sets) - truth[:, None]
                    errors.append(math.sqrt(float(np.mean(wrong * wrong))))
                curves.append(SamplerCurve(sampler, disc, tuple(errors)))
    own = math.sqrt(float(np.mean((halves[0] - halves[1]) ** 2))) / 2.0
    return SamplerScene(name, curves, own, settings)


def _places(world: World, settings: BakeSettings, points: int) -> _Points:
    """Samples of the bake, drawn by area, that its back-face rule keeps."""
    placed = place_samples(world, settings)
    rng = np.random.default_rng(settings.seed)
    area = placed.area.astype(np.float64)
    drawn = placed.only(rng.choice(len(placed), min(8 * points, len(placed)), replace=False, p=area / area.sum()))
    valid = trace_samples(world, drawn, settings).valid(settings.back_face_threshold)
    chosen = drawn.only(np.flatnonzero(valid)[:points])
    rays = drawn_rays(world, chosen, slice(0, len(chosen)), 1)
    return _Points(rays.origins.astype(np.float32), rays.face_normals, _normals(world, chosen, rays.face_normals))


def _normals(world: World, samples: SampleSet, face_normals: Float64Array) -> Float64Array:
    first_two = samples.barycentric.astype(np.float64)
    weights = np.column_stack([first_two, 1.0 - first_two.sum(axis=1)])
    return geometry.shading_normals(world.normals[world.faces[samples.face]], weights, face_normals)


def _gather(tracer: Tracer, here: _Points, square: Float64Array, *, disc: str = "concentric") -> Float64Array:
    """AO by sets of points of the unit square, shape (p × sets, rays, 2), in the order of the places: (p × sets,)."""
    sets, rays, _ = square.shape
    each = sets // len(here.origin) * rays
    u, v = square.reshape(-1, 2).T
    x, y = geometry.concentric_disc(u, v) if disc == "concentric" else _polar_disc(u, v)
    z = np.sqrt(np.maximum(0.0, 1.0 - x * x - y * y))
    normal = np.repeat(here.normal, each, axis=0)
    tangent, bitangent = (np.repeat(axis, each, axis=0) for axis in geometry.frame(here.normal))
    direction = x[:, None] * tangent + y[:, None] * bitangent + z[:, None] * normal
    direction = geometry.above_face(direction, np.repeat(here.face_normal, each, axis=0))
    origin = np.repeat(here.origin, each, axis=0)
    distance = tracer.nearest(origin, direction.astype(np.float32), tracer.settings.trace_distance).distance
    return geometry.falloff(distance, tracer.settings.column_distances[0]).reshape(sets, rays).mean(axis=1)


def _polar_disc(u: Float64Array, v: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Unit square to unit disc by radius and angle: area-preserving, but torn along a radius and at the centre."""
    radius, angle = np.sqrt(u), 2.0 * math.pi * v
    return radius * np.cos(angle), radius * np.sin(angle)
