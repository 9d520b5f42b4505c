"""Two rooms with a door between them, as a scene file and a region file."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

DOOR = (2.5, 3.5)
"""Where the door begins and ends along z."""


def write_two_rooms(folder: Path) -> tuple[Path, Path]:
    """Writes rooms of 4 × 3 × 6 m side by side along x, and a region for each; returns both files."""
    quads = [
        # Floor, ceiling and outer walls, seen from inside.
        [[0, 0, 0], [0, 0, 6], [8, 0, 6], [8, 0, 0]],
        [[0, 3, 0], [8, 3, 0], [8, 3, 6], [0, 3, 6]],
        [[0, 0, 0], [8, 0, 0], [8, 3, 0], [0, 3, 0]],
        [[0, 0, 6], [0, 3, 6], [8, 3, 6], [8, 0, 6]],
        [[0, 0, 0], [0, 3, 0], [0, 3, 6], [0, 0, 6]],
        [[8, 0, 0], [8, 0, 6], [8, 3, 6], [8, 3, 0]],
    ]
    quads += _block([3.95, 0, 0], [4.05, 3, DOOR[0]])
    quads += _block([3.95, 0, DOOR[1]], [4.05, 3, 6])
    quads += _block([3.95, 2.1, DOOR[0]], [4.05, 3, DOOR[1]])
    lines = [f"v {x:g} {y:g} {z:g}" for quad in quads for x, y, z in quad]
    lines += [f"f {4 * i + 1} {4 * i + 2} {4 * i + 3} {4 * i + 4}" for i in range(len(quads))]
    scene, regions = folder / "rooms.obj", folder / "regions.json"
    scene.write_text("o rooms\n" + "\n".join(lines) + "\n")
    boxes = [("west", [0.0, 0.0, 0.0], [3.95, 3.0, 6.0]), ("east", [4.05, 0.0, 0.0], [8.0, 3.0, 6.0])]
    regions.write_text(json.dumps({"regions": [{"name": n, "min": a, "max": b} for n, a, b in boxes]}))
    return scene, regions


def _block(low: list[float], high: list[float]) -> list[list[list[float]]]:
    """A solid block seen from outside."""
    corners = np.array([[(low, high)[i >> a & 1][a] for a in range(3)] for i in range(8)])
    sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
    return [corners[side].tolist() for side in sides]
