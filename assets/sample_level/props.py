"""What lies and stands outdoors, much of it pushed into the ground and into each other."""

from __future__ import annotations

import numpy as np

from assets.sample_level.cells import SOLID, Block, surfaces
from assets.sample_level.level import Level, turned
from assets.sample_level.mesh import Part, Points, Solid, joined, shaded
from assets.sample_level.randomness import Random
from assets.sample_level.shapes import boulder, box, graded, icosphere, lattice, revolved, warped
from assets.sample_level.terrain import height_at


def add_props(level: Level) -> None:
    """Yard, boulders, fence and colonnade."""
    _yard(level)
    _boulders(level)
    _fence(level)
    _colonnade(level)
    level.place("Colonnade/Arch", (_arch(),), translation=(31.0, 0.8, -12.0))


def _yard(level: Level) -> None:
    """Crates and barrels by the end of the corridor, and a pile of planks."""
    crates = ((19.0, -1.0, 0.0, 10, 0, 0), (19.85, -0.7, -0.12, 41, 6, 3), (19.4, -0.9, 0.79, 27, 0, 0))
    crates += ((18.2, 5.6, -0.25, 60, 14, 9), (19.1, 6.1, -0.05, 15, 0, -4), (21.5, 3.4, -0.3, 33, 18, -12))
    for i, (x, z, y, yaw, pitch, roll) in enumerate(crates):
        rotation = turned(yaw, pitch, roll)
        level.place_shared(f"Yard/Crate_{i + 1:02}", "Shared/Crate", translation=(x, y, z), rotation=rotation)
    barrels = (
        (17.5, -2.2, -0.05, 0, 0),
        (18.3, -2.5, -0.05, 70, 0),
        (17.9, -3.2, -0.05, 31, 0),
        (20.6, 5.2, 0.3, 20, 90),
    )
    barrels += (
        (21.6, 0.4, -0.02, 5, 0),
        (16.9, 4.4, -0.04, 12, 0),
        (-9.5, 5.4, -0.05, 0, 0),
        (-9.6, 4.6, -0.05, 50, 0),
    )
    for i, (x, z, y, yaw, pitch) in enumerate(barrels):
        rotation = turned(yaw, pitch)
        level.place_shared(f"Yard/Barrel_{i + 1:02}", "Shared/Barrel", translation=(x, y, z), rotation=rotation)
    level.meshes["Shared/Plank"] = (shaded(box((-1.4, 0.0, -0.11), (1.4, 0.05, 0.11), 0.35, 0.2), "Boards"),)
    random = Random(501)
    for i in range(15):
        layer, place = divmod(i, 3)
        across = layer % 2 == 1
        shift = (place - 1) * (0.26 if across else 0.3) * (2.4 if across else 1.0)
        x, z = (20.9 + shift, -4.4) if across else (20.9, -4.4 + shift)
        yaw = (90.0 if across else 0.0) + random.number(-5, 5)
        # 2 mm less than a plank's thickness a layer: each lies a little inside the one below.
        where = (x + random.number(-0.15, 0.15), 0.002 + 0.048 * layer, z)
        level.place_shared(f"Yard/Planks/Plank_{i + 1:02}", "Shared/Plank", translation=where, rotation=turned(yaw))
    well = [
        (1.1, -0.4),
        (1.1, 0.0),
        (1.1, 0.2),
        (1.1, 0.45),
        (1.1, 0.75),
        (1.18, 0.75),
        (1.18, 0.9),
        (0.8, 0.9),
        (0.8, 0.6),
        (0.8, 0.3),
        (0.8, 0.0),
        (0.8, -0.35),
        (0.0, -0.35),
    ]
    parts = [shaded(revolved([(0.0, -0.4), *well], 32), "Stone", crease=45.0)]
    frame = [box((x - 0.07, 0.7, -0.07), (x + 0.07, 2.3, 0.07), 0.3, 0.15) for x in (-0.98, 0.98)]
    beam = box((-1.3, 2.2, -0.09), (1.3, 2.38, 0.09), 0.3, 0.15)
    parts.append(shaded(joined(*frame, beam), "Wood"))
    level.place("Yard/Well", tuple(parts), translation=(20.5, 0.0, 8.2), rotation=turned(20))


def _boulders(level: Level) -> None:
    """Three rocks placed many times, sunk into the slopes."""
    for i, (levels, size) in enumerate(((3, (1.6, 1.1, 1.3)), (3, (1.0, 0.9, 1.2)), (2, (0.6, 0.4, 0.5)))):
        level.meshes[f"Shared/Boulder_{i + 1}"] = (
            shaded(boulder(levels, size, 0.22, 70 + 3 * i), "Rock", crease=60.0),
        )
    random = Random(502)
    sites = ((-20, 20), (-17, 21), (-38, 4), (12, -26), (14, -25), (40, 6), (42, 8), (-22, -40), (-44, -30), (38, -32))
    sites += ((-28, -14), (-26.5, -13), (2, 30), (4, 31), (3, 29), (-8, 42), (36, 44), (50, -8), (-50, 24), (18, 18))
    for i, (x, z) in enumerate(sites):
        kind = 1 + i % 3
        scale = random.number(0.7, 1.5)
        sunk = height_at(x, z) + scale * random.number(0.15, 0.4)
        level.place_shared(
            f"Rocks/Boulder_{i + 1:02}",
            f"Shared/Boulder_{kind}",
            translation=(float(x), sunk, float(z)),
            rotation=turned(random.number(0, 360), random.number(-20, 20)),
            scale=(scale, scale * random.number(0.8, 1.1), scale),
        )


