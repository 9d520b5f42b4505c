"""An explanation in words and rows: the value, who takes it away, and what the fit carried here."""

from __future__ import annotations

import html

from bake.explain.types import Explanation, Share, ShareKind
from bake.settings import MappingKind
from viewer.fields import distance_label

_KIND_TIPS = {
    ShareKind.OBJECT: "Rays of the samples that make up this value end at this object",
    ShareKind.BOUNDS: "Values are held between 0 and 1; this is what that changes here",
    ShareKind.UNTRACED: "Samples of next to no weight, whose rays were not followed again",
    ShareKind.RESIDUAL: "Rounding, and the tolerance of the solver",
}

_KIND_NAMES = {
    ShareKind.BOUNDS: "bounds",
    ShareKind.UNTRACED: "untraced",
    ShareKind.RESIDUAL: "rounding",
}


def share_name(share: Share) -> str:
    """What a narrow row calls it: short where it is no object, and where it is the one that is explained."""
    if share.kind is not ShareKind.OBJECT:
        return f"({_KIND_NAMES[share.kind]})"
    return "(itself)" if share.is_self else share.name.rpartition("/")[2]


def headline(explanation: Explanation, column: int) -> str:
    """Value and darkness at one distance, as rich text."""
    value, label = explanation.value[column], distance_label(explanation.distances[column])
    return f"<b>AO {value:.3f}</b> at {label}: <b>{100.0 * (1.0 - value):.1f} %</b> of the surroundings are taken away"


def summary(explanation: Explanation, path: str, column: int) -> str:
    """What the value is made of, as rich text of a few lines."""
    samples = explanation.samples
    own = 100.0 * explanation.own_weight
    mapping = "least squares" if explanation.mapping is MappingKind.LEAST_SQUARES else "weighted average"
    lines = [
        f"{html.escape(path)}",
        f"{len(samples):,} samples by {mapping}; {own:.0f} % of the weight lies on the faces at this spot, "
        f"{100.0 - own:.0f} % was carried here from other faces",
    ]
    if explanation.filled:
        lines.append("<b>Filled:</b> no valid sample lies around this spot; the value comes from its neighbours")
    if explanation.held:
        gain = explanation.value[column] - explanation.unbounded[column]
        lines.append(f"Values held at 0 or 1 nearby change it by {gain:+.3f}")
    return "<br>".join(lines)


def share_tip(share: Share, column: int) -> str:
    """What a row of the table says at length."""
    parts = [_KIND_TIPS[share.kind]]
    if share.kind is ShareKind.OBJECT:
        parts.append(f"{share.rays:,} of the traced rays; {share.carried[column]:+.3f} came by samples on other faces")
    if share.is_self:
        parts.append("This is the object that the spot lies on")
    return ".\n".join(parts) + "."


def nearest_text(share: Share) -> str:
    """Distance of the nearest ray that an object stops."""
    if share.kind is not ShareKind.OBJECT or share.nearest == float("inf"):
        return "—"
    return f"{share.nearest:.2g} m" if share.nearest < 10.0 else f"{share.nearest:.0f} m"
