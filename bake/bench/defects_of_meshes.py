"""Defects of a mesh or its keys, with random measures: normals, winding, slivers, seams, lack of samples, offsets.

Each is wrong in exactly one way. Lengths are metres from the middle of the top of a plinth, y up; see
`bake.bench.injection`.
"""

from __future__ import annotations

import numpy as np

from bake.bench.injection import Injection, Prop
from bake.bench.shapes import (
    Shaded,
    Solid,
    ball,
    block,
    joined,
    lattice,
    plinth,
    revolved,
    shaded,
    steps,
    with_normal,
)
from bake.explain.cause_names import CauseKind

Random = np.random.Generator


def leaning_normals(random: Random) -> Injection:
    """A slab whose upper normals lean towards a wall."""
    lean, high = np.radians(random.uniform(72.0, 86.0)), random.uniform(0.9, 1.5)
    slab = shaded(block((-0.7, -0.01, -0.5), (0.7, 0.12, 0.7), random.uniform(0.12, 0.2)))
    top = slab.normals[:, 1:2] > 0.9
    normals = np.where(top, np.array([0.0, np.cos(lean), -np.sin(lean)]), slab.normals).astype(np.float32)
    wall = block((-0.75, -0.01, -0.75), (0.75, high, -0.5), 0.2)
    return Injection(
        CauseKind.BELOW_PLANE,
        "slab before a wall",
        {
            "Plinth": Prop(plinth()),
            "Slab": Prop(Shaded(slab.positions, normals, slab.faces)),
            "Wall": Prop(shaded(wall)),
        },
        "Slab",
        (random.uniform(-0.4, 0.4), 0.12, random.uniform(-0.2, 0.2)),
        (0.0, 1.0, 0.0),
        {"Slab": {"normals": "faces"}},
    )


def leaning_side(random: Random) -> Injection:
    """A post whose side normals point down, as after a bad transfer of normals."""
    half, high = random.uniform(0.2, 0.3), random.uniform(0.6, 0.9)
    lean = np.radians(random.uniform(72.0, 86.0))
    post = shaded(block((-half, -0.01, -half), (half, high, half), random.uniform(0.1, 0.2)))
    side = np.abs(post.normals[:, 1:2]) < 0.1
    down = np.cos(lean) * post.normals + np.sin(lean) * np.array([0.0, -1.0, 0.0])
    normals = np.where(side, down, post.normals).astype(np.float32)
    return Injection(
        CauseKind.BELOW_PLANE,
        "normals of a post point down",
        {"Plinth": Prop(plinth()), "Post": Prop(Shaded(post.positions, normals, post.faces))},
        "Post",
        (half, high * random.uniform(0.2, 0.5), random.uniform(-0.5, 0.5) * half),
        (1.0, 0.0, 0.0),
        {"Post": {"normals": "faces"}},
    )


def mirrored(random: Random) -> Injection:
    """A closed body whose winding shows inwards and whose normals show outwards."""
    radius, high = random.uniform(0.22, 0.38), random.uniform(0.7, 1.1)
    kind = int(random.integers(3))
    if kind == 0:
        inner = [(radius * random.uniform(0.6, 1.1), high * t) for t in (0.15, 0.4, 0.65, 0.9)]
        solid = revolved([(0.0, 0.004), (0.7 * radius, 0.004), *inner, (0.0, high)], int(random.integers(14, 26)))
    elif kind == 1:
        solid = ball(4, radius, 0.5 * high, radius, rough=0.1, seed=int(random.integers(1000)))
        solid = solid.moved(0.0, 0.45 * high, 0.0)
    else:
        solid = block((-radius, 0.004, -radius), (radius, high, radius), random.uniform(0.1, 0.25))
    body = shaded(solid, 50.0)
    away = np.abs(body.positions[:, 1] - 0.5 * high) + 0.3 * np.abs(body.positions[:, 2])
    away[body.normals[:, 0] < 0.6] = np.inf
    spot = int(np.argmin(away))
    return Injection(
        CauseKind.AGAINST_FACE,
        ("vase", "boulder", "block")[kind],
        {"Plinth": Prop(plinth()), "Body": Prop(Shaded(body.positions, body.normals, body.faces[:, ::-1]))},
        "Body",
        tuple(body.positions[spot].tolist()),
        tuple(body.normals[spot].astype(float).tolist()),
        {"Body": {"winding": "normals"}},
    )


