"""`regions RESULT …`: lists, checks and exports the dynamic regions of a result."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from app.commands.console import note, say, say_json
from bake.types import BakeResult

USAGE = "RESULT [--check] [--export FILE] [--write FILE.json] [--json]"
_MOST_LINKS = 20  # on the terminal; JSON has them all


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("result", type=Path, metavar="RESULT", help="a result folder")
    parser.add_argument("--check", action="store_true", help="say what is wrong with them; exit 1 if anything is")
    parser.add_argument(
        "--export",
        type=Path,
        metavar="FILE",
        help="write the packed models for an engine (.json), or the code that evaluates them (.glsl, .hlsl)",
    )
    parser.add_argument(
        "--weights", metavar="W,…", help="--export: share of each distance in the one function (the longest alone)"
    )
    parser.add_argument("--write", type=Path, metavar="FILE.json", help="write boxes and links as a region file")
    parser.add_argument("--validity", action="store_true", help="--write: with the 512 validity bits of each region")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(arguments: argparse.Namespace) -> int:
    """Lists the regions, or does with them what was asked for.

    Raises:
        ObscuraError: no result, one without regions, or a file that could not be written.
    """
    from app.commands.region_figures import regions_content
    from bake.regions.check import check_regions
    from bake.regions.packed_file import no_regions
    from bake.results import load_result

    result = load_result(arguments.result)
    if result.regions is None:
        raise no_regions(str(arguments.result))
    written = _write_files(result, arguments)
    problems = check_regions(result.regions) if arguments.check else ()
    if arguments.json:
        content: dict[str, Any] = {"result": str(arguments.result), **regions_content(result), "files": written}
        if arguments.check:
            content["problems"] = [
                {"object": item.object, "what": item.what, "severity": item.severity, "detail": item.detail}
                for item in problems
            ]
        say_json(content)
    elif arguments.check:
        for item in problems:
            say(f"{item.severity}: {item.object}: {item.detail}")
        if not problems:
            say(f"{len(result.regions.graph):,} regions: nothing is wrong with them")
    elif not written:
        say(_table(result, regions_content(result)))
    return 1 if any(item.severity == "warning" for item in problems) else 0


def _write_files(result: BakeResult, arguments: argparse.Namespace) -> list[dict[str, Any]]:
    """Writes what was asked for; what was there is replaced only once it is whole."""
    from bake.region_types import PointState
    from bake.regions.packed_file import packed_text
    from bake.regions.region_file import write_region_file
    from bake.results.storage import replacing

    written: list[dict[str, Any]] = []
    if arguments.export is not None:
        text = packed_text(result, arguments.export, weights=_weights(arguments.weights))
        with replacing(arguments.export) as file:
            file.write(text.encode())
        written.append(_written(arguments.export))
    if arguments.write is not None:
        assert result.regions is not None
        reachable = np.asarray(result.regions.points.state) != PointState.UNREACHABLE
        write_region_file(
            arguments.write,
            result.regions.graph,
            origin=result.world.origin,
            valid=reachable if arguments.validity else None,
        )
        written.append(_written(arguments.write))
    if not arguments.json:
        for item in written:
            note(f"{item['file']}: {item['bytes'] / 1e3:.1f} kB")
    return written


def _written(path: Path) -> dict[str, Any]:
    return {"file": str(path), "bytes": path.stat().st_size}


def _weights(text: str | None) -> list[float] | None:
    from bake.errors import SettingsError

    if text is None:
        return None
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise SettingsError(
            f"{text!r} is no list of numbers", where="--weights", remedy="e.g. --weights 0.03,0.97"
        ) from None


def _table(result: BakeResult, content: dict[str, Any]) -> str:
    """Regions, then the links with the largest steps."""
    regions, links = content["regions"], content["links"]
    width = max((len(item["name"]) for item in regions), default=6)
    lines = [f"{'region':{width}}  {'points':>6}  {'error':>6}  {'regularised':>11}  {'centre':>9}  {'bytes':>5}"]
    for item in regions:
        told = item["absorbed_by"]
        lines.append(
            f"{item['name']:{width}}  {item['valid_points']:>6}  {_number(item['fit_rmse']):>6}  "
            f"{_number(item['regularised_rmse']):>11}  {item['centre_kind']:>9}  {item['bytes']:>5}"
            + (f"  uses the model of {told}" if told else "")
        )
    worst = sorted(links, key=lambda item: -(item["mismatch_after"] or 0.0))[:_MOST_LINKS]
    if worst:
        names = [f"{item['a']} – {item['b']}" for item in worst]
        width = max(len(name) for name in names)
        lines += ["", f"{'boundary':{width}}  {'area m²':>8}  {'step':>6}  {'regularised':>11}"]
        lines += [
            f"{name:{width}}  {item['area']:>8.2f}  {_number(item['mismatch_before']):>6}  "
            f"{_number(item['mismatch_after']):>11}"
            for name, item in zip(names, worst, strict=True)
        ]
        if len(links) > len(worst):
            lines.append(f"… and {len(links) - len(worst):,} more with smaller steps; --json lists them all")
    total = sum(item["bytes"] for item in regions)
    lines += ["", f"{len(regions):,} regions, {len(links):,} links, {total / 1e3:.1f} kB for one function of linear SH"]
    return "\n".join(lines)


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.3f}"
