"""Gives SuperTuxKart's Black Forest roles: `python -m assets.black_forest.roles SCENE.glb FOLDER`.

The level says nothing about roles itself. The scene in FOLDER is a link to the file given, or a copy of it, with a side
file beside it; the file given and its folder stay as they are.
"""

from __future__ import annotations

import logging
import os
import shutil
import sys
from pathlib import Path

logger = logging.getLogger(__name__)

ROLES: dict[str, tuple[str, ...]] = {
    "tree": (
        "stklib_pinetree_*",
        "stklib_autumnTree_*",
        "stklib_autumnBirch_*",
        "stklib_autumnWillow_*",
        "ekasia_tree_*",
        "fir_tree_*",
    ),
    "shrub": ("stklib_cornPlant_*", "stklib_redFlowerBush_*", "stklib_sagebrush_*", "stklib_fern_*"),
    "small": ("stklib_cattail_*", "stklib_mushroom_*", "stklib_waterLily_*"),
    "blocker": ("lowpoly_trees_*",),  # the backdrop, seen from afar only
    "receiver": ("stklib_animGrass_*",),  # moves at run time
    "ignore": ("stklib_oldLantern_a/stklib_oldLantern_glow_*", "normal_arrows", "reverse_arrow", "stklib_bird_*"),
}

# About what `--fit-fog` finds in the plants' own leaves, in 1/m.
DENSITIES = {
    "stklib_cornPlant_*": 0.12,
    "stklib_redFlowerBush_*": 0.17,
    "stklib_sagebrush_*": 0.17,
    "stklib_fern_*": 0.11,
}

# Two sheets that lie in each other: the level has no levels of detail of its own.
LODS = {"Plane.148": "Plane.006"}


def side_file_text() -> str:
    """The side file as TOML."""
    lines = ["# Written by assets/black_forest/roles.py.", ""]
    for role, patterns in ROLES.items():
        for pattern in patterns:
            lines += ["[[object]]", f'match = "{pattern}"', f'role = "{role}"']
            lines += [f"density = {DENSITIES[pattern]}", ""] if pattern in DENSITIES else [""]
    for match, finest in LODS.items():
        lines += ["[[object]]", f'match = "{match}"', 'role = "lod"', f'of = "{finest}"', ""]
    return "\n".join(lines)


def prepare(scene: Path, folder: Path) -> Path:
    """Puts the scene with its roles into a folder, which is made if need be.

    Returns:
        The scene to bake.
    """
    folder.mkdir(parents=True, exist_ok=True)
    there = folder / scene.name
    if there.exists() or there.is_symlink():
        there.unlink()
    try:
        os.link(scene, there)
    except OSError:  # another file system
        shutil.copyfile(scene, there)
    (folder / f"{scene.name}.obscura.toml").write_bytes(side_file_text().encode())
    return there


if __name__ == "__main__":
    logging.basicConfig(level=logging.INFO)
    logger.info("%s", prepare(Path(sys.argv[1]), Path(sys.argv[2])))
