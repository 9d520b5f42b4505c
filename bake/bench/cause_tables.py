"""What was said of dark spots, as tables: confusion matrices, by kind of injection, and of the levels themselves."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bake.bench.table import Measurements
from bake.explain.cause_names import CauseKind

RIGHT, FALSE_ALARM = 0.9, 0.05


@dataclass(frozen=True, slots=True)
class Outcome:
    """What was said of one injection.

    Attributes:
        site: Name of the scene.
        cause, variant: What was injected.
        named: The cause that was named first.
        confidence: With what confidence.
        value, truth: Baked AO, and what is right.
    """

    site: str
    cause: CauseKind
    variant: str
    named: CauseKind
    confidence: float
    value: float
    truth: float


def confusion(outcomes: Sequence[Outcome], name: str, *, gated: bool = False, seeds: Mapping[str, int]) -> Measurements:
    """One row a cause that was injected, one column a cause that was named; the last row has the sums."""
    table: dict[CauseKind, Counter[CauseKind]] = defaultdict(Counter)
    for item in outcomes:
        table[item.cause][item.named] += 1
    rows: list[dict[str, Any]] = []
    for kind in CauseKind:
        count = table[kind].total()
        if count:
            named = {str(other): table[kind][other] or None for other in CauseKind}
            rows.append(
                {"injected": str(kind), **named, "placements": count, "right %": 100.0 * table[kind][kind] / count}
            )
    right = sum(counter[kind] for kind, counter in table.items())
    sound = table[CauseKind.CREVICE]
    alarms = 1.0 - sound[CauseKind.CREVICE] / max(sound.total(), 1)
    total: dict[str, Any] = {
        "injected": "all",
        "placements": len(outcomes),
        "right %": 100.0 * right / max(len(outcomes), 1),
        "crevices called a defect %": 100.0 * alarms,
    }
    if gated:
        total["passed"] = right >= RIGHT * len(outcomes) and alarms <= FALSE_ALARM
    rows.append(total)
    notes = ["rows: what was injected; columns: what was named first"]
    gates = f"gates: at least {100 * RIGHT:g} % right, at most {100 * FALSE_ALARM:g} % of true crevices called a defect"
    return Measurements(name, rows, [*notes, gates] if gated else notes, seeds=seeds)


def by_variant(outcomes: Sequence[Outcome], *, seeds: Mapping[str, int]) -> Measurements:
    """One row a kind of injection: how many were named rightly, with what confidence, and how dark they are."""
    groups: dict[tuple[str, str], list[Outcome]] = defaultdict(list)
    for item in outcomes:
        groups[str(item.cause), item.variant].append(item)
    rows = [
        {
            "injected": cause,
            "kind": variant,
            "placements": len(items),
            "right": sum(item.named is item.cause for item in items),
            "mean confidence": float(np.mean([item.confidence for item in items])),
            "mean AO baked": float(np.mean([item.value for item in items])),
            "mean AO mended": float(np.mean([item.truth for item in items])),
        }
        for (cause, variant), items in sorted(groups.items())
    ]
    return Measurements("kinds", rows, ["AO at the distance at which the defect shows"], seeds=seeds)


def of_the_levels(outcomes: Sequence[Outcome], *, seeds: Mapping[str, int]) -> Measurements:
    """One row a scene: what was said of dark spots that nobody planted."""
    rows: list[dict[str, Any]] = []
    for site in dict.fromkeys(item.site for item in outcomes):
        items = [item for item in outcomes if item.site == site]
        named = Counter(item.named for item in items)
        defects = len(items) - named[CauseKind.CREVICE]
        rows.append(
            {
                "scene": site,
                "spots": len(items),
                "called a defect": defects,
                "%": 100.0 * defects / len(items),
                "as": ", ".join(f"{count} {kind}" for kind, count in named.items() if kind.is_defect),
            }
        )
    notes = ["dark spots of the levels as they are, whose baked value is within 0.05 of what 1024 rays see"]
    told = [*notes, "levels have defects of their own, so this is no gate"]
    return Measurements("level spots", rows, told, seeds=seeds)
