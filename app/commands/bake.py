"""`bake SCENE -o RESULT`: a bake without a window."""

from __future__ import annotations

import argparse
from pathlib import Path

from app.commands.console import say, say_json
from app.commands.settings_options import add_settings_options, explicit_options

USAGE = "SCENE -o RESULT [--json] [settings]"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("scene", type=Path, metavar="SCENE", help="a .glb, .gltf, .obj or .ply file")
    parser.add_argument(
        "-o", "--output", type=Path, metavar="RESULT", required=True, help="the result folder; replaced when done"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of a table")
    add_settings_options(parser)


def run(arguments: argparse.Namespace) -> int:
    """Bakes, and prints a summary.

    Raises:
        ObscuraError: see `bake.pipeline.run_bake`.
    """
    from app.commands.progress import drive
    from app.commands.summary import bake_summary, summary_text
    from bake.pipeline import BakeRequest, run_bake

    request = BakeRequest(arguments.scene, arguments.output, explicit_options(arguments))
    outcome = drive(run_bake(request))
    said = (outcome.result, arguments.output, outcome.seconds)
    if arguments.json:
        say_json(bake_summary(*said, unchanged=outcome.unchanged, traced=outcome.traced))
    else:
        say(summary_text(*said, unchanged=outcome.unchanged, traced=outcome.traced))
    return 0
