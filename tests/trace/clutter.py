"""A world of everything that rays can meet, for parity tests."""

from __future__ import annotations

import numpy as np

from bake.types import ObjectKeys, World
from tests.worlds import box, icosphere, make_world, quad


def clutter(seed: int, count: int = 12) -> World:
    """Overlapping, partly open, partly two-sided boxes and spheres over a floor: soup, as levels are."""
    rng = np.random.default_rng(seed)
    objects = [quad(12.0)]
    for i in range(count):
        centre = rng.uniform(-4, 4, 3) * [1, 0.4, 1]
        shape = box(tuple(rng.uniform(0.5, 3, 3))) if i % 2 else icosphere(1, rng.uniform(0.4, 1.5))
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        turn *= np.sign(np.linalg.det(turn))
        objects.append((shape[0] @ turn.T + centre, shape[1]))
    count = sum(len(f) for _, f in objects)
    positions = np.concatenate([p for p, _ in objects])
    normals = rng.normal(size=positions.shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    normals[::3] = 0.0
    return make_world(
        *objects,
        normals=normals,
        two_sided=rng.random(count) < 0.2,
        openness=np.where(rng.random(count) < 0.3, rng.random(count), 0.0),
        casts=rng.random(count) < 0.9,
        keys=tuple(ObjectKeys(offset=0.01 if i % 4 == 0 else None) for i in range(len(objects))),
    )
