"""The tables that a comparison of bakers prints: every bake, and how much sooner we come as far."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bake.bench.front import GATED, Front, FrontRow
from bake.bench.table import Measurements

RMSE_TO_REACH = 0.072
RMSE_AT_LAST = 0.052
LEAD = 50.0
"""On the comparison field: how many times sooner than Cycles the first error is reached, and the error got to."""


def tables(fronts: Sequence[Front]) -> list[Measurements]:
    """Every bake of every scene; and how much sooner we come as far as Cycles."""
    rows = [
        {
            "scene": row.scene,
            "baker": row.baker,
            "effort": row.effort,
            "seconds": row.seconds,
            "RMSE": row.rmse,
            "area RMSE": row.area_rmse,
            "99.9 %": row.p999,
            "kinks (codes)": row.banding,
            "on the front": _on_front(row, front.rows),
        }
        for front in fronts
        for row in front.rows
    ]
    notes = [
        f"{front.scene}: greatest distance {front.distance:g} m, seed {front.seed}; the best piecewise linear AO has "
        f"an error of {front.floor:.4f} and kinks of {front.floor_banding:.2f} codes; the reference is good to "
        f"{front.reference_error:.5f}"
        for front in fronts
    ]
    notes.append("bakers that know no greatest distance are compared with a reference that has none either")
    return [Measurements("time against error", rows, notes), _leads(fronts)]


def _on_front(row: FrontRow, rows: Sequence[FrontRow]) -> bool:
    rivals = [other for other in rows if other.bounded == row.bounded]
    return not any(
        other.seconds <= row.seconds
        and other.rmse <= row.rmse
        and (other.seconds, other.rmse) != (row.seconds, row.rmse)
        for other in rivals
    )


def _leads(fronts: Sequence[Front]) -> Measurements:
    rows: list[Mapping[str, Any]] = []
    for front in fronts:
        own = [row for row in front.rows if row.baker == "Obscura"]
        final = next((row for row in own if row.effort == "preset final"), None)
        least = min((row.rmse for row in own), default=float("nan"))
        if final is not None:
            bound = float(np.hypot(1.0 / 255.0, front.floor))
            rows.append(
                {
                    "scene": front.scene,
                    "what": "final preset against 1/255 and the mapping's floor",
                    "RMSE": final.rmse,
                    "at most": 1.0 / 255.0 + front.floor,
                    "root of squares": bound,
                    "passed": final.rmse <= 1.0 / 255.0 + front.floor,
                }
            )
        for name in dict.fromkeys(row.baker for row in front.rows if row.baker != "Obscura" and row.bounded):
            theirs = [row for row in front.rows if row.baker == name]
            gated = front.scene == GATED and name.startswith("Blender")
            target = max(min(row.rmse for row in theirs), RMSE_TO_REACH if gated else 0.0)
            # They are timed where they first come within one part in a hundred of the best they get to.
            their_seconds = min(row.seconds for row in theirs if row.rmse <= 1.01 * target)
            fast = [row for row in own if row.rmse <= target]
            our_seconds = min((row.seconds for row in fast), default=float("inf"))
            lead = their_seconds / our_seconds
            gate = {"passed": lead >= LEAD and least <= RMSE_AT_LAST} if gated else {}
            rows.append(
                {
                    "scene": front.scene,
                    "what": f"lead over {name}",
                    "RMSE": target,
                    "their seconds": their_seconds,
                    "our seconds": our_seconds,
                    "lead": lead,
                    "our least RMSE": least,
                    **gate,
                }
            )
    return Measurements(
        "leads",
        rows,
        [
            f"gate on the comparison field: {LEAD:g} times sooner than Cycles at {RMSE_TO_REACH:g}, and an error of at "
            f"most {RMSE_AT_LAST:g} at last"
        ],
    )
