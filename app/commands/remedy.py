"""`remedy RESULT (--vertex OBJECT:I | --point X,Y,Z)`: what would mend a spot, previewed, and written on request."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from app.commands.console import say, say_json
from app.commands.explain import point_of
from bake.errors import InputError

if TYPE_CHECKING:
    from bake.explain.cause_types import Cause, Remedy
    from bake.explain.preview import Preview

USAGE = "RESULT (--vertex OBJECT:I | --point X,Y,Z) [--apply N] [--json]"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("result", type=Path, metavar="RESULT", help="a result folder")
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("--vertex", metavar="OBJECT:I", help="vertex I of an object, counted from 0")
    where.add_argument("--point", metavar="X,Y,Z", help="the nearest point of the surface to this one, in metres")
    parser.add_argument("--apply", type=int, metavar="N", help="write remedy N into the scene's side file")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(arguments: argparse.Namespace) -> int:
    """Lists the remedies of a spot with what each would make of it, or writes one.

    Raises:
        ObscuraError: no result, no such spot or remedy, the scene has changed since, or it cannot be written.
    """
    from bake.explain.causes import name_causes
    from bake.explain.explainer import Explainer
    from bake.explain.preview import Previewer
    from bake.explain.remedies import apply_remedy
    from bake.explain.spot import named_vertex
    from bake.results import load_result

    result = load_result(arguments.result)
    with Explainer(result) as explainer:
        if arguments.vertex is not None:
            explanation = explainer.explain_vertex(named_vertex(result.world, arguments.vertex))
        else:
            explanation = explainer.explain_point(point_of(arguments.point) - result.world.origin)
        causes = name_causes(explainer, explanation)
        offered = [(cause, remedy) for cause in causes for remedy in cause.remedies]
        if arguments.apply is not None:
            _, remedy = _chosen(offered, arguments.apply)
            edit = apply_remedy(result.scene_path, remedy)
            if arguments.json:
                say_json({"applied": remedy.to_json(), "file": str(edit.path)})
            else:
                say(f"{edit.path} now says: {remedy.text}")
            return 0
        previewer = Previewer(explainer)
        previews = [previewer.preview(explanation.spot, remedy) if remedy.writes else None for _, remedy in offered]
    rows = [
        _row(number, cause, remedy, preview)
        for number, ((cause, remedy), preview) in enumerate(zip(offered, previews, strict=True), start=1)
    ]
    if arguments.json:
        say_json({"value": explanation.value.tolist(), "distances": list(explanation.distances), "remedies": rows})
        return 0
    say("AO " + _values(explanation.value, explanation.distances))
    for row, preview in zip(rows, previews, strict=True):
        after = "" if preview is None else f" → AO {_values(preview.after, preview.distances)}"
        say(f"  {row['number']}. {row['remedy']['text']} ({row['cause']}, {100 * row['confidence']:.0f} %){after}")
    if not rows:
        say("  nothing to mend: " + causes[0].evidence)
    return 0


def _chosen(offered: list[tuple[Cause, Remedy]], number: int) -> tuple[Cause, Remedy]:
    if not 1 <= number <= len(offered):
        raise InputError(f"no remedy {number}", where="--apply", remedy=f"there are {len(offered)}")
    return offered[number - 1]


def _row(number: int, cause: Cause, remedy: Remedy, preview: Preview | None) -> dict[str, Any]:
    after = None if preview is None else [None if np.isnan(value) else float(value) for value in preview.after]
    return {
        "number": number,
        "cause": str(cause.kind),
        "confidence": cause.confidence,
        "remedy": remedy.to_json(),
        "after": after,
        "distances": None if preview is None else list(preview.distances),
        "seconds": None if preview is None else preview.seconds,
    }


def _values(values: np.ndarray, distances: tuple[float, ...]) -> str:
    return ", ".join(
        f"none at {distance:g} m" if np.isnan(value) else f"{value:.3f} at {distance:g} m"
        for value, distance in zip(values, distances, strict=True)
    )
