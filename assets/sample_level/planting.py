"""Where the plants stand: 14 trees, 80 shrubs and 400 clumps of grass, all on the ground."""

from __future__ import annotations

import numpy as np

from assets.sample_level import plants
from assets.sample_level.level import Instances, Level, Node, turned
from assets.sample_level.mesh import Points
from assets.sample_level.randomness import Random
from assets.sample_level.terrain import height_at, surface_height

OAKS = ((-24, 16), (-34, 23), (-21, 31), (7, 23), (9, -16), (-6, -19), (44, 2), (-41, -5))
PINES = ((-12, -34), (-4, -41), (5, -36), (-19, -47), (42, -44), (51, -37))

# Kept free of scattered plants: x0, z0, x1, z1.
_BUILT = ((-10.8, -7.2, 24.5, 9.8), (-34.5, -26.5, -25.0, -17.5), (25.0, -25.5, 37.0, -10.5), (19.0, 25.0, 49.5, 35.5))


def add_plants(level: Level) -> None:
    """Everything that grows."""
    _trees(level)
    _shrubs(level)
    _grass(level)


def _trees(level: Level) -> None:
    level.meshes["Shared/Oak"] = plants.oak()
    level.meshes["Shared/Pine"] = plants.pine()
    random = Random(701)
    for name, mesh, places in (("oak", "Shared/Oak", OAKS), ("pine", "Shared/Pine", PINES)):
        # Oaks say in the file what they are; pines are left to the side file.
        extras = {"obscura": {"role": "tree"}} if name == "oak" else {}
        for i, (x, z) in enumerate(places):
            size = random.number(0.8, 1.3)
            mirrored = -1.0 if (name, i) == ("pine", 3) else 1.0
            level.place_shared(
                f"Trees/{name}_{i + 1:02}",
                mesh,
                translation=(float(x), height_at(x, z), float(z)),
                rotation=turned(random.number(0, 360), random.number(-3, 3)),
                scale=(mirrored * size, size * random.number(0.9, 1.15), size),
                extras=extras,
            )


def _shrubs(level: Level) -> None:
    """Two hedges whose shrubs overlap, and bushes here and there."""
    for kind in (0, 1):
        level.meshes[f"Shared/Shrub_{kind + 1}"] = plants.shrub(kind)
    random = Random(702)
    hedges = [(-13.0, -12.5 + 0.62 * i) for i in range(18)] + [(-8.0 + 0.66 * i, 9.6) for i in range(18)]
    scattered = _free_places(random, 44, 54.0)
    for i, (x, z) in enumerate([*hedges, *scattered.tolist()]):
        in_hedge = i < len(hedges)
        size = random.number(0.9, 1.15) if in_hedge else random.number(0.8, 1.6)
        name = f"hedge_{i + 1:02}" if in_hedge else f"bush_{i + 1 - len(hedges):02}"
        level.place_shared(
            f"Shrubs/{name}",
            "Shared/Shrub_1" if in_hedge or i % 2 else "Shared/Shrub_2",
            translation=(x, height_at(x, z), z),
            rotation=turned(random.number(0, 360)),
            scale=(size, size * random.number(0.85, 1.15), size),
        )


def _grass(level: Level) -> None:
    """One node with 400 instances."""
    level.meshes["Shared/GrassClump"] = plants.grass()
    random = Random(703)
    places = _free_places(random, 400, 40.0, crowd=6)
    heights = surface_height(places[:, 0], places[:, 1])
    yaw = np.radians(random.uniform(0, 360, 400)) / 2
    zero = np.zeros(400)
    size = random.uniform(0.7, 1.5, 400)
    level.group("Grass").add(
        Node(
            "clump",
            "Shared/GrassClump",
            instances=Instances(
                np.stack([places[:, 0], heights, places[:, 1]], axis=1),
                np.stack([zero, np.sin(yaw), zero, np.cos(yaw)], axis=1),
                np.stack([size, size * random.uniform(0.8, 1.2, 400), size], axis=1),
            ),
            extras={"obscura": {"role": "small"}},
        )
    )


def _free_places(random: Random, count: int, reach: float, *, crowd: int = 1) -> Points:
    """Places x, z off the buildings, shape (count, 2), in groups of about `crowd`."""
    seeds = random.uniform(-reach, reach, 4 * count, 2)
    around = random.uniform(-2.2, 2.2, 4 * count, 2) * (crowd > 1)
    places = seeds[np.arange(4 * count) // crowd] + around
    free = np.ones(len(places), bool)
    for x0, z0, x1, z1 in _BUILT:
        free &= (places[:, 0] < x0) | (places[:, 0] > x1) | (places[:, 1] < z0) | (places[:, 1] > z1)
    return places[free][:count]
