"""Eight known causes of dark spots side by side on plinths, and a ninth spot that is rightly dark."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from assets.sample_level import defects
from assets.sample_level.digits import digit
from assets.sample_level.level import Level
from assets.sample_level.mesh import Part, shaded
from assets.sample_level.shapes import graded, lattice

GROUND = -0.35  # top of the paving
PLINTH_TOP = 0.35
FIRST_X, STEP, Z = 22.0, 3.0, 30.0


@dataclass(frozen=True)
class Exhibit:
    """One planted dark spot.

    Attributes:
        name: Node name: number and cause.
        cause: What makes it dark.
        objects: Meshes by node name, in metres from the middle of the plinth's top.
        dark: Name of the object with the dark spot.
        spot: Where it is, in metres from the middle of the plinth's top.
        remedy: What cures it: `kind`; where it is a key of the side file also `object`, `key` and `value`.
        why: One sentence.
        shift: Placement of objects that are not at the origin.
    """

    name: str
    cause: str
    objects: dict[str, tuple[Part, ...]]
    dark: str
    spot: tuple[float, float, float]
    remedy: dict[str, Any]
    why: str
    shift: dict[str, tuple[float, float, float]]


def exhibits() -> list[Exhibit]:
    """All nine, in order."""
    return [
        Exhibit(
            "1_buried",
            "buried-in-geometry",
            defects.buried(),
            "Post",
            (0.15, 0.68, 0.0),
            {"kind": "two-sided", "object": "Mound", "key": "two_sided", "value": False},
            "The lower part of the post's tall faces lies in a mound marked two-sided, so that the samples in there "
            "count as dark instead of invalid and pull the visible part down.",
            {},
        ),
        Exhibit(
            "2_below_plane_rays",
            "below-plane-rays",
            defects.below_plane_rays(),
            "Slab",
            (0.0, 0.12, 0.3),
            {"kind": "normals", "object": "Slab", "key": "normals", "value": "faces"},
            "The normals on top of the slab lean 80 degrees towards the wall: half of the directions fall below the "
            "face, the rest looks at the wall.",
            {},
        ),
        Exhibit(
            "3_flipped_normals",
            "normal-against-face",
            defects.flipped_normals(),
            "Vase",
            (0.0, 0.5, 0.3),
            {"kind": "normals", "object": "Vase", "key": "winding", "value": "normals"},
            "The vase was mirrored: its winding shows inwards, its normals outwards, so that its rays start inside.",
            {},
        ),
        Exhibit(
            "4_coplanar_twin",
            "coplanar-twin",
            defects.coplanar_twin(),
            "Banner",
            (0.05, 0.62, 0.0),
            {"kind": "two-sided", "object": "Banner", "key": "two_sided", "value": True},
            "Every triangle of the banner has an opposed twin on the same vertices: the dark back, 4 cm before the "
            "board, is averaged into the front.",
            {},
        ),
        Exhibit(
            "5_starved",
            "starved-of-samples",
            defects.starved(),
            "Spike",
            (0.0, 0.77, 0.0),
            {"kind": "samples", "object": "Spike", "key": "samples", "value": 1024},
            "Only the tip of the spike shows, so little of its faces that every sample falls into the solid below; "
            "the tip is filled from the dark hollow in which the spike begins.",
            {},
        ),
        Exhibit(
            "6_sliver_overshoot",
            "sliver-overshoot",
            defects.sliver_overshoot(),
            "Table",
            (0.0, 0.12, 0.03),
            {"kind": "alpha", "object": "Table", "key": "alpha", "value": 0.2},
            "Needle triangles between two large ones: their inner vertices belong to nothing else and must make up "
            "for all that the large triangles cannot follow.",
            {},
        ),
        Exhibit(
            "7_split_seam",
            "split-seam",
            defects.split_seam(),
            "TileB",
            (0.01, 0.12, 0.0),
            {"kind": "weld", "object": "Tile*", "key": "weld", "value": True},
            "Two tiles meet with a gap of 0.06 mm and share no vertices: the canopy's shade ends in a hard line.",
            {"TileB": (6e-5, 0.0, 0.0)},
        ),
        Exhibit(
            "8_enclosing_shell",
            "enclosing-shell",
            defects.enclosing_shell(),
            "Bust",
            (0.0, 0.72, 0.0),
            {"kind": "role", "object": "Shell", "key": "role", "value": "ignore"},
            "A closed shell that faces inwards surrounds the bust; seen from outside its faces are culled.",
            {},
        ),
        Exhibit(
            "9_true_crevice",
            "true-crevice",
            defects.true_crevice(),
            "Blocks",
            (0.025, 0.3, 0.1),
            {"kind": "none"},
            "Nothing is wrong here: the gap between the blocks is 5 cm wide.",
            {},
        ),
    ]


def add_dark_corner(level: Level) -> list[dict[str, Any]]:
    """Places the exhibits; returns what goes into `planted.json`."""
    paving = lattice(graded(20.0, 48.0, 0.45), graded(-0.9, GROUND, 0.6), graded(27.2, 33.6, 0.45))
    level.place("DarkCorner/Paving", (shaded(paving, "Paving"),))
    foot = GROUND - PLINTH_TOP - 0.02
    plinth = lattice(graded(-0.8, 0.8, 0.25, 0.1), graded(foot, 0.0, 0.25, 0.1), graded(-0.8, 0.8, 0.25, 0.1))
    level.meshes["Shared/Plinth"] = (shaded(plinth, "Stone"),)
    planted: list[dict[str, Any]] = []
    for i, exhibit in enumerate(exhibits()):
        middle = (FIRST_X + STEP * i, PLINTH_TOP, Z)
        folder = f"DarkCorner/{exhibit.name}"
        level.group(folder).translation = middle
        level.place_shared(f"{folder}/Plinth", "Shared/Plinth")
        level.place(f"{folder}/Label", (digit(i + 1),), translation=(0.0, GROUND - PLINTH_TOP, 1.25))
        for name, parts in exhibit.objects.items():
            level.place(f"{folder}/{name}", parts, translation=exhibit.shift.get(name, (0.0, 0.0, 0.0)))
        planted.append(_entry(exhibit, middle))
    return planted


def _entry(exhibit: Exhibit, middle: tuple[float, float, float]) -> dict[str, Any]:
    folder = f"Level/DarkCorner/{exhibit.name}"
    remedy = dict(exhibit.remedy)
    if "object" in remedy:
        remedy["object"] = f"{folder}/{remedy['object']}"
    return {
        "label": exhibit.name,
        "object": f"{folder}/{exhibit.dark}",
        "cause": exhibit.cause,
        "position": [round(m + s, 5) for m, s in zip(middle, exhibit.spot, strict=True)],
        "remedy": remedy,
        "why": exhibit.why,
    }
