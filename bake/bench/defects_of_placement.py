"""Defects of what stands where, with random measures: buried parts, twins, shells, thin sheets.

Each is wrong in exactly one way. Lengths are metres from the middle of the top of a plinth, y up; see
`bake.bench.injection`.
"""

from __future__ import annotations

import numpy as np

from bake.bench.injection import Injection, Prop
from bake.bench.shapes import (
    Solid,
    ball,
    block,
    flat,
    joined,
    lattice,
    plinth,
    revolved,
    shaded,
    upright,
    with_normal,
)
from bake.explain.cause_names import CauseKind

Random = np.random.Generator


def buried_post(random: Random) -> Injection:
    """A post of tall single faces, its lower part in a two-sided mound."""
    half, height, share = random.uniform(0.1, 0.2), random.uniform(0.8, 1.3), random.uniform(0.4, 0.6)
    wide, high = random.uniform(0.45, 0.65), share * height
    post = lattice([-half, half], [-0.02, height], [-half, half])
    mound = ball(4, wide, high, wide, rough=random.uniform(0.0, 0.1), seed=int(random.integers(1000)))
    visible = 0.5 * (high + height)
    return Injection(
        CauseKind.BURIED,
        "post in a mound",
        {"Plinth": Prop(plinth()), "Post": Prop(shaded(post)), "Mound": Prop(shaded(mound, 80.0), two_sided=True)},
        "Post",
        (half, visible, random.uniform(-0.3, 0.3) * half),
        (1.0, 0.0, 0.0),
        {"Mound": {"two_sided": False}},
    )


def buried_panel(random: Random) -> Injection:
    """A panel sunk into a two-sided block."""
    wide, height, deep = random.uniform(0.3, 0.5), random.uniform(0.7, 1.1), random.uniform(0.3, 0.5)
    body = block((-0.7, -0.02, -0.5), (0.7, deep, 0.5), 0.15)
    panel = lattice([-wide, wide], [0.03, height], [-0.04, 0.04])
    return Injection(
        CauseKind.BURIED,
        "panel in a block",
        {"Plinth": Prop(plinth()), "Panel": Prop(shaded(panel)), "Body": Prop(shaded(body), two_sided=True)},
        "Panel",
        (random.uniform(-0.5, 0.5) * wide, deep + 0.4 * (height - deep), 0.04),
        (0.0, 0.0, 1.0),
        {"Body": {"two_sided": False}},
    )


def doubled_banner(random: Random) -> Injection:
    """A banner whose faces are doubled with opposed winding on the same vertices, just before a board."""
    gap, wide, high = random.uniform(0.02, 0.06), random.uniform(0.35, 0.55), random.uniform(0.8, 1.2)
    front = upright(-wide, wide, 0.05, high, int(random.integers(5, 11)))
    both = Solid(front.positions, np.concatenate([front.faces, front.faces[:, ::-1]]))
    board = block((-0.6, -0.01, -gap - 0.16), (0.6, high + 0.1, -gap), 0.2)
    return Injection(
        CauseKind.TWIN,
        "doubled banner",
        {"Plinth": Prop(plinth()), "Banner": Prop(with_normal(both, (0.0, 0.0, 1.0))), "Board": Prop(shaded(board))},
        "Banner",
        (random.uniform(-0.3, 0.3) * wide, random.uniform(0.4, 0.7) * high, 0.0),
        (0.0, 0.0, 1.0),
        {"Banner": {"two_sided": True}},
    )


def covered_slab(random: Random) -> Injection:
    """A slab under a sheet that lies a fraction of a millimetre above it and ends in the middle of its faces."""
    lift, step = random.uniform(2e-4, 8e-4), random.uniform(0.2, 0.3)
    slab = block((-0.7, -0.01, -0.7), (0.7, 0.15, 0.7), step)
    line = np.unique(slab.positions[:, 0])
    inner = line[(line > -0.45) & (line < 0.45)]
    cell = line[1] - line[0]
    edge = inner[-1] + random.uniform(0.55, 0.8) * cell
    cover = flat(-0.4, edge, -0.5, 0.5, 0.15 + lift, 4)
    return Injection(
        CauseKind.TWIN,
        "sheet just above a slab",
        {
            "Plinth": Prop(plinth()),
            "Slab": Prop(shaded(slab)),
            "Cover": Prop(with_normal(cover, (0.0, 1.0, 0.0)), two_sided=True),
        },
        "Slab",
        (edge + 0.12 * cell, 0.15, random.uniform(-0.2, 0.2)),
        (0.0, 1.0, 0.0),
        {"Cover": {"role": "receiver"}},
    )


def shell_around(random: Random) -> Injection:
    """A bust in a closed shell that faces inwards and cannot be seen from outside."""
    size = random.uniform(0.5, 0.75)
    head = ball(3, 0.15, 0.2, 0.15).moved(0.0, 0.5, 0.0)
    chest = revolved([(0.0, -0.01), (0.22, -0.01), (0.26, 0.1), (0.2, 0.25), (0.09, 0.35), (0.0, 0.42)], 18)
    kind = int(random.integers(3))
    if kind == 0:
        shell = ball(4, size, 1.2 * size, size).moved(0.0, 0.3, 0.0)
    elif kind == 1:
        shell = block((-size, -0.15, -size), (size, random.uniform(0.85, 1.1), size), 0.2)
    else:
        shell = revolved([(0.0, -0.1), (size, -0.1), (size, 0.6), (0.8 * size, 0.85), (0.0, 1.0)], 20)
    return Injection(
        CauseKind.SHELL,
        ("ball", "box", "dome")[kind],
        {
            "Plinth": Prop(plinth()),
            "Bust": Prop(shaded(joined(head, chest), 50.0)),
            "Shell": Prop(shaded(shell.flipped(), 80.0)),
        },
        "Bust",
        (0.0, 0.7, 0.0),
        (0.0, 1.0, 0.0),
        {"Shell": {"role": "ignore"}},
    )


