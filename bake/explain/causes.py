"""Why a spot is dark: every known cause is tested against what was measured, and ranked."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from bake.explain.cause_names import CauseKind
from bake.explain.cause_types import Cause
from bake.explain.evidence import Evidence, gather
from bake.explain.explainer import Explainer
from bake.explain.geometry_causes import against_face, coplanar_twin, enclosing_shell, one_layer, wrong_length
from bake.explain.mapping_causes import below_plane, buried, leak, overshoot, split_seam, starved
from bake.explain.suspect import Suspect
from bake.explain.types import Explanation

TESTS: tuple[Callable[[Suspect], Cause | None], ...] = (
    against_face,
    below_plane,
    buried,
    coplanar_twin,
    enclosing_shell,
    leak,
    one_layer,
    overshoot,
    split_seam,
    starved,
    wrong_length,
)

IMPLIES = {
    CauseKind.UNIT: (CauseKind.BURIED, CauseKind.TWIN, CauseKind.SHEET, CauseKind.SEAM, CauseKind.STARVED),
    CauseKind.AGAINST_FACE: (CauseKind.SHEET, CauseKind.BURIED),
    CauseKind.TWIN: (CauseKind.SHEET,),
    CauseKind.BURIED: (CauseKind.STARVED,),
}
"""Causes that look like others: rays that start inside something see what samples inside it would see."""

SUREST = 0.97
"""What a test is worth that fits in every respect: another cause may look the same."""

UNLIKELY = 0.05
"""Causes of less confidence are not mentioned."""


def name_causes(explainer: Explainer, explanation: Explanation, *, distance: float | None = None) -> tuple[Cause, ...]:
    """The causes that fit, the likeliest first; that nothing is wrong is always among them.

    Args:
        explainer: That made the explanation.
        explanation: Of a spot.
        distance: The baked distance nearest to this one, in metres, is looked at; the shortest if None.

    Raises:
        DeviceError: nothing here can trace.
    """
    distances = np.asarray(explanation.distances)
    column = int(np.argmin(distances if distance is None else np.abs(distances - distance)))
    receiving = np.flatnonzero(explainer.mapper.surface.row >= 0)
    return judge(explainer, gather(explainer, explanation, column, receiving))


def judge(explainer: Explainer, evidence: Evidence) -> tuple[Cause, ...]:
    """The causes that fit what was measured, the likeliest first."""
    suspect = Suspect(explainer, evidence)
    found = [cause for test in TESTS if (cause := test(suspect)) is not None and cause.confidence > UNLIKELY]
    found = _explained_away(found)
    found.append(_crevice(evidence, max((cause.confidence for cause in found), default=0.0)))
    return tuple(sorted(found, key=lambda cause: -cause.confidence))


def _explained_away(found: list[Cause]) -> list[Cause]:
    """With less confidence in those that another cause implies."""
    sure = {cause.kind: cause.confidence for cause in found}
    kept: list[Cause] = []
    for cause in found:
        other = max((sure.get(kind, 0.0) for kind, implied in IMPLIES.items() if cause.kind in implied), default=0.0)
        kept.append(replace(cause, confidence=SUREST * cause.confidence * (1.0 - 0.8 * other)))
    return [cause for cause in kept if cause.confidence > UNLIKELY]


def _crevice(evidence: Evidence, strongest: float) -> Cause:
    """That the spot is as dark as it looks, as far as nothing else explains it."""
    agrees = 1.0 - min(max(abs(evidence.gap) - 0.05, 0.0) / 0.3, 0.8)
    text = (
        f"Seen from the spot itself, AO is {evidence.seen:.2f}; baked is {evidence.value:.2f}. "
        f"{evidence.valid} samples around are valid and their rays strike "
        f"{100.0 * float(evidence.front.from_behind.mean()):.0f} % backs."
    )
    numbers = {"seen": evidence.seen, "value": evidence.value, "gap": evidence.gap}
    return Cause(CauseKind.CREVICE, (1.0 - strongest) * agrees, text, numbers)