def _fence(level: Level) -> None:
    """Posts and rails along the western slope, each span tilted to the ground."""
    post = box((-0.07, -0.5, -0.07), (0.07, 1.15, 0.07), 0.4, 0.2)
    rails = [box((-0.05, y, -0.03), (2.45, y + 0.12, 0.03), 0.5, 0.25) for y in (0.45, 0.85)]
    level.meshes["Shared/FenceSpan"] = (shaded(joined(post, *rails), "Wood"),)
    for i in range(14):
        x, z = -16.0, -14.0 + 2.4 * i
        y, further = height_at(x, z), height_at(x, z + 2.4)
        roll = float(np.degrees(np.arctan2(further - y, 2.4)))
        level.place_shared(
            f"Fence/Span_{i + 1:02}", "Shared/FenceSpan", translation=(x, y, z), rotation=turned(-90.0, 0.0, roll)
        )


def _colonnade(level: Level) -> None:
    """Three steps, six columns with smooth shafts, a beam on each row, and a ball on a pedestal."""
    stages = [
        Block(SOLID, (-5.2 + 0.4 * i, 0.2 * i - 0.15, -4.0 + 0.4 * i), (5.2 - 0.4 * i, 0.2 * i + 0.05, 4.0 - 0.4 * i))
        for i in range(4)
    ]
    ground = Block(SOLID, (-5.2, -0.5, -4.0), (5.2, 0.05, 4.0))
    stages = joined(*surfaces([ground, *stages[1:]], "Outside", 0.7, 0.28).values())
    level.place("Colonnade/Steps", (shaded(stages, "Stone"),), translation=(31.0, 0.75, -20.0))
    level.meshes["Shared/Column"] = (_column(),)
    for i in range(6):
        x, z = 31.0 + (-3.4, 0.0, 3.4)[i % 3], -20.0 + (-2.3, 2.3)[i // 3]
        level.place_shared(
            f"Colonnade/Column_{i + 1}", "Shared/Column", translation=(x, 1.345, z), rotation=turned(17.0 * i)
        )
    beams = [box((-4.2, 0.0, z - 0.35), (4.2, 0.5, z + 0.35), 0.45, 0.15) for z in (-2.3, 2.3)]
    level.place("Colonnade/Beams", (shaded(joined(*beams), "Stone"),), translation=(31.0, 4.93, -20.0))
    level.place(
        "Colonnade/Pedestal",
        (shaded(box((-0.5, -0.02, -0.5), (0.5, 0.9, 0.5), 0.25, 0.1), "Stone"),),
        translation=(31.0, 1.35, -20.0),
    )
    ball = icosphere(3)
    ball = Solid(ball.positions * 0.55, ball.faces)
    level.place("Colonnade/Icosphere", (shaded(ball, "Stone", crease=80.0),), translation=(31.0, 2.76, -20.0))


def _column() -> Part:
    """3.6 m high: square base, swelling shaft, square head; the shaft ends inside both."""
    heights = graded(0.1, 3.4, 0.45, 0.1)
    shaft = [(0.34 - 0.07 * (y / 3.4) ** 1.6, float(y)) for y in heights]
    round_parts = revolved([(0.0, 0.1), *shaft, (0.0, 3.4)], 24)
    ring = revolved([(0.3, 0.17), (0.44, 0.17), (0.46, 0.24), (0.42, 0.31), (0.3, 0.31), (0.3, 0.17)], 24)
    base = box((-0.48, 0.0, -0.48), (0.48, 0.18, 0.48), 0.3, 0.12)
    head = [box((-0.34, 3.32, -0.34), (0.34, 3.42, 0.34), 0.3), box((-0.45, 3.41, -0.45), (0.45, 3.6, 0.45), 0.3, 0.15)]
    return shaded(joined(round_parts, ring, base, *head), "Stone", crease=45.0)


def _arch() -> Part:
    """A gateway 2 m wide and 3 m high under a round arch, 0.8 m thick."""
    bend = lattice(graded(0.0, 1.0, 0.05), graded(0.0, 1.0, 0.34), graded(-0.4, 0.4, 0.2))

    def around(points: Points) -> Points:
        angle, radius = np.pi * points[:, 0], 1.0 + 0.55 * points[:, 1]
        return np.stack([-radius * np.cos(angle), 2.0 + radius * np.sin(angle), points[:, 2]], axis=1)

    piers = [box((x0, -0.4, -0.4), (x0 + 0.55, 2.0, 0.4), 0.4, 0.15) for x0 in (-1.55, 1.0)]
    sills = [box((x0, 1.9, -0.46), (x0 + 0.67, 2.08, 0.46), 0.3, 0.15) for x0 in (-1.61, 0.94)]
    feet = [box((x0, -0.45, -0.5), (x0 + 0.75, 0.3, 0.5), 0.3, 0.15) for x0 in (-1.65, 0.9)]
    return shaded(joined(warped(bend, around), *piers, *sills, *feet), "Stone", crease=30.0)
