"""Makes the sample level: `python -m assets.sample_level.build` writes it beside this file."""

from __future__ import annotations

import json
import logging
from pathlib import Path
from typing import Any

from assets.sample_level.dark_corner import add_dark_corner
from assets.sample_level.furniture import add_furniture
from assets.sample_level.glb_writer import write_glb
from assets.sample_level.house import add_house
from assets.sample_level.leaf_textures import leaf_images
from assets.sample_level.level import Level, Node
from assets.sample_level.materials import MATERIALS
from assets.sample_level.planting import add_plants
from assets.sample_level.props import add_props
from assets.sample_level.regions import regions_document
from assets.sample_level.side_file import side_file_text
from assets.sample_level.terrain import add_terrain
from assets.sample_level.tower import add_tower

logger = logging.getLogger(__name__)


def make_level() -> tuple[Level, list[dict[str, Any]]]:
    """The whole level in memory, and its planted dark spots."""
    level = Level(Node("Level"))
    add_terrain(level)
    add_house(level)
    add_furniture(level)
    add_props(level)
    add_tower(level)
    add_plants(level)
    planted = add_dark_corner(level)
    return level, planted


def build(folder: Path) -> None:
    """Writes the level and what belongs to it into a folder; the same bytes every time.

    Args:
        folder: Gets `level.glb`, `level.glb.obscura.toml`, `regions.json` and `planted.json`.
    """
    level, planted = make_level()
    write_glb(folder / "level.glb", level, MATERIALS, leaf_images())
    (folder / "level.glb.obscura.toml").write_bytes(side_file_text().encode())
    for name, document in (("regions", regions_document()), ("planted", {"spots": planted})):
        (folder / f"{name}.json").write_bytes((json.dumps(document, indent=1) + "\n").encode())
    logger.info("%d meshes written to %s", len(level.meshes), folder)


if __name__ == "__main__":
    logging.basicConfig(level=logging.INFO)
    build(Path(__file__).resolve().parent)
