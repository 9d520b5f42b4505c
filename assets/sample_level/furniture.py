"""What stands in the rooms. Everything is sunk a few millimetres into what it stands on, as placed by hand."""

from __future__ import annotations

from assets.sample_level.house import FLOOR
from assets.sample_level.level import Level, turned
from assets.sample_level.mesh import Part, Solid, joined, merged, shaded
from assets.sample_level.randomness import Random
from assets.sample_level.shapes import boulder, box, graded_between, lattice, revolved

SUNK = 0.004


def add_furniture(level: Level) -> None:
    """Furnishes the four rooms and the corridor."""
    _share(level)
    _living_room(level)
    _kitchen(level)
    _study(level)
    _store(level)
    _put(level, "Corridor/Bench", "Shared/Bench", 1.0, 1.05, 0.0)
    _put(level, "Corridor/Bench_far", "Shared/Bench", 11.9, 1.05, 0.0)
    _put(level, "Corridor/Barrel", "Shared/Barrel", 13.8, 2.42, 30.0)


def _put(level: Level, path: str, mesh: str, x: float, z: float, yaw: float, y: float = FLOOR - SUNK) -> None:
    level.place_shared(f"House/{path}", mesh, translation=(x, y, z), rotation=turned(yaw))


def _share(level: Level) -> None:
    """Meshes that several nodes show."""
    level.meshes |= {
        "Shared/Table": (_table(1.9, 0.95, 0.76),),
        "Shared/Chair": _chair(),
        "Shared/Bench": (_table(1.6, 0.42, 0.46),),
        "Shared/Shelf": _shelf(),
        "Shared/Barrel": barrel(),
        "Shared/Crate": (crate(),),
    }


def _legs(width: float, depth: float, height: float, thick: float) -> list[Solid]:
    x, z = width / 2 - thick, depth / 2 - thick
    return [
        box((sx * x - thick / 2, 0, sz * z - thick / 2), (sx * x + thick / 2, height, sz * z + thick / 2), 0.3, 0.12)
        for sx in (-1, 1)
        for sz in (-1, 1)
    ]


def _table(width: float, depth: float, height: float) -> Part:
    top = box((-width / 2, height - 0.05, -depth / 2), (width / 2, height, depth / 2), 0.3, 0.15)
    return shaded(joined(top, *_legs(width, depth, height - 0.03, 0.08)), "Wood")


def _chair() -> tuple[Part, ...]:
    frame = [
        *_legs(0.46, 0.46, 0.44, 0.045),
        box((-0.21, 0.42, 0.165), (-0.165, 0.98, 0.205), 0.25, 0.15),
        box((0.165, 0.42, 0.165), (0.21, 0.98, 0.205), 0.25, 0.15),
        box((-0.2, 0.84, 0.17), (0.2, 0.95, 0.2), 0.2),
        box((-0.2, 0.62, 0.172), (0.2, 0.7, 0.198), 0.2),
    ]
    seat = box((-0.23, 0.43, -0.23), (0.23, 0.47, 0.23), 0.16)
    return merged(shaded(joined(*frame), "DarkWood"), shaded(seat, "Fabric"))


def _shelf() -> tuple[Part, ...]:
    """A book shelf 1.5 m wide and 2 m high with books of random height; its back is at z = 0."""
    random = Random(401)
    boards = [box((x, 0, 0.0), (x + 0.03, 2.0, 0.32), 0.35, 0.15) for x in (-0.75, 0.72)]
    boards.append(box((-0.74, 0.01, -0.005), (0.74, 1.99, 0.015), 0.35, 0.2))
    books: list[Solid] = []
    for level in range(5):
        y = 0.06 + 0.47 * level
        boards.append(box((-0.735, y, 0.0), (0.735, y + 0.03, 0.31), 0.35, 0.15))
        x = -0.7
        while level < 4 and x < 0.6:
            thick, high, deep = random.number(0.04, 0.09), random.number(0.24, 0.36), random.number(0.18, 0.26)
            books.append(box((x, y + 0.028, 0.013), (x + thick, y + 0.03 + high, deep), 0.4))
            x += thick + (random.number(0.1, 0.35) if random.number(0, 1) > 0.75 else 0.002)
    return merged(shaded(joined(*boards), "Wood"), shaded(joined(*books), "Fabric"))