def hidden_spike(random: Random) -> Injection:
    """A spike that begins in a dark hollow, runs through a thick solid and shows only its tip."""
    top, tip = random.uniform(0.65, 0.8), random.uniform(0.02, 0.035)
    stretch = random.uniform(0.7, 1.0)
    outside = block((-0.6, -0.01, -0.6), (0.6, top, 0.6), 0.2)
    hollow = block((-0.5, 0.03, -0.5), (0.5, 0.3, 0.5), 0.2).flipped()
    profile = [(0.0, 0.06), (0.42, 0.08), (0.44, 0.2), (0.38, 0.32), (0.0, top + tip)]
    spike = revolved(profile, int(random.integers(3, 6))).scaled(1.0, 1.0, stretch)
    return Injection(
        CauseKind.STARVED,
        "tip of a spike",
        {
            "Plinth": Prop(plinth()),
            "Drum": Prop(shaded(joined(outside, hollow))),
            "Spike": Prop(shaded(spike, 170.0)),
        },
        "Spike",
        (0.0, top + tip, 0.0),
        (0.0, 1.0, 0.0),
        {"Spike": {"samples": 1024}},
    )


def needles(random: Random) -> Injection:
    """A top of two large panels with three needles between them, under a rail that shades little but these."""
    wide, deep, strip = random.uniform(0.6, 0.75), random.uniform(0.5, 0.65), random.uniform(0.025, 0.04)
    corners = [(-wide, 0.0), (wide, 0.0), (wide, strip), (-wide, strip), (random.uniform(-0.1, 0.1), strip)]
    corners += [(-wide, -deep), (wide, -deep), (wide, deep), (-wide, deep)]
    flat = np.array(corners)
    positions = np.column_stack([flat[:, 0], np.full(len(flat), 0.12), flat[:, 1]])
    faces = [(0, 4, 1), (0, 3, 4), (4, 2, 1), (5, 0, 1), (5, 1, 6), (3, 8, 7), (3, 7, 2)]
    top = with_normal(Solid(positions, np.array(faces, np.int32)), (0.0, 1.0, 0.0))
    body = block((-wide, -0.01, -deep), (wide, 0.105, deep), 0.4)
    over = random.uniform(0.155, 0.165)
    rail = [block((-0.75, over, -0.025), (0.75, over + 0.06, strip + 0.025), 0.15)]
    rail += [block((x, -0.01, -0.03), (x + 0.04, over + 0.05, strip + 0.03), 0.1) for x in (-0.8, 0.76)]
    return Injection(
        CauseKind.OVERSHOOT,
        "needles between panels",
        {"Plinth": Prop(plinth()), "Table": Prop(top), "Body": Prop(shaded(body)), "Rail": Prop(shaded(joined(*rail)))},
        "Table",
        (float(flat[4, 0]), 0.12, strip),
        (0.0, 1.0, 0.0),
        {"Table": {"alpha": 0.2}},
    )


def split_tiles(random: Random) -> Injection:
    """Two tiles that meet with a gap of less than 0.1 mm; a low canopy over the second begins at the seam."""
    zs = steps(-0.6, 0.6, random.uniform(0.12, 0.25))
    deep = random.uniform(0.5, 0.72)
    first = lattice([-deep, 0.0], [-0.01, 0.12], zs)
    second = lattice([0.0, deep], [-0.01, 0.12], zs).moved(random.uniform(1e-5, 8e-5), 0.0, 0.0)
    over = random.uniform(0.2, 0.28)
    canopy = [
        block((0.0, over, -0.7), (0.8, over + 0.25, 0.7), 0.15),
        block((0.72, -0.01, -0.7), (0.8, over, 0.7), 0.2),
    ]
    canopy += [block((0.02, -0.01, z), (0.77, over, z + 0.08), 0.2) for z in (-0.7, 0.62)]
    return Injection(
        CauseKind.SEAM,
        "tiles under a canopy",
        {
            "Plinth": Prop(plinth()),
            "TileA": Prop(shaded(first)),
            "TileB": Prop(shaded(second)),
            "Canopy": Prop(shaded(joined(*canopy))),
        },
        "TileB",
        (0.005, 0.12, random.uniform(-0.4, 0.4)),
        (0.0, 1.0, 0.0),
        {"TileA": {"weld": True}, "TileB": {"weld": True}},
    )


def wrong_offset(random: Random) -> Injection:
    """A slab whose rays start inside the shelf above it."""
    low, high = random.uniform(0.3, 0.4), random.uniform(0.55, 0.7)
    slab = block((-0.7, -0.01, -0.7), (0.7, 0.1, 0.7), random.uniform(0.15, 0.3))
    shelf = block((-0.75, 0.1 + low, -0.75), (0.2, 0.1 + high, 0.75), 0.2)
    post = block((-0.75, -0.01, -0.05), (-0.65, 0.1 + low, 0.05), 0.2)
    return Injection(
        CauseKind.UNIT,
        "offset into a shelf",
        {
            "Plinth": Prop(plinth()),
            "Slab": Prop(shaded(slab), keys={"offset": 0.5 * (low + high)}),
            "Shelf": Prop(shaded(joined(shelf, post)), two_sided=True),
        },
        "Slab",
        (random.uniform(0.0, 0.12), 0.1, random.uniform(-0.3, 0.3)),
        (0.0, 1.0, 0.0),
        {"Slab": {"offset": 0.0}},
    )


