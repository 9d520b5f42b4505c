"""Makes the sample level: `python -m assets.sample_level.build` writes it beside this file."""

from __future__ import annotations

import logging
from pathlib import Path

from assets.sample_level.furniture import add_furniture
from assets.sample_level.glb_writer import write_glb
from assets.sample_level.house import add_house
from assets.sample_level.leaf_textures import leaf_images
from assets.sample_level.level import Level, Node
from assets.sample_level.materials import MATERIALS
from assets.sample_level.props import add_props
from assets.sample_level.terrain import add_terrain

logger = logging.getLogger(__name__)


def make_level() -> Level:
    """The whole level in memory."""
    level = Level(Node("Level"))
    add_terrain(level)
    add_house(level)
    add_furniture(level)
    add_props(level)
    return level


def build(folder: Path) -> None:
    """Writes the level and what belongs to it into a folder; the same bytes every time."""
    level = make_level()
    write_glb(folder / "level.glb", level, MATERIALS, leaf_images())


if __name__ == "__main__":
    logging.basicConfig(level=logging.INFO)
    build(Path(__file__).resolve().parent)
