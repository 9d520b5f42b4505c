"""Spots that are rightly dark, with random measures: nothing is wrong with them, and nobody should be told otherwise.

Lengths are metres from the middle of the top of a plinth, y up; see `bake.bench.injection`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bake.bench.injection import Injection, Prop
from bake.bench.shapes import Solid, block, joined, lattice, plinth, revolved, shaded, steps
from bake.explain.cause_names import CauseKind

Random = np.random.Generator


def gap(random: Random) -> Injection:
    """Two blocks a hand's breadth apart."""
    half, high, step = random.uniform(0.02, 0.05), random.uniform(0.5, 0.9), random.uniform(0.08, 0.14)
    ys, zs = steps(-0.01, high, step), steps(-0.5, 0.5, step)
    left = lattice(steps(-0.55, -half, step), ys, zs)
    right = lattice(steps(half, 0.55, step), ys, zs)
    spot = (half, random.uniform(0.3, 0.6) * high, random.uniform(-0.2, 0.2))
    return _sound("gap", {"Blocks": joined(left, right)}, "Blocks", spot, (-1.0, 0.0, 0.0))


def niche(random: Random) -> Injection:
    """A hole in a thick block."""
    wide, low, high, deep = (random.uniform(*ends) for ends in ((0.08, 0.16), (0.25, 0.35), (0.5, 0.65), (0.25, 0.4)))
    lines = steps(-0.5, 0.5, 0.1), steps(-0.01, 0.9, 0.1)
    whole = _pierced(lines[0], lines[1], wide, low, high)
    inner = lattice(steps(-wide, wide, 0.05), steps(low, high, 0.05), steps(-deep, 0.0, 0.07))
    inner = _without_side(inner, 2, 0.0).flipped()
    back = block((-0.5, -0.01, -0.6), (0.5, 0.9, 0.0), 0.1)
    back = _without_side(back, 2, 0.0)
    spot = (random.uniform(-0.5, 0.5) * wide, 0.5 * (low + high), -deep)
    return _sound("niche", {"Block": joined(whole, back, inner)}, "Block", spot, (0.0, 0.0, 1.0))


def under_a_table(random: Random) -> Injection:
    """The ground under a low table, near a leg."""
    low = random.uniform(0.12, 0.22)
    slab = block((-0.7, -0.01, -0.7), (0.7, 0.06, 0.7), 0.1)
    top = block((-0.6, 0.06 + low, -0.6), (0.6, 0.12 + low, 0.6), 0.12)
    legs = [block((x, 0.05, z), (x + 0.08, 0.06 + low, z + 0.08), 0.06) for x in (-0.55, 0.45) for z in (-0.55, 0.45)]
    spot = (random.uniform(-0.3, 0.3), 0.06, random.uniform(-0.3, 0.3))
    return _sound("under a table", {"Slab": slab, "Table": joined(top, *legs)}, "Slab", spot, (0.0, 1.0, 0.0))


def corner(random: Random) -> Injection:
    """The inner corner of two walls and a floor."""
    step, high = random.uniform(0.06, 0.1), random.uniform(0.8, 1.3)
    floor = block((-0.6, -0.01, -0.6), (0.6, 0.05, 0.6), step)
    walls = [block((-0.8, -0.01, -0.8), (-0.6, high, 0.6), step), block((-0.6, -0.01, -0.8), (0.6, high, -0.6), step)]
    near = random.uniform(0.02, 0.05)
    spot = (-0.6 + near, 0.05, -0.6 + random.uniform(0.02, 0.06))
    return _sound("corner", {"Floor": floor, "Walls": joined(*walls)}, "Floor", spot, (0.0, 1.0, 0.0))


def pipe_at_a_wall(random: Random) -> Injection:
    """A wall behind a thick pipe."""
    radius, away = random.uniform(0.1, 0.18), random.uniform(0.01, 0.04)
    wall = block((-0.6, -0.01, -0.2), (0.6, 1.1, 0.0), 0.08)
    pipe = revolved([(0.0, 0.0), *((radius, y) for y in steps(0.0, 1.2, 0.1)), (0.0, 1.2)], 24)
    pipe = pipe.moved(0.0, 0.005, radius + away)
    spot = (random.uniform(-0.3, 0.3) * radius, random.uniform(0.3, 0.8), 0.0)
    return _sound("pipe at a wall", {"Wall": wall, "Pipe": pipe}, "Wall", spot, (0.0, 0.0, 1.0))


def under_stairs(random: Random) -> Injection:
    """A step under a far overhang."""
    step = random.uniform(0.07, 0.1)
    low = block((-0.6, -0.01, -0.6), (0.6, 0.2, 0.6), step)
    over = random.uniform(0.1, 0.18)
    high = [block((-0.6, 0.2, -0.6), (0.6, 0.2 + over, -0.3), step)]
    high += [block((-0.6, 0.2 + over, -0.6), (0.6, 0.5 + over, 0.3), step)]
    spot = (random.uniform(-0.3, 0.3), 0.2, random.uniform(-0.25, -0.05))
    return _sound("overhang", {"Step": low, "Stairs": joined(*high)}, "Step", spot, (0.0, 1.0, 0.0))