def sheet_before_board(random: Random) -> Injection:
    """One layer that shows to the board behind it; it is the other side that people look at."""
    gap, wide, high = random.uniform(0.02, 0.06), random.uniform(0.35, 0.55), random.uniform(0.8, 1.2)
    front = upright(-wide, wide, 0.05, high, int(random.integers(4, 10))).flipped()
    board = block((-0.6, -0.01, -gap - 0.16), (0.6, high + 0.1, -gap), 0.2)
    return Injection(
        CauseKind.SHEET,
        "one layer before a board",
        {
            "Plinth": Prop(plinth()),
            "Sheet": Prop(with_normal(front, (0.0, 0.0, -1.0)), two_sided=True),
            "Board": Prop(shaded(board)),
        },
        "Sheet",
        (random.uniform(-0.3, 0.3) * wide, random.uniform(0.4, 0.7) * high, 0.0),
        (0.0, 0.0, 1.0),
        {"Sheet": {"winding": "flipped"}},
    )


def awning(random: Random) -> Injection:
    """A horizontal sheet whose faces show down to a table top just below; people look at its upper side."""
    gap, wide, deep = random.uniform(0.02, 0.06), random.uniform(0.4, 0.6), random.uniform(0.3, 0.5)
    low = random.uniform(0.3, 0.7)
    cloth = flat(-wide, wide, -deep, deep, low + gap, int(random.integers(4, 10))).flipped()
    table = block((-0.65, -0.01, -0.6), (0.65, low, 0.6), 0.2)
    return Injection(
        CauseKind.SHEET,
        "cloth over a table",
        {
            "Plinth": Prop(plinth()),
            "Cloth": Prop(with_normal(cloth, (0.0, -1.0, 0.0)), two_sided=True),
            "Table": Prop(shaded(table)),
        },
        "Cloth",
        (random.uniform(-0.3, 0.3) * wide, low + gap, random.uniform(-0.3, 0.3) * deep),
        (0.0, 1.0, 0.0),
        {"Cloth": {"winding": "flipped"}},
    )


def leak_under_wall(random: Random) -> Injection:
    """A floor of large faces that run on under a thin wall into a dark hut."""
    cell = random.uniform(0.45, 0.6)
    edges = np.array([-1.5, -0.5, 0.5, 1.5]) * cell
    edges = np.clip(edges, -0.8, 0.8)
    floor = lattice(edges, [-0.01, 0.1], edges)
    wall = random.uniform(0.25, 0.45) * cell  # between -½ and ½ cell: most of the middle faces lie inside
    inside = upright(-0.6, 0.6, 0.08, 0.75, 6)
    inside = Solid(inside.positions[:, [2, 1, 0]] + np.array([wall, 0.0, 0.0]), inside.faces[:, ::-1])
    hut = [block((-0.8, 0.7, -0.65), (wall, 0.76, 0.65), 0.2), block((-0.8, 0.05, -0.65), (-0.7, 0.7, 0.65), 0.2)]
    hut += [block((-0.7, 0.05, z), (wall, 0.7, z + 0.06), 0.2) for z in (-0.65, 0.59)]
    return Injection(
        CauseKind.SHEET,
        "leak under a thin wall",
        {
            "Plinth": Prop(plinth()),
            "Floor": Prop(shaded(floor)),
            "Wall": Prop(with_normal(inside, (1.0, 0.0, 0.0)), two_sided=True),
            "Hut": Prop(shaded(joined(*hut))),
        },
        "Floor",
        (wall + random.uniform(0.1, 0.3) * (0.5 * cell - wall) + 0.02, 0.1, random.uniform(-0.15, 0.15)),
        (0.0, 1.0, 0.0),
    )


def wide_shell(random: Random) -> Injection:
    """A stand in a wide closed shell that faces inwards and goes through the level, as a misplaced sky would."""
    size = random.uniform(3.5, 5.0)
    stand = block((-0.2, -0.01, -0.2), (0.2, random.uniform(0.3, 0.7), 0.2), 0.15)
    shell = ball(4, size, size, size) if random.random() < 0.5 else block((-size,) * 3, (size,) * 3, 1.0)
    return Injection(
        CauseKind.SHELL,
        "wide shell",
        {"Plinth": Prop(plinth()), "Stand": Prop(shaded(stand)), "Shell": Prop(shaded(shell.flipped(), 80.0))},
        "Stand",
        (random.uniform(-0.1, 0.1), float(stand.positions[:, 1].max()), random.uniform(-0.1, 0.1)),
        (0.0, 1.0, 0.0),
        {"Shell": {"role": "ignore"}},
        longest=True,
    )


def stand(random: Random) -> Injection:
    """A sound post, to be baked in a wrong unit."""
    half, high = random.uniform(0.15, 0.3), random.uniform(0.6, 1.0)
    post = block((-half, -0.01, -half), (half, high, half), 0.12)
    return Injection(
        CauseKind.UNIT,
        "whole level in a wrong unit",
        {"Plinth": Prop(plinth()), "Post": Prop(shaded(post))},
        "Post",
        (half, random.uniform(0.5, 0.8) * high, random.uniform(-0.5, 0.5) * half),
        (1.0, 0.0, 0.0),
    )
