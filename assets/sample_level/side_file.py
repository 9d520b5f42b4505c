"""The side file of the level: what its objects are to the bake, and its visibility regions."""

from __future__ import annotations

from typing import Any

from assets.sample_level.regions import region_boxes
from assets.sample_level.tower import FINEST

# Oaks, grass and the tower's first lower level of detail say their role in the file itself. The densities are about
# those that `--fit-fog` finds in the shrubs' own leaves.
RULES: tuple[dict[str, Any], ...] = (
    {"match": "Level/Trees/pine_*", "role": "tree", "transmission": 0.6},
    {"match": "Level/Shrubs/hedge_*", "role": "shrub", "density": 0.35},
    {"match": "Level/Shrubs/bush_*", "role": "shrub", "density": 0.28},
    {"match": "Level/Tower/Tower_LOD2", "role": "lod", "of": FINEST},
)


def side_file_text() -> str:
    """The file as TOML."""
    lines = ["# Written by assets/sample_level/build.py.", "[bake]", "distances = [2.0, 300.0]", ""]
    for rule in RULES:
        lines += ["[[object]]", *(f"{key} = {_toml(value)}" for key, value in rule.items()), ""]
    for name, (low, high) in region_boxes().items():
        lines += ["[[region]]", f"name = {_toml(name)}", f"min = {_toml(list(low))}", f"max = {_toml(list(high))}", ""]
    return "\n".join(lines)


def _toml(value: Any) -> str:
    if isinstance(value, list):
        return "[" + ", ".join(_toml(item) for item in value) + "]"
    return f'"{value}"' if isinstance(value, str) else str(value)
