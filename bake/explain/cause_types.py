"""What is said about a spot: a cause, how sure, what was measured, and what would mend it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from bake.explain.cause_names import CauseKind

Keys = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Remedy:
    """Something that would change the spot.

    Attributes:
        kind: "role", "two-sided", "weld", "normals", "winding", "offset", "samples", "alpha", "setting", or "model"
            for what only a modelling program can do.
        text: What to do, one sentence.
        objects: Keys by object path, as the side file's `[[object]]` rules have them.
        options: Options of the side file's `[bake]` by long name.
    """

    kind: str
    text: str
    objects: Mapping[str, Keys] = field(default_factory=dict[str, Keys])
    options: Keys = field(default_factory=dict[str, Any])

    @property
    def writes(self) -> bool:
        """Whether the side file can say it, so that it can be previewed and applied."""
        return bool(self.objects or self.options)

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "kind": self.kind,
            "text": self.text,
            "objects": {path: dict(keys) for path, keys in self.objects.items()},
            "options": dict(self.options),
        }


@dataclass(frozen=True, slots=True)
class Cause:
    """One possible cause of a spot's darkness.

    Attributes:
        kind: Which.
        confidence: In [0, 1].
        evidence: What speaks for it, in sentences with numbers.
        numbers: The measured figures by name; lengths in metres, shares in [0, 1].
        remedies: What would change it, the best first; empty for the true crevice.
        culprit: Index of the object that it lies with, -1 if with none.
    """

    kind: CauseKind
    confidence: float
    evidence: str
    numbers: Mapping[str, float]
    remedies: tuple[Remedy, ...] = ()
    culprit: int = -1

    def to_json(self) -> dict[str, Any]:
        """As `explain --json` prints it."""
        return {
            "cause": str(self.kind),
            "confidence": round(self.confidence, 3),
            "evidence": self.evidence,
            "remedy": self.remedies[0].to_json() if self.remedies else None,
            "remedies": [remedy.to_json() for remedy in self.remedies],
            "numbers": {name: round(float(value), 6) for name, value in self.numbers.items()},
        }


def certainty(value: float, low: float, high: float) -> float:
    """0 up to `low`, 1 from `high` on, a straight line between; `high` may be the smaller."""
    return float(min(max((value - low) / (high - low), 0.0), 1.0))


def darker(value: float, light: float, by: float) -> float:
    """How far a value is darker than what light there should be, as certainty in [0, 1].

    Half certain at a difference of `by` where AO should be 0.6 or more; in places that get little light anyway, smaller
    differences are as bad, down to 0.4 of that.
    """
    scale = by * min(max(light / 0.6, 0.4), 1.0)
    return certainty(light - value, 0.5 * scale, 1.5 * scale)


def percent(share: float) -> str:
    """A share for people."""
    return f"{100.0 * share:.0f} %"
