"""Escapes that a bake doubts, because hardly a ray escaped before them, are those that a rebake doubts."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from bake.pipeline import open_tracer
from bake.rebake.session import RebakeSession
from bake.types import Material, Mesh, Role, Scene
from tests.rebake.small_scene import ALONE, CPU, baked, drained, mesh, placed
from tests.worlds import quad

SETTINGS = ALONE.replaced(samples_per_face=(1, 1))
NUDGE = 1e-5
AWAY = 5.0


def plate(origin: np.ndarray, direction: np.ndarray, along: np.ndarray, first: float, last: float) -> Mesh:
    """A plate across a ray, 5 m off, that begins and ends at some metres along a direction square to the ray."""
    across = np.cross(direction, along)
    middle = origin + AWAY * direction
    corners = [middle + a * along + b * across for a, b in ((first, -0.05), (last, -0.05), (last, 0.05), (first, 0.05))]
    return mesh("plate", np.array(corners), np.array([[0, 1, 2], [0, 2, 3]]))


def covered() -> Scene:
    """A floor of which one sample's first four rays meet a plate each; the fifth passes another by half a nudge."""
    ground = placed("floor", 0, 0.0, 0.0, 0.0)
    floor = Scene(Path("/nowhere/floor.glb"), (mesh("floor", *quad(1.0)),), (Material("plain"),), (ground,), up_axis=1)
    result = baked(floor, SETTINGS)
    with drained(open_tracer(result.world, SETTINGS, CPU, None))[0] as tracer:
        rays = tracer.record(result.samples.only(np.zeros(1, np.int64)))
    origin = rays.origin[0].astype(np.float64) + result.world.origin
    plates: list[Mesh] = []
    for number, ray in enumerate(rays.direction[0, :5].astype(np.float64)):
        ray /= np.linalg.norm(ray)
        side = np.cross(ray, np.eye(3)[0 if abs(ray[0]) < 0.5 else 1])  # where `closest.nudged` turns it
        first = 0.5 * NUDGE * AWAY if number == 4 else -0.05
        plates.append(plate(origin, ray, side / np.linalg.norm(side), first, 0.05))
    objects = [placed(f"plate {i}", i + 1, 0.0, 0.0, 0.0, Role.BLOCKER) for i in range(5)]
    return dataclasses.replace(floor, meshes=(*floor.meshes, *plates), objects=(ground, *objects))


def test_a_ray_that_newly_escapes_ends_the_doubts() -> None:
    """Without the second plate the fifth ray's escape is believed, though nothing in its way changed; and back."""
    full = covered()
    less = dataclasses.replace(full, objects=tuple(item for item in full.objects if item.path != "plate 1"))
    before, after = baked(full, SETTINGS), baked(less, SETTINGS)
    assert before.tally.hits[0] - after.tally.hits[0] == 2
    with RebakeSession(before, full, CPU) as session:
        for scene, whole in ((less, after), (full, before)):
            result = drained(session.rebake(scene, SETTINGS)).result
            np.testing.assert_array_equal(result.tally.hits, whole.tally.hits)
            np.testing.assert_allclose(result.tally.ao, whole.tally.ao, atol=1e-6)
            np.testing.assert_allclose(result.field.ao, whole.field.ao, atol=1e-3)
