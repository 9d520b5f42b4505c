"""Free places on the ground of a real scene, where a benchmark may put something down."""

from __future__ import annotations

import numpy as np

from bake.arrays import BoolArray, Float64Array
from bake.geometry import cosine_direction, face_normals
from bake.low_discrepancy import owen_sobol
from bake.trace import Tracer
from bake.types import World

TRIES = 20_000
SOUND_RAYS = 64
MOST_BACKS = 0.1  # of what can be seen from a place
LEVEL = 0.95  # cosine against up of ground that counts as level


def free_places(
    world: World,
    tracer: Tracer,
    random: np.random.Generator,
    *,
    up_axis: int,
    radius: float,
    height: float,
    most: int,
) -> Float64Array:
    """Random places on level ground with room around them, shape (p, 3), metres from `World.origin`, p ≤ `most`.

    There is room where rays upwards are free up to `height` and rays all around, at a quarter and at half of it, up
    to `radius`, and where hardly a back shows. Places are at least two radii apart.
    """
    up = np.zeros(3)
    up[up_axis] = 1.0
    normals, area = face_normals(world.positions, world.faces)
    level = np.flatnonzero((normals @ up > LEVEL) & world.face_samples & world.face_casts)
    if not len(level):
        return np.zeros((0, 3))
    # half by area, half by face: otherwise everything would land on the largest plain
    weight = area[level] / area[level].sum() + 1.0 / len(level)
    chosen = random.choice(level, TRIES, p=weight / weight.sum())
    first, second = random.random((2, TRIES))
    root = np.sqrt(first)
    corners = world.positions[world.faces[chosen]]
    points = np.einsum("in,nij->nj", np.stack([1.0 - root, second * root, root * (1.0 - second)]), corners)
    angles = np.arange(12) * (2.0 * np.pi / 12)
    around = np.zeros((12, 3))
    around[:, (up_axis + 1) % 3], around[:, (up_axis + 2) % 3] = np.cos(angles), np.sin(angles)
    points = points[_free(tracer, points + 0.02 * height * up, up[None], height)]
    for share in (0.25, 0.5):
        points = points[_free(tracer, points + share * height * up, around, radius)]
    # solid ground all around: not at the edge of a roof or of the world
    rim = 0.7 * radius * around
    falls = _falls(tracer, points + 0.25 * height * up, rim, -up, 0.4 * height)
    points = points[falls]
    return _apart(points[_sound(tracer, points + 0.25 * height * up, up)], 2.0 * radius, most)


def _sound(tracer: Tracer, points: Float64Array, up: Float64Array) -> BoolArray:
    """Whether next to no backs can be seen: otherwise whatever is put there has invalid samples anyway."""
    number = np.arange(SOUND_RAYS)
    u, v = owen_sobol(number, np.full(SOUND_RAYS, 5, np.uint32))
    ways = cosine_direction(u, v, np.tile(up, (SOUND_RAYS, 1)))
    origins = np.repeat(points, SOUND_RAYS, axis=0).astype(np.float32)
    directions = np.ascontiguousarray(np.tile(ways, (len(points), 1)), np.float32)
    hits = tracer.nearest(np.ascontiguousarray(origins), directions, tracer.settings.trace_distance)
    struck = (hits.face >= 0).reshape(-1, SOUND_RAYS).sum(axis=1)
    backs = ((hits.face >= 0) & (hits.cosine > 0.0)).reshape(-1, SOUND_RAYS).sum(axis=1)
    return np.asarray(backs <= MOST_BACKS * struck)


def _free(tracer: Tracer, points: Float64Array, directions: Float64Array, reach: float) -> BoolArray:
    """Whether no ray meets anything, shape (n,)."""
    count = len(directions)
    origins = np.repeat(points, count, axis=0).astype(np.float32)
    ways = np.tile(directions, (len(points), 1)).astype(np.float32)
    hits = tracer.nearest(np.ascontiguousarray(origins), np.ascontiguousarray(ways), reach)
    return np.asarray((hits.face < 0).reshape(-1, count).all(axis=1))


def _falls(tracer: Tracer, points: Float64Array, rim: Float64Array, down: Float64Array, reach: float) -> BoolArray:
    """Whether all rays down around each point meet ground, shape (n,)."""
    count = len(rim)
    origins = (points[:, None] + rim).reshape(-1, 3).astype(np.float32)
    ways = np.tile(down, (len(origins), 1)).astype(np.float32)
    hits = tracer.nearest(np.ascontiguousarray(origins), np.ascontiguousarray(ways), reach)
    return np.asarray((hits.face >= 0).reshape(-1, count).all(axis=1))


def _apart(points: Float64Array, distance: float, most: int) -> Float64Array:
    kept: list[Float64Array] = []
    for point in points:
        if all(np.linalg.norm(point - other) >= distance for other in kept):
            kept.append(point)
            if len(kept) == most:
                break
    return np.array(kept).reshape(-1, 3)