def tray(random: Random) -> Injection:
    """The bottom of a deep narrow box, open above."""
    wide, deep, thick = random.uniform(0.08, 0.15), random.uniform(0.35, 0.6), 0.05
    outer = block((-wide - thick, 0.0, -wide - thick), (wide + thick, deep + thick, wide + thick), 0.08)
    outer = _without_side(outer, 1, deep + thick)
    inner = lattice(steps(-wide, wide, 0.05), steps(thick, deep + thick, 0.06), steps(-wide, wide, 0.05))
    inner = _without_side(inner, 1, deep + thick).flipped()
    rim = _rim(wide, wide + thick, deep + thick)
    spot = (random.uniform(-0.6, 0.6) * wide, thick, random.uniform(-0.6, 0.6) * wide)
    return _sound("tray", {"Tray": joined(outer, inner, rim)}, "Tray", spot, (0.0, 1.0, 0.0))


def drum_on_ground(random: Random) -> Injection:
    """The line of contact of a lying drum and the ground."""
    radius, sides = random.uniform(0.2, 0.35), int(random.integers(24, 40))
    drum = revolved([(0.0, -0.5), *((radius, y) for y in steps(-0.5, 0.5, 0.1)), (0.0, 0.5)], sides)
    lying = Solid(drum.positions[:, [1, 2, 0]], drum.faces).moved(0.0, radius + 0.064, 0.0)
    slab = block((-0.7, -0.01, -0.7), (0.7, 0.06, 0.7), 0.06)
    spot = (random.uniform(-0.3, 0.3), 0.06, random.uniform(0.03, 0.07))
    return _sound("drum on the ground", {"Slab": slab, "Drum": lying}, "Slab", spot, (0.0, 1.0, 0.0))


def pile(random: Random) -> Injection:
    """Crates heaped on each other, partly in each other, as levels have them."""
    crates: list[Solid] = []
    for _ in range(int(random.integers(5, 9))):
        half = random.uniform(0.12, 0.25, 3)
        crate = block(tuple(-half), tuple(half), 0.06)
        turn, tilt = random.uniform(0.0, np.pi), random.uniform(-0.3, 0.3)
        about_y = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
        about_x = np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
        place = np.append(random.uniform(-0.3, 0.3, 2), random.uniform(0.1, 0.6))[[0, 2, 1]]
        crates.append(Solid(crate.positions @ (about_y @ about_x).T + place, crate.faces))
    chosen = crates[0]
    middles = chosen.positions[chosen.faces].mean(axis=1)
    face = int(random.choice(np.flatnonzero(middles[:, 1] > 0.02)))
    a, b, c = chosen.positions[chosen.faces[face]]
    normal = np.cross(b - a, c - a)
    x, y, z = middles[face].tolist()
    up, out, along = (normal / np.linalg.norm(normal)).tolist()
    return _sound(
        "pile of crates", {"First": chosen, "Others": joined(*crates[1:])}, "First", (x, y, z), (up, out, along)
    )


def _sound(
    variant: str,
    solids: dict[str, Solid],
    dark: str,
    spot: tuple[float, float, float],
    normal: tuple[float, float, float],
) -> Injection:
    props = {name: Prop(shaded(solid)) for name, solid in solids.items()}
    return Injection(CauseKind.CREVICE, variant, {"Plinth": Prop(plinth()), **props}, dark, spot, normal)


def _without_side(solid: Solid, axis: int, place: float) -> Solid:
    """Without the faces of one side of a box."""
    on_side = (np.abs(solid.positions[solid.faces][:, :, axis] - place) < 1e-9).all(axis=1)
    return Solid(solid.positions, solid.faces[~on_side])


def _pierced(xs: np.ndarray, ys: np.ndarray, wide: float, low: float, high: float) -> Solid:
    """The rectangle over `xs` and `ys` at z = 0, showing to +z, with a hole."""
    columns = np.unique(np.concatenate([xs[np.abs(xs) > wide + 0.02], [-wide, wide], steps(-wide, wide, 0.05)]))
    rows = np.unique(np.concatenate([ys[(ys < low - 0.02) | (ys > high + 0.02)], steps(low, high, 0.05)]))
    solid = lattice(columns, rows, [-0.1, 0.0])
    middle = solid.positions[solid.faces].mean(axis=1)
    front = (np.abs(solid.positions[solid.faces][:, :, 2]) < 1e-9).all(axis=1)
    hole = (np.abs(middle[:, 0]) < wide) & (middle[:, 1] > low) & (middle[:, 1] < high)
    return Solid(solid.positions, solid.faces[front & ~hole])


def _rim(inner: float, outer: float, height: float) -> Solid:
    """The upper edge of a box that is open above."""
    edges = [-outer, *steps(-inner, inner, 0.05), outer]
    top = lattice(edges, [height - 0.01, height], edges)
    middle = top.positions[top.faces].mean(axis=1)
    up = (np.abs(top.positions[top.faces][:, :, 1] - height) < 1e-9).all(axis=1)
    hole = (np.abs(middle[:, 0]) < inner) & (np.abs(middle[:, 2]) < inner)
    return Solid(top.positions, top.faces[up & ~hole])


SOUND: tuple[Callable[[Random], Injection], ...] = (
    gap,
    niche,
    under_a_table,
    corner,
    pipe_at_a_wall,
    under_stairs,
    tray,
    drum_on_ground,
    pile,
)
