"""Defects with known causes, and spots that are rightly dark, by cause."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bake.bench.defects_of_meshes import (
    hidden_ridge,
    hidden_spike,
    leaning_normals,
    leaning_side,
    mirrored,
    needles,
    split_plate,
    split_tiles,
    turned_patch,
    wrong_offset,
)
from bake.bench.defects_of_placement import (
    awning,
    buried_panel,
    buried_post,
    covered_slab,
    doubled_banner,
    leak_under_wall,
    sheet_before_board,
    shell_around,
)
from bake.bench.injection import Injection
from bake.bench.sound_spots import SOUND
from bake.explain.cause_names import CauseKind

Make = Callable[[np.random.Generator], Injection]

MAKERS: dict[CauseKind, tuple[Make, ...]] = {
    CauseKind.BURIED: (buried_post, buried_panel),
    CauseKind.BELOW_PLANE: (leaning_normals, leaning_side),
    CauseKind.AGAINST_FACE: (mirrored, turned_patch),
    CauseKind.TWIN: (doubled_banner, covered_slab),
    CauseKind.STARVED: (hidden_spike, hidden_ridge),
    CauseKind.OVERSHOOT: (needles,),
    CauseKind.SEAM: (split_tiles, split_plate),
    CauseKind.SHELL: (shell_around,),
    CauseKind.UNIT: (wrong_offset,),
    CauseKind.SHEET: (sheet_before_board, awning, leak_under_wall),
    CauseKind.CREVICE: SOUND,
}


def make_injection(cause: CauseKind, random: np.random.Generator) -> Injection:
    """One injection of random measures; where a cause comes in several kinds, of a random kind."""
    makers = MAKERS[cause]
    return makers[int(random.integers(len(makers)))](random)