def turned_patch(random: Random) -> Injection:
    """A closed body of which a part is wound against its normals and its neighbours."""
    radius, high = random.uniform(0.25, 0.38), random.uniform(0.7, 1.1)
    body = shaded(ball(4, radius, 0.5 * high, radius).moved(0.0, 0.45 * high, 0.0), 80.0)
    middle = body.positions[body.faces].mean(axis=1)
    patch = middle[:, 0] > random.uniform(-0.2, 0.3) * radius
    faces = np.where(patch[:, None], body.faces[:, ::-1], body.faces)
    away = np.abs(body.positions[:, 1] - 0.5 * high) + 0.3 * np.abs(body.positions[:, 2])
    away[body.normals[:, 0] < 0.8] = np.inf
    spot = int(np.argmin(away))
    x, y, z = body.positions[spot].tolist()
    a, b, c = body.normals[spot].astype(float).tolist()
    return Injection(
        CauseKind.AGAINST_FACE,
        "part of a ball",
        {"Plinth": Prop(plinth()), "Body": Prop(Shaded(body.positions, body.normals, faces))},
        "Body",
        (x, y, z),
        (a, b, c),
        {"Body": {"winding": "normals"}},
    )


def hidden_ridge(random: Random) -> Injection:
    """A long prism that shows only its ridge above a solid with a dark hollow."""
    top, shows = random.uniform(0.55, 0.75), random.uniform(0.015, 0.03)
    outside = block((-0.6, -0.01, -0.6), (0.6, top, 0.6), 0.2)
    hollow = block((-0.5, 0.03, -0.5), (0.5, 0.3, 0.5), 0.2).flipped()
    long, wide, ridge = random.uniform(0.2, 0.35), random.uniform(0.3, 0.42), top + shows
    section = [(-wide, 0.06), (wide, 0.06), (0.8 * wide, 0.33), (0.0, ridge), (-0.8 * wide, 0.33)]
    corners = [(x, y, z) for x in (-long, long) for z, y in section]
    faces = [(0, i, i + 1) for i in (1, 2, 3)] + [(5, 6 + i, 5 + i) for i in (1, 2, 3)]
    for i in range(5):
        j = (i + 1) % 5
        faces += [(i, i + 5, j), (j, i + 5, j + 5)]
    prism = Solid(np.array(corners), np.array(faces, np.int32))
    # a little down the slope that shows: on the edge itself it would be open which way to look
    rise, run = ridge - 0.33, 0.8 * wide
    down, slope = random.uniform(0.2, 0.4) * shows, float(np.hypot(rise, run))
    return Injection(
        CauseKind.STARVED,
        "ridge of a prism",
        {
            "Plinth": Prop(plinth()),
            "Drum": Prop(shaded(joined(outside, hollow))),
            "Prism": Prop(shaded(prism, 170.0)),
        },
        "Prism",
        (random.uniform(-0.5, 0.5) * long, ridge - down, down * run / rise),
        (0.0, run / slope, rise / slope),
        {"Prism": {"samples": 1024}},
    )


def split_plate(random: Random) -> Injection:
    """One object whose halves meet with a gap far below a millimetre, the second under a canopy."""
    zs, deep = steps(-0.6, 0.6, random.uniform(0.12, 0.25)), random.uniform(0.5, 0.72)
    first = lattice([-deep, 0.0], [-0.01, 0.12], zs)
    second = lattice([0.0, deep], [-0.01, 0.12], zs).moved(random.uniform(2e-5, 8e-5), 0.0, 0.0)
    over = random.uniform(0.2, 0.28)
    canopy = [block((0.0, over, -0.7), (0.8, over + 0.25, 0.7), 0.15)]
    canopy += [block((0.72, -0.01, -0.7), (0.8, over, 0.7), 0.2)]
    canopy += [block((0.02, -0.01, z), (0.77, over, z + 0.08), 0.2) for z in (-0.7, 0.62)]
    return Injection(
        CauseKind.SEAM,
        "halves of one plate",
        {
            "Plinth": Prop(plinth()),
            "Plate": Prop(shaded(joined(first, second))),
            "Canopy": Prop(shaded(joined(*canopy))),
        },
        "Plate",
        (0.005, 0.12, random.uniform(-0.4, 0.4)),
        (0.0, 1.0, 0.0),
        {"Plate": {"weld": True}},
    )
