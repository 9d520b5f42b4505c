"""Suspicious spots as a table, and as marks in the view."""

from __future__ import annotations

import numpy as np

from bake.explain.spots import SIGNS, Spots
from bake.types import Float64Array, World
from viewer.colormaps import WARNING
from viewer.instance_rows import Column
from viewer.overlays import MOST_POINTS, OverlayPoints

SIGN_WORDS = {
    "dark": "dark",
    "residual": "misfit",
    "filled": "filled",
    "margin": "back faces",
    "held": "held at 0 or 1",
    "seam": "seam",
}
SIGN_TIP = (
    "dark: darker than its surroundings; misfit: samples disagree with the fit; filled: from neighbours; back faces: "
    "near the back-face threshold; held at 0 or 1 by the fit's bounds; seam: a step across a seam"
)
CHOSEN_COLOR = (255, 0, 255)


def spot_columns(spots: Spots, paths: tuple[str, ...]) -> list[Column]:
    """The columns of the table; the rows are in the order of `spots`, the gravest first."""
    objects = [paths[number] for number in spots.object]
    signs = [", ".join(SIGN_WORDS[name] for name in spots.signs_of(row)) or "—" for row in range(len(spots))]
    causes = [kind.heading for kind in spots.guess]
    drop = np.maximum(spots.usual - spots.value, 0.0)
    return [
        Column("#", [f"{row + 1}" for row in range(len(spots))], list(range(len(spots))), "Rank by severity"),
        Column("Object", objects, objects, "Object of the vertex that stands out most"),
        Column("Likely cause", causes, causes, "Guessed from the stored values; explain the spot to have it measured"),
        _numbers("Severity", spots.severity, "{:.2f}", "0 unremarkable, 1 as grave as can be"),
        _numbers("AO", spots.value, "{:.3f}", "At the vertex that stands out most"),
        _numbers("Too dark by", drop, "{:.3f}", "Against what is usual around it"),
        _numbers("Area [m²]", spots.area, "{:.3g}", "Surface of the spot"),
        _numbers("Vertices", spots.vertices, "{:,.0f}", "Vertices of the spot"),
        Column("Signs", signs, signs, SIGN_TIP),
    ]


def spot_marks(world: World, spots: Spots, chosen: int = -1, *, everything: bool = True) -> OverlayPoints:
    """The vertices of all spots by their spot's severity; those of the chosen one in a colour of their own."""
    owner = np.repeat(np.arange(len(spots)), np.diff(spots.first))
    step = max(1, -(-len(owner) // MOST_POINTS))
    all_of_them = np.arange(0, len(owner) if everything else 0, step)
    shown = np.unique(np.concatenate((all_of_them, np.flatnonzero(owner == chosen))))
    colors = WARNING.colors(spots.severity[owner[shown]], 0.0, 1.0)
    colors[owner[shown] == chosen] = CHOSEN_COLOR
    positions = np.asarray(world.positions)[spots.members[shown]].astype(np.float32)
    return OverlayPoints(positions, colors, len(owner))


def spot_view(world: World, spots: Spots, spot: int) -> tuple[Float64Array, Float64Array, float]:
    """What a camera needs to look at a spot: the point, the direction its surface faces, and a fitting distance.

    Returns:
        Point (3,), metres from the world's origin; unit direction (3,); metres.
    """
    vertex = int(spots.vertex[spot])
    normal = np.asarray(world.normals[vertex], np.float64)
    length = float(np.linalg.norm(normal))
    outward = normal / length if length > 0.5 else np.array([0.0, 1.0, 0.0])
    return np.asarray(world.positions[vertex], np.float64), outward, max(5.0 * float(spots.radius[spot]), 2.0)


def sign_names() -> tuple[str, ...]:
    """What a table can be filtered by, in words."""
    return tuple(SIGN_WORDS[name] for name in SIGNS)


def _numbers(heading: str, values: np.ndarray, form: str, tip: str) -> Column:
    numbers = np.asarray(values, np.float64).tolist()
    return Column(heading, [form.format(number) for number in numbers], numbers, tip)
