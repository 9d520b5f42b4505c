"""Injections that concern more than one place: wide shells, a wrong unit for the whole level, real objects turned."""

from __future__ import annotations

import dataclasses

import numpy as np

from bake.arrays import Float64Array
from bake.bench.bystanders import only_near
from bake.bench.cause_rounds import NEARBY, Round, Site, bake_round, make_round, put
from bake.bench.defects_of_placement import stand, wide_shell
from bake.bench.injection import Injection, Placed
from bake.bench.scaled import scaled
from bake.devices import resolve
from bake.explain.cause_names import CauseKind
from bake.explain.looks import look
from bake.explain.object_signs import shell_around
from bake.geometry import face_normals
from bake.scene import flatten
from bake.scene.orientation import agreement
from bake.trace import create_tracer
from bake.types import Mesh, Scene, SceneObject

SHELL_REACH = 11.0
"""Metres between wide shells, so that none touches another; in metres of the injection."""

ORIGIN = (0.0, 0.0, 0.0)
TURNED_AWAY = 4.0  # metres between turned objects


def shell_round(site: Site, places: Float64Array, random: np.random.Generator, most: int) -> Round | None:
    """A few wide shells, far from each other."""
    chosen = _apart(places[random.permutation(len(places))], SHELL_REACH * site.scale)[:most]
    if not len(chosen):
        return None
    return make_round(site, [wide_shell(random) for _ in chosen], chosen, random)


def unit_round(site: Site, places: Float64Array, random: np.random.Generator, most: int) -> Round | None:
    """Sound posts in the level, baked as if its unit were a small part of a metre."""
    chosen = places[random.permutation(len(places))][:most]
    if not len(chosen):
        return None
    scene, placed = put(site, [stand(random) for _ in chosen], chosen, random)
    world = flatten(scene, site.settings)
    longest = float(np.ptp(world.positions, axis=0).max())
    share = random.uniform(0.1, 0.5) * min(site.settings.distances) / longest
    small = [dataclasses.replace(item, spot=item.spot * share, scale=item.scale * share) for item in placed]
    return bake_round(scaled(scene, share), small, site.settings, scene, placed)


def turned_round(site: Site, random: np.random.Generator, most: int) -> Round | None:
    """Real closed objects of the level, their triangles turned round and their normals kept."""
    world = flatten(site.scene, site.settings)
    chosen: list[tuple[int, Float64Array, Float64Array]] = []
    with create_tracer(world, site.settings, resolve("cpu")) as tracer:
        for number in random.permutation(len(site.scene.objects)).tolist():
            if not _sound(site.scene, number):
                continue
            first, last = int(world.first_face[number]), int(world.first_face[number + 1])
            low = world.positions[world.first_vertex[number] : world.first_vertex[number + 1]]
            size = float(np.linalg.norm(np.ptp(low, axis=0)))
            middle = 0.5 * (low.min(axis=0) + low.max(axis=0))
            if not 0.4 * site.scale < size < 15.0 or any(
                np.linalg.norm(middle - other[1]) < TURNED_AWAY + size for other in chosen
            ):
                continue
            shell = shell_around(world, number, middle)
            if shell.closed < 0.97 or shell.inward > 0.3:
                continue
            faces = random.choice(np.arange(first, last), min(40, last - first), replace=False)
            points = world.positions[world.faces[faces]].mean(axis=1)
            normals = face_normals(world.positions, world.faces[faces])[0]
            longest = np.full(len(faces), size)
            seen = look(tracer, points, normals, np.full(len(faces), number), longest, 64)
            best = int(np.argmax(np.where(seen.from_behind < 0.1, seen.ao[:, 0], -1.0)))
            if seen.ao[best, 0] > 0.45 and seen.from_behind[best] < 0.1:
                chosen.append((number, points[best], normals[best]))
            if len(chosen) == most:
                break
    if not chosen:
        return None
    spots = np.array([point for _, point, _ in chosen]) + world.origin
    scene, placed = only_near(site.scene, spots, NEARBY * site.scale), list[Placed]()
    for number, point, normal in chosen:
        scene = _turned(scene, number)
        folder, _, name = scene.objects[number].path.rpartition("/")
        injection = Injection(CauseKind.AGAINST_FACE, "object of the level", {}, name, ORIGIN, ORIGIN)
        placed.append(Placed(injection, folder, point + world.origin, normal, site.scale))
    return bake_round(scene, placed, site.settings, site.scene, placed)


def _sound(scene: Scene, number: int) -> bool:
    """Whether an object is static, one-sided and wound as its normals say."""
    item = scene.objects[number]
    mesh = scene.meshes[item.mesh]
    if not item.role.casts_opaque or not item.role.receives_per_vertex or not 12 <= len(mesh.faces) <= 20_000:
        return False
    used: list[int] = np.unique(mesh.face_material).tolist()
    if any(scene.materials[index].two_sided for index in used):
        return False
    side = agreement(mesh.positions, mesh.normals, mesh.faces)
    return bool((side > 0.5).mean() > 0.97)


def _turned(scene: Scene, number: int) -> Scene:
    """The scene with the triangles of one object turned round."""
    item = scene.objects[number]
    mesh: Mesh = scene.meshes[item.mesh]
    other = dataclasses.replace(mesh, faces=np.ascontiguousarray(mesh.faces[:, ::-1]))
    objects: list[SceneObject] = list(scene.objects)
    objects[number] = dataclasses.replace(item, mesh=len(scene.meshes))
    return dataclasses.replace(scene, meshes=(*scene.meshes, other), objects=tuple(objects))


def _apart(points: Float64Array, distance: float) -> Float64Array:
    kept: list[Float64Array] = []
    for point in points:
        if all(np.linalg.norm(point - other) >= distance for other in kept):
            kept.append(point)
    return np.array(kept).reshape(-1, 3)
