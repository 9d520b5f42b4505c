"""`explain RESULT (--vertex OBJECT:I | --point X,Y,Z)`: why a spot has its value."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from app.commands.console import say, say_json
from bake.errors import InputError

if TYPE_CHECKING:
    from bake.explain.cause_types import Cause
    from bake.explain.types import Explanation, SpotWithout
    from bake.types import BakeResult, Float64Array

USAGE = "RESULT (--vertex OBJECT:I | --point X,Y,Z) [--without OBJECT] [--json]"

SAMPLES = 50
"""Samples that --json lists unless told otherwise."""

LINES = 8
"""Rows of each list for people."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("result", type=Path, metavar="RESULT", help="a result folder")
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("--vertex", metavar="OBJECT:I", help="vertex I of an object, counted from 0")
    where.add_argument("--point", metavar="X,Y,Z", help="the nearest point of the surface to this one, in metres")
    parser.add_argument("--without", metavar="OBJECT", action="append", default=[],
                        help="also: the value if this object did not cast (may be repeated)")  # fmt: skip
    parser.add_argument("--samples", type=int, default=SAMPLES, metavar="N",
                        help=f"samples that --json lists, the heaviest first ({SAMPLES})")  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(arguments: argparse.Namespace) -> int:
    """Explains a spot.

    Raises:
        ObscuraError: no result, no such spot, or nothing here can trace.
    """
    from bake.explain.causes import name_causes
    from bake.explain.explainer import Explainer
    from bake.explain.spot import named_vertex, object_number
    from bake.results import load_result

    if arguments.samples < 0:
        raise InputError(f"{arguments.samples} samples", where="--samples", remedy="use 0 or more")
    result = load_result(arguments.result)
    vertex = None if arguments.vertex is None else named_vertex(result.world, arguments.vertex)
    point = None if arguments.point is None else point_of(arguments.point) - result.world.origin
    removed = [object_number(result.world, path, "--without") for path in arguments.without]
    with Explainer(result) as explainer:
        if vertex is not None:
            explanation = explainer.explain_vertex(vertex)
        else:
            assert point is not None
            explanation = explainer.explain_point(point)
        causes = name_causes(explainer, explanation)
        without = [explainer.spot_without(explanation.spot, number) for number in removed]
    moved = 0.0 if point is None else float(np.linalg.norm(point - explanation.spot.position))
    if arguments.json:
        say_json(to_json(result, explanation, causes, without, samples=arguments.samples, moved=moved))
    else:
        say(to_text(result, explanation, causes, without, moved=moved))
    return 0


def to_json(
    result: BakeResult,
    explanation: Explanation,
    causes: tuple[Cause, ...],
    without: list[SpotWithout],
    *,
    samples: int = SAMPLES,
    moved: float = 0.0,
) -> dict[str, Any]:
    """Everything as plain values; the shares add up to 1 - value."""
    spot, weighed, world = explanation.spot, explanation.samples, result.world
    hits, back_faces = result.tally.hits, result.tally.back_faces
    return {
        "value": explanation.value.tolist(),
        "distances": list(explanation.distances),
        "shares": [
            {
                "object": share.name,
                "kind": share.kind.value,
                "share": share.share.tolist(),
                "carried": share.carried.tolist(),
                "self": share.is_self,
                "rays": share.rays,
                "nearest_m": share.nearest if math.isfinite(share.nearest) else None,
            }
            for share in explanation.shares
        ],
        "samples": [
            {
                "index": int(weighed.index[row]),
                "object": world.object_paths[weighed.object[row]],
                "face": int(weighed.face[row] - world.first_face[weighed.object[row]]),
                "weight": float(weighed.weight[row]),
                "ao": weighed.ao[row].tolist(),
                "position": (weighed.position[row] + world.origin).tolist(),
                "distance_m": float(weighed.distance[row]),
                "own": bool(weighed.own[row]),
                "back_face_share": float(back_faces[weighed.index[row]] / max(int(hits[weighed.index[row]]), 1)),
            }
            for row in range(min(samples, len(weighed)))
        ],
        "causes": [cause.to_json() for cause in causes],
        "without": [
            {
                "object": world.object_paths[item.object],
                "before": item.before.tolist(),
                "after": item.after.tolist(),
                "is_estimate": item.is_estimate,
            }
            for item in without
        ],
        "spot": {
            "object": world.object_paths[spot.object],
            "vertices": [_vertex_name(result, vertex) for vertex in spot.vertices],
            "weights": spot.weights.tolist(),
            "position": (spot.position + world.origin).tolist(),
            "moved_m": moved,
            "filled": explanation.filled,
        },
        "carried": [
            {
                "object": world.object_paths[item.object],
                "nearest_m": item.nearest,
                "farthest_m": item.farthest,
                "weight": item.weight,
                "share": item.share.tolist(),
                "samples": item.samples,
            }
            for item in explanation.carried
        ],
        "held": [
            {
                "vertex": _vertex_name(result, item.vertex),
                "bound": [None if math.isnan(bound) else bound for bound in item.bound.tolist()],
                "effect": item.effect.tolist(),
            }
            for item in explanation.held
        ],
        "unbounded": explanation.unbounded.tolist(),
        "samples_total": len(weighed),
        "samples_traced": weighed.traced,
        "weight_sum": explanation.weight_sum,
        "cut_off": explanation.cut_off,
        "retrace_error": explanation.retrace_error,
        "seconds": explanation.seconds,
    }


