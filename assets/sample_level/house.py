"""The house: four rooms and a corridor that leads outside, with walls of real thickness.

Plan, x to the right, z downwards, metres; the corridor goes on to x = 15 and ends open:

        -9         -1           9
    -6  ┌───────────┬──────╲────┐
        │  RoomA    │ RoomC  ╲  │      a diagonal wall cuts the corner of RoomC off
     .5 ├────  ─────┼───  ───────┼─────── 15
        │  RoomB       Corridor             →
    2.9 │           ├──────  ────┼───────
     6  └───────────┴─RoomD──────┘
"""

from __future__ import annotations

import numpy as np

from assets.sample_level.cells import SOLID, Block, surfaces
from assets.sample_level.level import Level, turned
from assets.sample_level.mesh import Part, Points, Solid, faces_where, joined, merged, painted, shaded
from assets.sample_level.shapes import box, graded, graded_between, lattice, warped

FLOOR, CEILING, ROOF = 0.2, 3.0, 3.25

# Inner boxes of the spaces: x0, z0, x1, z1, ceiling.
ROOMS = {
    "RoomA": (-8.7, -5.7, -1.1, 0.4, CEILING),
    "RoomB": (-8.7, 0.6, -1.1, 5.7, CEILING),
    "RoomC": (-0.9, -5.7, 8.7, 0.4, CEILING),
    "RoomD": (-0.9, 3.0, 8.7, 5.7, CEILING),
    "Corridor": (-0.9, 0.6, 15.0, 2.8, 2.6),
}

# Openings: the space whose air they hold, x0, z0, x1, z1, sill and head.
DOORS = {
    ("RoomA", "Outside"): ("RoomA", -9.0, -3.4, -8.7, -2.2, FLOOR, 2.5),
    ("RoomA", "RoomB"): ("RoomA", -4.5, 0.4, -3.4, 0.6, FLOOR, 2.3),
    ("RoomA", "RoomC"): ("RoomA", -1.1, -4.6, -0.9, -3.5, FLOOR, 2.3),
    ("RoomB", "Corridor"): ("RoomB", -1.1, 1.15, -0.9, 2.25, FLOOR, 2.3),
    ("RoomC", "Corridor"): ("RoomC", 2.0, 0.4, 3.1, 0.6, FLOOR, 2.3),
    ("RoomD", "Corridor"): ("RoomD", 4.4, 2.8, 5.5, 3.0, FLOOR, 2.3),
}
WINDOWS = {
    "A_north_1": ("RoomA", -7.2, -6.0, -5.4, -5.7, 1.1, 2.3),
    "A_north_2": ("RoomA", -4.2, -6.0, -2.4, -5.7, 1.1, 2.3),
    "B_west": ("RoomB", -9.0, 2.4, -8.7, 3.9, 1.1, 2.3),
    "B_south": ("RoomB", -6.6, 5.7, -4.2, 6.0, 1.1, 2.3),
    "C_north": ("RoomC", 0.6, -6.0, 2.4, -5.7, 1.1, 2.3),
    "C_east": ("RoomC", 8.7, -1.5, 9.0, -0.3, 1.1, 2.3),
    "D_south": ("RoomD", 5.4, 5.7, 7.2, 6.0, 1.1, 2.3),
    "Corridor_south": ("Corridor", 11.2, 2.8, 12.6, 3.0, 1.1, 2.1),
}


def _blocks() -> list[Block]:
    blocks = [
        # What lies in the ground is a block of its own, for a line of vertices where the walls meet the ground.
        Block(SOLID, (-9.0, -0.25, -6.0), (9.0, 0.0, 6.0)),
        Block(SOLID, (-9.0, 0.0, -6.0), (9.0, ROOF, 6.0)),
        Block(SOLID, (9.0, -0.25, 0.4), (15.0, 0.0, 3.0)),
        Block(SOLID, (9.0, 0.0, 0.4), (15.0, 2.85, 3.0)),
    ]
    for name, (x0, z0, x1, z1, top) in ROOMS.items():
        blocks.append(Block(name, (x0, FLOOR, z0), (x1, top, z1)))
    for space, x0, z0, x1, z1, sill, head in [*DOORS.values(), *WINDOWS.values()]:
        blocks.append(Block(space, (x0, sill, z0), (x1, head, z1)))
    return blocks


