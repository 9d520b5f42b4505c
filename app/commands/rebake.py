"""`rebake RESULT`: brings a result up to date with its scene, and bakes only what the changes can reach."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.commands.console import note, say, say_json
from app.commands.settings_options import add_settings_options, explicit_options

if TYPE_CHECKING:
    from bake.rebake.run import RebakeRun

USAGE = "RESULT [--scene SCENE] [--objects PATTERN,…] [-o RESULT2] [--bound B] [--json] [settings]"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("result", type=Path, metavar="RESULT", help="a result folder; replaced when done, without -o")
    parser.add_argument(
        "--scene", type=Path, metavar="SCENE", help="the scene as it is now; by default the file the result came from"
    )
    parser.add_argument(
        "--objects",
        metavar="PATTERN,…",
        default="",
        help="paths or patterns of the objects whose values may change; what else is reached is marked stale",
    )
    parser.add_argument("-o", "--output", type=Path, metavar="RESULT2", help="store the new result there instead")
    parser.add_argument(
        "--bound",
        metavar="B",
        default=None,
        help="most AO that may be skipped for a sample, over all rebakes since it was traced (1/512); 0 skips nothing",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of a table")
    add_settings_options(parser)


def run(arguments: argparse.Namespace) -> int:
    """Rebakes, and prints what was done.

    Raises:
        ObscuraError: see `bake.rebake.run.run_rebake`.
    """
    from app.commands.progress import drive
    from app.commands.summary import bake_summary
    from bake.rebake.run import RebakeRequest, run_rebake

    output = arguments.output or arguments.result
    request = RebakeRequest(
        result_path=arguments.result,
        output_path=output,
        scene_path=arguments.scene,
        objects=tuple(part for part in arguments.objects.split(",") if part),
        **({} if arguments.bound is None else {"bound": bound_of(arguments.bound)}),
        options=explicit_options(arguments),
    )
    done = drive(run_rebake(request))
    if arguments.json:
        figures = bake_summary(done.result, output, done.seconds)
        report = asdict(done.report)
        figures["rays"] = done.report.rays_traced + done.report.rays_elsewhere
        figures["rays_skipped"] = done.result.rays_skipped
        say_json({**figures, "rebake": report, "overruled": list(done.overruled)})
    else:
        for line in done.overruled:
            note(f"the side file asks for {line}; the result's settings stay: give the option to change them")
        say(rebake_text(done, output))
    return 0


def bound_of(text: str) -> float:
    """A bound as typed: a number or a fraction.

    Raises:
        InputError: it is none, or not from 0 to 1.
    """
    from bake.errors import InputError

    top, _, bottom = text.partition("/")
    try:
        value = float(top) / float(bottom) if bottom else float(top)
    except (ValueError, ZeroDivisionError):
        value = -1.0
    if not 0.0 <= value <= 1.0:
        raise InputError(f"{text!r} is no bound", where="--bound", remedy="use a number from 0 to 1, or 1/512")
    return value


def rebake_text(done: RebakeRun, path: Path) -> str:
    """What a rebake did, for people at a terminal."""
    from app.commands.progress import duration

    report = done.report
    lines = [f"{done.result.scene_path.name} → {path} in {duration(done.seconds)}"]
    if report.full:
        lines.append(f"  baked in full: {report.full}")
    rows: list[tuple[str, Any]] = [
        ("changed", _named(report.changed)),
        ("samples", f"{report.samples:,}; {report.samples_whole:,} whole, {report.samples_checked:,} looked at, "
                    f"{report.samples_changed:,} changed"),
        ("rays", f"{report.rays_traced:,} traced, {report.rays_changed:,} of them changed; "
                 f"{report.rays_elsewhere:,} elsewhere"),
        ("vertices", f"{report.vertices_changed:,} changed"),
        ("skipped", f"at most {report.bound:.5f} AO for a sample"),
    ]  # fmt: skip
    if report.voxels:
        rows.append(("voxels", f"{report.voxels:,}; {report.voxels_traced:,} traced"))
    if report.points:
        rows.append(("points", f"{report.points:,}; {report.points_traced:,} traced"))
    if report.stale:
        rows.append(("stale", _named(report.stale)))
    lines += [f"  {name:9} {text}" for name, text in rows]
    lines += [f"  {name:18} {seconds:8.2f} s" for name, seconds in report.stages.items()]
    lines += [f"  {name:18} {why}" for name, why in report.carried]
    return "\n".join(lines)


def _named(paths: tuple[str, ...]) -> str:
    shown = ", ".join(paths[:5])
    return f"{len(paths):,} objects: {shown}{' …' if len(paths) > 5 else ''}" if paths else "nothing"
