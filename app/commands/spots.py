"""`spots RESULT`: where a bake is suspicious, the gravest places first."""

from __future__ import annotations

import argparse
import fnmatch
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.commands.console import say, say_json
from bake.errors import InputError
from bake.explain.cause_names import CauseKind

if TYPE_CHECKING:
    from bake.explain.cause_types import Cause
    from bake.explain.spots import Spots
    from bake.types import BakeResult

USAGE = "RESULT [--distance M] [--object PATTERN] [--cause NAME] [--most N] [--look] [--measure N] [--json]"

MOST = 25


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("result", type=Path, metavar="RESULT", help="a result folder")
    parser.add_argument("--distance", type=float, metavar="M",
                        help="look at the AO of the nearest baked distance; the shortest by default")  # fmt: skip
    parser.add_argument("--object", metavar="PATTERN", help="only on objects whose path matches this glob")
    parser.add_argument("--cause", metavar="NAME", choices=[str(kind) for kind in CauseKind],
                        help="only with this likeliest cause")  # fmt: skip
    parser.add_argument("--most", type=int, default=MOST, metavar="N", help=f"spots to list ({MOST})")
    parser.add_argument("--look", action="store_true",
                        help="send some rays from every spot: those that nobody can see sink to the end")  # fmt: skip
    parser.add_argument("--measure", type=int, default=0, metavar="N",
                        help="measure the causes of the first N spots by rays, instead of guessing (0)")  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(arguments: argparse.Namespace) -> int:
    """Lists the spots.

    Raises:
        ObscuraError: no result, or nothing here can trace.
    """
    from bake.explain.spot_looks import look_at_spots
    from bake.explain.spots import find_spots
    from bake.results import load_result

    if arguments.distance is not None and not (math.isfinite(arguments.distance) and arguments.distance > 0.0):
        raise InputError(f"{arguments.distance} is no distance", where="--distance", remedy="use metres above 0")
    if arguments.most < 0 or arguments.measure < 0:
        raise InputError("a number below 0", where="--most, --measure", remedy="use 0 or more")
    result = load_result(arguments.result)
    spots = find_spots(result, distance=arguments.distance)
    if arguments.look:
        spots = look_at_spots(result, spots)
    chosen = [row for row in range(len(spots)) if _on_object(result, spots, row, arguments.object)]
    measured = _measured(result, spots, chosen[: arguments.measure])
    kinds = {row: causes[0].kind for row, causes in measured.items()}
    if arguments.cause is not None:
        chosen = [row for row in chosen if kinds.get(row, spots.guess[row]) == arguments.cause]
    rows = [_row(result, spots, row, measured.get(row)) for row in chosen[: arguments.most]]
    if arguments.json:
        say_json({"distance": spots.distance, "found": len(chosen), "seconds": spots.seconds, "spots": rows})
        return 0
    say(f"{len(chosen):,} suspicious spots, AO at {spots.distance:g} m")
    if rows:
        say("  grave    AO  usual    area m²  cause")
    for row in rows:
        x, y, z = row["centre"]
        guessed = "" if row["measured"] else "?"
        say(
            f"  {row['severity']:5.2f} {row['value']:5.2f}  {row['usual']:5.2f} {row['area_m2']:10.3g}  "
            f"{row['cause']}{guessed}  {row['vertex']} at {x:.2f},{y:.2f},{z:.2f}"
        )
    return 0


def _on_object(result: BakeResult, spots: Spots, row: int, pattern: str | None) -> bool:
    path = result.world.object_paths[spots.object[row]]
    return pattern is None or pattern == path or fnmatch.fnmatchcase(path, pattern)


def _measured(result: BakeResult, spots: Spots, rows: list[int]) -> dict[int, tuple[Cause, ...]]:
    if not rows:
        return {}
    from bake.explain.causes import name_causes
    from bake.explain.explainer import Explainer

    with Explainer(result) as explainer:
        return {
            row: name_causes(explainer, explainer.explain_vertex(int(spots.vertex[row])), distance=spots.distance)
            for row in rows
        }


def _row(result: BakeResult, spots: Spots, row: int, causes: tuple[Cause, ...] | None) -> dict[str, Any]:
    world, number, vertex = result.world, int(spots.object[row]), int(spots.vertex[row])
    return {
        "object": world.object_paths[number],
        "vertex": f"{world.object_paths[number]}:{vertex - int(world.first_vertex[number])}",
        "centre": (spots.centre[row] + world.origin).tolist(),
        "radius_m": float(spots.radius[row]),
        "vertices": int(spots.vertices[row]),
        "area_m2": float(spots.area[row]),
        "severity": float(spots.severity[row]),
        "value": float(spots.value[row]),
        "usual": float(spots.usual[row]),
        "seen": None if spots.seen is None else float(spots.seen[row]),
        "unseen": None if spots.unseen is None else bool(spots.unseen[row]),
        "signs": list(spots.signs_of(row)),
        "cause": str(spots.guess[row] if causes is None else causes[0].kind),
        "measured": causes is not None,
        "causes": [] if causes is None else [cause.to_json() for cause in causes],
    }