def add_house(level: Level) -> None:
    """Rooms, facade, roof, diagonal wall, windows and the steps to the doors."""
    for (space, side), solid in surfaces(_blocks(), "Outside", 0.55, 0.2).items():
        if space == "Outside":
            if side == "walls":
                level.place("House/Exterior/Facade", painted(solid, "Stone", "Brick", 0.6))
            elif side == "floor":  # the main body's top lies under the roof and stays away
                corridor_top = faces_where(solid, lambda centre: centre[:, 0] > 9.0)
                level.place("House/Exterior/CorridorRoof", (shaded(corridor_top, "Tiles"),))
        elif side == "walls":
            level.place(f"House/{space}/Walls", painted(solid, "DarkWood", "Plaster", FLOOR + 0.14))
        else:
            floor = {"RoomB": "Paving", "Corridor": "Paving"}.get(space, "Boards")
            part = shaded(solid, floor if side == "floor" else "Plaster")
            level.place(f"House/{space}/{side.capitalize()}", (part,))
    _add_diagonal_wall(level)
    level.place("House/Exterior/Roof", _roof())
    chimney = joined(
        box((-8.5, 2.9, -1.2), (-7.7, 6.7, -0.2), 0.4, 0.2), box((-8.6, 6.6, -1.3), (-7.6, 6.82, -0.1), 0.3)
    )
    level.place("House/Exterior/Chimney", (shaded(chimney, "Brick"),))
    heights = np.array([-0.2, 0.0, 0.07])
    step = lattice(graded(-10.3, -8.98, 0.3, 0.15), heights, graded(-3.8, -1.8, 0.3, 0.15))
    level.place("House/Exterior/FrontStep", (shaded(step, "Stone"),))
    ramp = lattice(graded(14.98, 15.9, 0.3, 0.15), heights, graded(0.5, 2.9, 0.3, 0.15))
    level.place("House/Exterior/CorridorStep", (shaded(ramp, "Stone"),))
    for name, (_, x0, z0, x1, z1, sill, head) in WINDOWS.items():
        _add_window(level, name, (x0, z0, x1, z1), sill, head)


def _add_diagonal_wall(level: Level) -> None:
    """From the north wall to the east wall of RoomC, its ends inside them, its foot in the floor."""
    start, end = np.array([4.4, -5.85]), np.array([8.85, -2.2])
    length = float(np.hypot(*(end - start)))
    wall = lattice(
        graded(0.0, length, 0.5, 0.2), graded(FLOOR - 0.06, CEILING + 0.06, 0.5, 0.2), graded(-0.1, 0.1, 0.3)
    )
    yaw = float(np.degrees(np.arctan2(-(end - start)[1], (end - start)[0])))
    level.place(
        "House/RoomC/DiagonalWall",
        (shaded(wall, "Plaster"),),
        translation=(float(start[0]), 0.0, float(start[1])),
        rotation=turned(yaw),
    )


def _roof() -> tuple[Part, ...]:
    """A gable roof with eaves; its underside lies in the ceiling slab and is left out but for the eaves."""

    def gable(points: Points) -> Points:
        slope = 3.3 + (1.0 - np.abs(points[:, 2]) / 6.7) * 2.6
        return np.stack([points[:, 0], 3.1 + points[:, 1] * (slope - 3.1), points[:, 2]], axis=1)

    # Lines where the roof leaves the walls.
    xs = graded_between([-9.6, -9.0, 9.0, 9.6], 0.8, 0.3)
    zs = graded_between([-6.7, -6.0, 0.0, 6.0, 6.7], 0.7, 0.35)
    prism = lattice(xs, graded(0.0, 1.0, 0.34), zs)
    roof = faces_where(
        warped(prism, gable), lambda c: (c[:, 1] > 3.101) | (np.abs(c[:, 0]) > 9.0) | (np.abs(c[:, 2]) > 6.0)
    )
    return (shaded(roof, "Tiles", crease=15.0),)


def _add_window(level: Level, name: str, plan: tuple[float, float, float, float], sill: float, head: float) -> None:
    """A wooden frame with a cross, and a pane of glass in the middle of the wall."""
    x0, z0, x1, z1 = plan
    along_x = x1 - x0 > z1 - z0
    width, thick = (x1 - x0, z1 - z0) if along_x else (z1 - z0, x1 - x0)
    w, h, d, bar = width / 2, (head - sill) / 2, 0.035, 0.05
    bars = [
        box((-w - 0.01, -h - 0.01, -d), (-w + bar, h + 0.01, d), 0.4),
        box((w - bar, -h - 0.01, -d), (w + 0.01, h + 0.01, d), 0.4),
        box((-w + 0.02, -h - 0.006, -d + 0.004), (w - 0.02, -h + bar, d - 0.004), 0.4),
        box((-w + 0.02, h - bar, -d + 0.004), (w - 0.02, h + 0.006, d - 0.004), 0.4),
        box((-0.025, -h + 0.02, -d + 0.01), (0.025, h - 0.02, d - 0.01), 0.4),
        box((-w + 0.02, -0.02, -d + 0.014), (w - 0.02, 0.02, d - 0.014), 0.4),
        box((-w - 0.06, -h - 0.05, -thick / 2 - 0.06), (w + 0.06, -h + 0.01, -thick / 2 + 0.12), 0.3),
    ]
    pane = Solid(np.array([[-w, -h, 0.0], [w, -h, 0.0], [w, h, 0.0], [-w, h, 0.0]]), np.array([[0, 1, 2], [0, 2, 3]]))
    middle = ((x0 + x1) / 2, (sill + head) / 2, (z0 + z1) / 2)
    north_or_west = (z0 < -5.0) if along_x else (x0 < -5.0)
    yaw = (0.0 if north_or_west else 180.0) if along_x else (90.0 if north_or_west else 270.0)
    parts = merged(shaded(joined(*bars), "Linen"), shaded(pane, "Glass"))
    level.place(f"House/Windows/{name}", parts, translation=middle, rotation=turned(yaw))
