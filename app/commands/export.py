"""`export RESULT FILE`: a result for other tools."""

from __future__ import annotations

import argparse
from pathlib import Path

from app.commands.console import note, say, say_json
from bake.types import BakeResult, Finding

USAGE = "RESULT FILE [--distance M] [--color] [--json]"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("result", type=Path, metavar="RESULT", help="a result folder")
    parser.add_argument("file", type=Path, metavar="FILE", help="its suffix decides the format")
    parser.add_argument(
        "--distance", type=float, metavar="M", help="which baked distance, for formats with one value (the longest)"
    )
    parser.add_argument("--color", action="store_true", help=".glb: write AO as COLOR_0 as well")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(arguments: argparse.Namespace) -> int:
    """Exports, and says what the format could not express.

    Raises:
        ObscuraError: see `bake.results.export.export`.
    """
    from bake.results import load_result

    result = load_result(arguments.result)
    findings = export_result(result, arguments.file, distance=arguments.distance, color=arguments.color)
    size = arguments.file.stat().st_size
    if arguments.json:
        warnings = [{"object": item.object, "what": item.what, "count": item.count} for item in findings]
        say_json({"file": str(arguments.file), "bytes": size, "warnings": warnings})
    else:
        for finding in findings:
            note(f"{finding.object}: {finding.detail}")
        say(f"{arguments.file}: {size / 1e6:.1f} MB")
    return 0


def export_result(
    result: BakeResult, path: Path, *, distance: float | None = None, color: bool = False
) -> tuple[Finding, ...]:
    """Exports, loading the scene again if the format keeps its document.

    Raises:
        ObscuraError: see `bake.results.export.export` and `bake.scene.load_scene`.
    """
    from bake.results.export import export, needs_scene

    scene = None
    if needs_scene(result, path):
        from bake.scene import load_scene

        scene = load_scene(result.scene_path, crease_angle=result.settings.crease_angle)
    return export(result, path, distance=distance, color=color, scene=scene)