def barrel() -> tuple[Part, ...]:
    """A cask 0.9 m high; its iron hoops stand proud of the staves, what would lie inside these is left out."""
    staves = [(0.0, 0.03), (0.26, 0.03), (0.27, 0.0), (0.3, 0.0), (0.345, 0.2), (0.36, 0.45), (0.345, 0.7)]
    staves += [(0.3, 0.9), (0.27, 0.9), (0.27, 0.86), (0.12, 0.86), (0.0, 0.86)]
    hoops = [
        revolved([(r - 0.015, y), (r, y), (r, y + 0.05), (r - 0.015, y + 0.05)], 18)
        for r, y in ((0.34, 0.12), (0.368, 0.33), (0.368, 0.52), (0.34, 0.73))
    ]
    return merged(shaded(revolved(staves, 18), "Wood", crease=45.0), shaded(joined(*hoops), "Iron", crease=45.0))


def crate() -> Part:
    """A cubic box, 0.8 m, its sides sunk between the edge boards."""
    # Lines where the boards end.
    across = graded_between([-0.37, -0.29, 0.29, 0.37], 0.2, 0.12)
    inner = lattice(across, graded_between([0.03, 0.122, 0.678, 0.77], 0.2, 0.12), across)
    posts = [
        box((x - 0.055, 0.0, z - 0.055), (x + 0.055, 0.8, z + 0.055), 0.3, 0.2)
        for x in (-0.345, 0.345)
        for z in (-0.345, 0.345)
    ]
    rails: list[Solid] = []
    for y in (0.012, 0.678):
        for s in (-0.343, 0.343):
            rails.append(box((-0.34, y, s - 0.052), (0.34, y + 0.11, s + 0.052), 0.35, 0.25))
            rails.append(box((s - 0.052, y + 0.004, -0.34), (s + 0.052, y + 0.106, 0.34), 0.35, 0.25))
    return shaded(joined(inner, *posts, *rails), "Boards")


def _living_room(level: Level) -> None:
    _put(level, "RoomA/Table", "Shared/Table", -4.6, -2.2, 8.0)
    for i, (x, z, yaw) in enumerate(
        ((-5.1, -3.0, 186.0), (-4.0, -2.85, 170.0), (-5.15, -1.45, 2.0), (-3.9, -1.6, 24.0))
    ):
        _put(level, f"RoomA/Chair_{i + 1}", "Shared/Chair", x, z, yaw)
    seat = box((-1.1, 0.12, -0.42), (1.1, 0.42, 0.42), 0.25, 0.1)
    back = [box((-1.1, 0.1, -0.44), (1.1, 0.86, -0.2), 0.25, 0.1)]
    back += [box((x, 0.0, -0.43), (x + 0.22, 0.62, 0.44), 0.25, 0.1) for x in (-1.16, 0.94)]
    sofa = (shaded(joined(seat, *back), "Fabric"),)
    level.place("House/RoomA/Sofa", sofa, translation=(-3.2, FLOOR - SUNK, -5.2), rotation=turned(0.0))
    rug = (shaded(box((-1.5, -0.01, -1.1), (1.5, 0.015, 1.1), 0.3, 0.15), "Linen"),)
    level.place("House/RoomA/Rug", rug, translation=(-4.6, FLOOR, -2.2), rotation=turned(4.0))
    _put(level, "RoomA/Bookshelf", "Shared/Shelf", -1.09, -1.3, -90.0)
    hearth = [
        box((-8.75, FLOOR - 0.05, -1.7), (-7.95, 1.3, -1.25), 0.3, 0.12),
        box((-8.75, FLOOR - 0.05, -0.25), (-7.95, 1.3, 0.2), 0.3, 0.12),
        box((-8.75, 1.05, -1.69), (-7.96, CEILING_TOP, 0.19), 0.35, 0.12),
        box((-8.74, 1.26, -1.85), (-7.82, 1.36, 0.35), 0.3, 0.12),
        box((-8.74, FLOOR - 0.05, -1.8), (-7.5, FLOOR + 0.06, 0.3), 0.25, 0.12),
    ]
    level.place("House/RoomA/Fireplace", (shaded(joined(*hearth), "Stone"),))


CEILING_TOP = 3.04


