"""Visibility regions: one a room, one for the corridor, cells outdoors; and which of them meet."""

from __future__ import annotations

import itertools
from typing import Any

from assets.sample_level.house import DOORS, FLOOR, ROOMS

Box = tuple[tuple[float, float, float], tuple[float, float, float]]

_LOW, _HIGH = -6.0, 12.0  # outdoor cells hold the lowest hollow and the tower

# Outdoors: x0, z0, x1, z1. The house has no part in them, except for what stands out of its rooms.
_CELLS = {
    "OutsideNorthWest": (-60.0, -60.0, -9.0, -6.0),
    "OutsideNorth": (-9.0, -60.0, 9.0, -6.0),
    "OutsideNorthEast": (9.0, -60.0, 60.0, -6.0),
    "OutsideWest": (-60.0, -6.0, -9.0, 6.0),
    "Yard": (15.0, -6.0, 60.0, 6.0),
    "CourtNorth": (9.0, -6.0, 15.0, 0.4),
    "CourtSouth": (9.0, 3.0, 15.0, 6.0),
    "OutsideSouthWest": (-60.0, 6.0, -9.0, 60.0),
    "OutsideSouth": (-9.0, 6.0, 15.0, 60.0),
    "DarkCorner": (15.0, 6.0, 60.0, 60.0),
}
_TOWER: Box = ((-32.4, 1.6, -24.4), (-27.0, 4.5, -19.6))


def region_boxes() -> dict[str, Box]:
    """Boxes by name: lowest and highest corner in metres. RoomC's holds the void behind its diagonal wall too."""
    boxes: dict[str, Box] = {name: ((x0, FLOOR, z0), (x1, top, z1)) for name, (x0, z0, x1, z1, top) in ROOMS.items()}
    boxes["TowerRoom"] = _TOWER
    for name, (x0, z0, x1, z1) in _CELLS.items():
        boxes[name] = ((x0, _LOW, z0), (x1, _HIGH, z1))
    return boxes


def region_links() -> list[tuple[str, str]]:
    """Pairs of regions with open space between them: through doorways, at the corridor's end, between cells."""
    links = [(a, "OutsideWest" if b == "Outside" else b) for a, b in DOORS]
    links += [("Corridor", "Yard"), ("TowerRoom", "OutsideNorthWest")]
    for (a, first), (b, second) in itertools.combinations(_CELLS.items(), 2):
        overlap_x = min(first[2], second[2]) - max(first[0], second[0])
        overlap_z = min(first[3], second[3]) - max(first[1], second[1])
        if max(overlap_x, overlap_z) > 0 and min(overlap_x, overlap_z) == 0:  # they share a side
            links.append((a, b))
    return links


def regions_document() -> dict[str, Any]:
    """What goes into `regions.json`."""
    return {
        "regions": [{"name": n, "min": list(low), "max": list(high)} for n, (low, high) in region_boxes().items()],
        "links": [{"a": a, "b": b} for a, b in region_links()],
    }
