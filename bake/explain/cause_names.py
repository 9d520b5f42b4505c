"""The causes of dark spots: their stable names, and what they are called to people."""

from __future__ import annotations

import enum


class CauseKind(enum.StrEnum):
    """Why a spot is dark; the value is what `explain --json` prints."""

    BURIED = "buried-in-geometry"
    BELOW_PLANE = "below-plane-rays"
    AGAINST_FACE = "normal-against-face"
    TWIN = "coplanar-twin"
    STARVED = "starved-of-samples"
    OVERSHOOT = "sliver-overshoot"
    SEAM = "split-seam"
    SHELL = "enclosing-shell"
    UNIT = "wrong-unit-or-offset"
    SHEET = "thin-sheet"
    CREVICE = "true-crevice"

    @property
    def heading(self) -> str:
        """A few words for a heading."""
        return _TITLES[self]

    @property
    def meaning(self) -> str:
        """One sentence for a tooltip."""
        return _MEANINGS[self]

    @property
    def is_defect(self) -> bool:
        """Whether anything is wrong at all."""
        return self is not CauseKind.CREVICE


_TITLES = {
    CauseKind.BURIED: "Buried in other geometry",
    CauseKind.BELOW_PLANE: "Normals lean away from the surface",
    CauseKind.AGAINST_FACE: "Normals and faces disagree",
    CauseKind.TWIN: "Coplanar twin",
    CauseKind.STARVED: "Starved of samples",
    CauseKind.OVERSHOOT: "Overshoot at slivers",
    CauseKind.SEAM: "Split seam",
    CauseKind.SHELL: "Inside a closed shell",
    CauseKind.UNIT: "Wrong unit or offset",
    CauseKind.SHEET: "Thin sheet, or a leak",
    CauseKind.CREVICE: "Rightly dark",
}

_MEANINGS = {
    CauseKind.BURIED: "Part of this surface lies inside something whose backs count as proper surface; the darkness in "
    "there reaches what can be seen.",
    CauseKind.BELOW_PLANE: "The vertex normals lean so far that many rays would start into the surface; they are "
    "mirrored, and look at something else than the surface does.",
    CauseKind.AGAINST_FACE: "The triangles show to one side and their normals to the other, so the rays leave on the "
    "wrong side.",
    CauseKind.TWIN: "Another surface lies in or just before this one: both share a value, or one covers the other.",
    CauseKind.STARVED: "Hardly any valid sample lies around here; the value comes from farther away.",
    CauseKind.OVERSHOOT: "Long thin triangles let the fit swing below what any sample says.",
    CauseKind.SEAM: "Vertices at the same place do not share a value: the AO ends in a hard line.",
    CauseKind.SHELL: "A closed surface around everything here blocks the light from all sides.",
    CauseKind.UNIT: "Lengths do not fit: the level's size against the distances, or the distance at which rays start.",
    CauseKind.SHEET: "One layer of triangles stands for both sides, or a face reaches under a wall: the value belongs "
    "to the other side.",
    CauseKind.CREVICE: "Nothing is wrong: the surfaces around are as close as they look.",
}