def to_text(
    result: BakeResult,
    explanation: Explanation,
    causes: tuple[Cause, ...],
    without: list[SpotWithout],
    *,
    moved: float = 0.0,
) -> str:
    """The same for people."""
    spot, world = explanation.spot, result.world
    where = ", ".join(f"{number:.3f}" for number in spot.position + world.origin)
    name = _vertex_name(result, spot.vertices[0]) if spot.is_vertex else world.object_paths[spot.object]
    lines = [f"{name} at {where} m" + (f", {moved:.2g} m from the point given" if moved > 1e-3 else "")]
    lines.append(_row("AO", explanation.value, explanation.distances))
    if explanation.filled:
        lines.append("  no valid sample lies around it: filled from its surroundings")
    away = 1.0 - explanation.own_weight
    origin = "the faces around it" if spot.is_vertex else "its face"
    lines.append(
        f"  made of {len(explanation.samples):,} samples: {100 * explanation.own_weight:.0f} % of the weight on "
        f"{origin}, {100 * away:.0f} % brought from elsewhere by the fit"
    )
    lines += ["", "what takes away the rest of 1 (of that, brought from elsewhere):"]
    for share in explanation.shares[:LINES]:
        numbers = "  ".join(
            f"{value:+.3f} ({carried:+.3f})" for value, carried in zip(share.share, share.carried, strict=True)
        )
        near = f", nearest {_metres(share.nearest)}" if math.isfinite(share.nearest) else ""
        rays = f"  {share.rays:,} rays{near}" if share.rays else ""
        lines.append(f"  {numbers}  {share.name}{' (itself)' if share.is_self else ''}{rays}")
    if len(explanation.shares) > LINES:
        lines.append(f"  … and {len(explanation.shares) - LINES} more; --json lists all")
    if explanation.carried:
        lines += ["", "brought here by the fit:"]
        for item in explanation.carried[: LINES // 2]:
            lines.append(
                f"  {_signed(item.share)}  from {item.samples:,} samples on {world.object_paths[item.object]}, "
                f"{_metres(item.nearest)} to {_metres(item.farthest)} away"
            )
    lines += ["", "heaviest samples:", "  weight   AO" + " " * (7 * len(explanation.value) - 2) + "where"]
    for row in range(min(LINES, len(explanation.samples))):
        samples = explanation.samples
        ao = " ".join(f"{value:6.3f}" for value in samples.ao[row])
        lines.append(
            f"  {samples.weight[row]:+.3f}  {ao}  {_metres(samples.distance[row])} away on "
            f"{world.object_paths[samples.object[row]]}"
        )
    for item in without:
        estimate = " (estimate)" if item.is_estimate else ""
        changed = "  ".join(
            f"{before:.3f} → {after:.3f} at {distance:g} m"
            for before, after, distance in zip(item.before, item.after, explanation.distances, strict=True)
        )
        lines += ["", f"if {world.object_paths[item.object]} did not cast: {changed}{estimate}"]
    if causes:
        lines += ["", "causes:"]
        for cause in causes[: LINES // 2]:
            lines.append(f"  {100 * cause.confidence:3.0f} %  {cause.kind.heading}: {cause.evidence}")
            lines += [f"         remedy: {remedy.text}" for remedy in cause.remedies[:1]]
    return "\n".join(lines)


def point_of(text: str) -> Float64Array:
    """The point that `X,Y,Z` names, shape (3,), world metres.

    Raises:
        InputError: it is written otherwise.
    """
    parts = text.split(",")
    try:
        point = np.array([float(part) for part in parts])
    except ValueError:
        point = np.full(3, np.nan)
    if point.shape != (3,) or not np.isfinite(point).all():
        raise InputError(f"{text!r} is no point", where="--point", remedy="write X,Y,Z in metres, as 1.5,0,-3")
    return point


def _vertex_name(result: BakeResult, vertex: int) -> str:
    world = result.world
    number = int(np.searchsorted(world.first_vertex, vertex, side="right")) - 1
    return f"{world.object_paths[number]}:{vertex - world.first_vertex[number]}"


def _row(label: str, values: Float64Array, distances: tuple[float, ...]) -> str:
    return f"  {label}  " + "  ".join(f"{v:.3f} at {d:g} m" for v, d in zip(values, distances, strict=True))


def _signed(values: Float64Array) -> str:
    return "  ".join(f"{value:+.3f}" for value in values)


def _metres(length: float) -> str:
    if length < 0.01:
        return f"{1000 * length:.1f} mm"
    return f"{100 * length:.0f} cm" if length < 1.0 else f"{length:.3g} m"
