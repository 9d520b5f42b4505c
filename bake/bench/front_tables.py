"""The tables that a comparison of bakers prints: every bake, and how much sooner we come as far."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from bake.bench.front import GATED, Front, FrontRow
from bake.bench.peers import CYCLES
from bake.bench.table import Measurements

RMSE_TO_REACH, RMSE_AT_LAST = 0.072, 0.052
LEAD = 50.0
"""On the comparison field: how many times sooner than Cycles the first error is reached, and the one got to at last.
Cycles' least error hangs on how back faces are counted, so the lead is asked for there as well."""


def tables(front: Front) -> list[Measurements]:
    """Every bake of a scene; and how much sooner we come as far as the others."""
    rows = [
        {
            "baker": row.baker,
            "effort": row.effort,
            "seconds": row.seconds,
            "RMSE": row.rmse,
            "99.9 %": row.p999,
            "RMSE, of all rays": row.all_rays_rmse,
            "RMSE, faces too": row.mixed_rmse,
            "kinks (codes)": row.banding,
            "on the front": _on_front(row, front.rows),
        }
        for row in front.rows
    ]
    notes = [
        f"greatest distance {front.distance:g} m, seed {front.seed}; the best piecewise linear AO has an error of "
        f"{front.floor:.4f} ({front.mixed_floor:.4f}) and kinks of "
        f"{front.floor_banding:.2f} codes; the reference is good to {front.reference_error:.5f}",
        "RMSE and 99.9 %: at points spread by area; faces too: half of the points spread evenly over the faces",
        "points whose reference sees over 25 % back faces do not count: of what its rays hit, or where the column says "
        "so of all its rays",
        _counted(front),
        "bakes of ours under 5 seconds: median of three",
    ]
    if not all(row.bounded for row in front.rows):
        notes.append("bakers that know no greatest distance are compared with a reference that has none either")
    seeds = {"bakes": front.seed, "reference": (front.seed + 1) % 2**32}
    first = Measurements(f"time against error: {front.scene}", rows, notes, seeds=seeds, settings=front.options)
    return [first, _leads(front, seeds)]


def _counted(front: Front) -> str:
    more = front.all_rays_points - front.points
    said = f"{front.points:,} points by area count, of all rays {more:,} more"
    return said if front.buried_points is None else f"{said}, {front.buried_points:,} of them on props under the ground"


def _on_front(row: FrontRow, rows: Sequence[FrontRow]) -> bool:
    rivals = [other for other in rows if other.bounded == row.bounded]
    return not any(
        other.seconds <= row.seconds
        and other.rmse <= row.rmse
        and (other.seconds, other.rmse) != (row.seconds, row.rmse)
        for other in rivals
    )


def _leads(front: Front, seeds: Mapping[str, int]) -> Measurements:
    own = [row for row in front.rows if row.baker == "Obscura"]
    rows: list[Mapping[str, Any]] = []
    for name in dict.fromkeys(row.baker for row in front.rows if row.baker != "Obscura" and row.bounded):
        rows += _leads_over(name, front, own, _by_hits)
    for name in dict.fromkeys(row.baker for row in front.rows if row.baker.startswith(f"{CYCLES} ")):
        rows += _leads_over(name, front, own, _by_all_rays)
    rows += _finals(front, own)
    note = (
        f"gates on the comparison field: {LEAD:g} times sooner where {CYCLES} gets no further, and at "
        f"{RMSE_TO_REACH:g}; an error of at most {RMSE_AT_LAST:g} at last; by either count of back faces"
    )
    final = "gate everywhere: the final preset within 1/255 of the best piecewise linear AO"
    notes = [note, final] if front.scene == GATED else [final]
    return Measurements(f"leads: {front.scene}", rows, notes, seeds=seeds, settings=front.options)


def _by_hits(row: FrontRow) -> float:
    return row.rmse


def _by_all_rays(row: FrontRow) -> float:
    return row.all_rays_rmse


def _leads_over(
    name: str, front: Front, own: Sequence[FrontRow], error_of: Callable[[FrontRow], float]
) -> Iterator[Mapping[str, Any]]:
    """Leads at every effort of a baker; where it has a gate, where it gets no further, and at the error to reach."""
    theirs = [row for row in front.rows if row.baker == name]
    best = min(error_of(row) for row in theirs)
    gated = front.scene == GATED and name.startswith(f"{CYCLES} ")
    count = ", of all rays" if error_of is _by_all_rays else ""
    for row in theirs:
        what = f"as good as {name}, {row.effort}{count}"
        yield _lead(what, own, row, error_of(row), error_of, gated=gated and error_of(row) == best)
    first = next((row for row in theirs if error_of(row) <= RMSE_TO_REACH), None)
    if gated and first is not None:
        what = f"at {RMSE_TO_REACH:g}, against {name}, {first.effort}{count}"
        yield _lead(what, own, first, RMSE_TO_REACH, error_of, gated=True)


def _lead(
    what: str,
    own: Sequence[FrontRow],
    theirs: FrontRow,
    error: float,
    error_of: Callable[[FrontRow], float],
    *,
    gated: bool,
) -> Mapping[str, Any]:
    """How much sooner than a bake of another's ours comes to an error."""
    fast = min((row for row in own if error_of(row) <= error), key=lambda row: row.seconds, default=None)
    least = min((error_of(row) for row in own), default=None)
    lead = None if fast is None else theirs.seconds / fast.seconds
    found: dict[str, Any] = {
        "what": what,
        "RMSE": error,
        "their seconds": theirs.seconds,
        "our seconds": None if fast is None else fast.seconds,
        "our bake": None if fast is None else fast.effort,
        "lead": lead,
        "our least RMSE": least,
    }
    if gated:
        found["passed"] = lead is not None and lead >= LEAD and least is not None and least <= RMSE_AT_LAST
    return found


def _finals(front: Front, own: Sequence[FrontRow]) -> Iterator[Mapping[str, Any]]:
    final = next((row for row in own if row.effort == "preset final"), None)
    if final is None:
        return
    for where, error, floor in (
        ("by area", final.rmse, front.floor),
        ("faces too", final.mixed_rmse, front.mixed_floor),
    ):
        bound = 1.0 / 255.0 + floor
        what = f"final preset, points {where}: at most 1/255 above {floor:.4f}"
        yield {"what": what, "RMSE": error, "at most": bound, "passed": error <= bound}