def _kitchen(level: Level) -> None:
    low = [
        box((-8.75, FLOOR - 0.02, 5.08), (-3.0, FLOOR + 0.88, 5.75), 0.3, 0.12),
        box((-8.74, FLOOR + 0.86, 5.02), (-2.95, FLOOR + 0.92, 5.74), 0.3, 0.15),
    ]
    high = box((-8.73, 1.65, 5.36), (-6.95, 2.4, 5.74), 0.3, 0.12)
    level.place("House/RoomB/Kitchen", merged(shaded(joined(low[0], high), "Wood"), shaded(low[1], "Stone")))
    _put(level, "RoomB/Table", "Shared/Table", -6.2, 2.6, 90.0)
    _put(level, "RoomB/Chair_1", "Shared/Chair", -5.4, 2.3, 95.0)
    _put(level, "RoomB/Chair_2", "Shared/Chair", -7.0, 2.9, 268.0)
    pot = revolved([(0, 0), (0.14, 0), (0.17, 0.06), (0.17, 0.2), (0.15, 0.2), (0.15, 0.05), (0.0, 0.03)], 20)
    level.place("House/RoomB/Pot", (shaded(pot, "Iron", crease=50.0),), translation=(-6.1, FLOOR + 0.75, 2.3))


def _study(level: Level) -> None:
    bed = [
        box((-0.5, 0.18, -1.0), (0.5, 0.34, 1.0), 0.25, 0.12),
        box((-0.53, 0.0, -1.06), (0.53, 0.95, -0.98), 0.25, 0.12),
        box((-0.53, 0.0, 0.98), (0.53, 0.6, 1.05), 0.25, 0.12),
    ]
    soft = [box((-0.48, 0.32, -0.99), (0.48, 0.5, 0.99), 0.2, 0.1), box((-0.36, 0.47, -0.92), (0.36, 0.6, -0.52), 0.15)]
    parts = merged(shaded(joined(*bed), "DarkWood"), shaded(joined(*soft), "Linen"))
    level.place("House/RoomC/Bed", parts, translation=(2.9, FLOOR - SUNK, -4.62))
    wardrobe = joined(
        box((-0.8, 0.0, -0.3), (0.8, 2.1, 0.3), 0.3, 0.12), box((-0.84, 2.06, -0.33), (0.84, 2.16, 0.33), 0.4)
    )
    level.place("House/RoomC/Wardrobe", (shaded(wardrobe, "Wood"),), translation=(5.2, FLOOR - SUNK, 0.085))
    _put(level, "RoomC/Desk", "Shared/Table", 8.2, -1.0, 90.0)
    _put(level, "RoomC/Chair", "Shared/Chair", 7.5, -0.9, 262.0)
    _put(level, "RoomC/Bookshelf", "Shared/Shelf", -0.91, -1.2, 90.0)
    globe = boulder(3, (0.16, 0.16, 0.16), 0.0, 3).moved(0.0, 0.2, 0.0)
    foot = revolved([(0, 0), (0.1, 0), (0.02, 0.03), (0.02, 0.08), (0.0, 0.08)], 16)
    globe_parts = merged(shaded(globe, "Fabric", crease=80.0), shaded(foot, "Wood", crease=50.0))
    level.place("House/RoomC/Globe", globe_parts, translation=(8.3, FLOOR + 0.75, -0.5))


def _store(level: Level) -> None:
    for i, (x, z, yaw) in enumerate(((0.0, 5.2, 3.0), (0.9, 5.22, -6.0), (-0.35, 4.2, 12.0), (8.2, 3.5, 5.0))):
        _put(level, f"RoomD/Crate_{i + 1}", "Shared/Crate", x, z, yaw)
    _put(level, "RoomD/Crate_5", "Shared/Crate", 0.4, 5.18, 17.0, FLOOR + 0.785)
    for i, (x, z) in enumerate(((8.25, 5.25), (7.45, 5.3), (7.9, 4.6))):
        _put(level, f"RoomD/Barrel_{i + 1}", "Shared/Barrel", x, z, 40.0 * i)
    _put(level, "RoomD/Shelf", "Shared/Shelf", 3.0, 5.71, 180.0)
    random = Random(402)
    for i in range(4):
        sack = boulder(2, (0.34, 0.26, 0.28), 0.12, 60 + i)
        place = (2.0 + 0.55 * i, FLOOR + 0.2 + 0.02 * random.number(0, 1), 3.4 + 0.1 * (i % 2))
        level.place(f"House/RoomD/Sack_{i + 1}", (shaded(sack, "Linen", crease=80.0),), translation=place)
