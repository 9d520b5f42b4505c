"""Dark spots that a level has by itself and that are right: where nothing was planted, nothing should be found."""

from __future__ import annotations

import numpy as np

from bake.bench.bystanders import only_near
from bake.bench.cause_rounds import NEARBY, Round, Site, bake_round
from bake.bench.injection import Injection, Placed
from bake.devices import resolve
from bake.explain.cause_names import CauseKind
from bake.explain.looks import look
from bake.geometry import face_normals
from bake.scene import flatten
from bake.trace import create_tracer

VARIANT = "of the level"
TRIES = 4000
RAYS = 64
DARK = 0.1, 0.4
"""AO at the shortest distance between which a spot counts as dark, yet not as closed in."""

APART = 0.5  # metres between spots


def level_round(site: Site, random: np.random.Generator, most: int) -> Round | None:
    """A bake of the level as it is, with up to `most` dark spots that can be seen, at random places of its surface.

    Those whose baked value is not what their rays see do not count as sound (`Round.manifest`).
    """
    world = flatten(site.scene, site.settings)
    normals, area = face_normals(world.positions, world.faces)
    receives = np.flatnonzero(world.face_samples & world.face_casts & (area > 0.0))
    if not len(receives):
        return None
    # half by area, half by face: large plains are seldom dark, small faces lie in corners
    weight = area[receives] / area[receives].sum() + 1.0 / len(receives)
    face = random.choice(receives, TRIES, p=weight / weight.sum())
    corners = world.positions[world.faces[face]]
    points = np.einsum("ni,nij->nj", random.dirichlet(np.ones(3), TRIES), corners)
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    owner = world.face_object[face].astype(np.int64)
    with create_tracer(world, site.settings, resolve("cpu")) as tracer:
        seen = look(tracer, points, normals[face], owner, longest, RAYS)
    ao, dark = seen.ao[:, 0], list[int]()
    for row in np.flatnonzero((ao > DARK[0]) & (ao < DARK[1]) & (seen.proof < 0.1)).tolist():
        if all(np.linalg.norm(points[row] - points[other]) > APART for other in dark):
            dark.append(row)
        if len(dark) == most:
            break
    if not dark:
        return None
    scene = only_near(site.scene, points[dark] + world.origin, NEARBY * site.scale)
    placed: list[Placed] = []
    for row in dark:
        folder, _, name = world.object_paths[int(owner[row])].rpartition("/")
        injection = Injection(CauseKind.CREVICE, VARIANT, {}, name, (0.0, 0.0, 0.0), (0.0, 1.0, 0.0))
        placed.append(Placed(injection, folder, points[row] + world.origin, normals[face[row]], site.scale))
    return bake_round(scene, placed, site.settings, scene, placed)
