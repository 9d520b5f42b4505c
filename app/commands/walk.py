"""`walk RESULT`: what a character moving through the regions would be lit by, and where it pops."""

from __future__ import annotations

import argparse
from pathlib import Path

from app.commands.console import note, say, say_json

USAGE = "RESULT [--path FILE] [--speed M/S] [--fps N] [--half-life S] [--normal X,Y,Z] [--distance M] [--no-truth] …"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("result", type=Path, metavar="RESULT", help="a result folder with regions")
    parser.add_argument(
        "--path", type=Path, metavar="FILE", help="where to walk: points in world metres as .json or .csv (a tour)"
    )
    parser.add_argument("--speed", type=float, default=1.5, metavar="M/S", help="walking speed (1.5)")
    parser.add_argument("--fps", type=float, default=60.0, metavar="N", help="frames a second (60)")
    parser.add_argument(
        "--half-life", type=float, default=0.25, metavar="S", help="half-life of the blending in time (0.25); 0: none"
    )
    parser.add_argument("--normal", default="0,1,0", metavar="X,Y,Z", help="the normal of plots and CSV (0,1,0)")
    parser.add_argument("--distance", type=float, metavar="M", help="which baked distance (the longest)")
    parser.add_argument("--no-truth", action="store_true", help="trace nothing along the path, compare with nothing")
    parser.add_argument("--csv", type=Path, metavar="FILE", help="write a row a frame")
    parser.add_argument("--plot", type=Path, metavar="FILE.png", help="plot all variants over time, pops marked")
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of tables")


def run(arguments: argparse.Namespace) -> int:
    """Walks, and says how every variant did.

    Raises:
        InputError: no regions, no path, or an option out of its bounds; before anything is traced.
        ObscuraError: the tracer failed or a file could not be written.
    """
    from app.commands.progress import drive
    from app.commands.walk_summary import walk_summary, walk_text
    from bake.results import load_result
    from bake.results.exported_ao import column_of
    from bake.walk import WalkOptions
    from bake.walk.path_file import read_path
    from bake.walk.result_walk import regions_of, walk_result
    from bake.walk.table import write_csv

    result = load_result(arguments.result)
    regions_of(result)
    options = WalkOptions(
        speed=arguments.speed,
        frame_rate=arguments.fps,
        half_life=arguments.half_life,
        normal=_normal(arguments.normal),
        column=column_of(result, arguments.distance),
    )
    path = None if arguments.path is None else read_path(arguments.path, origin=result.world.origin)
    outcome = drive(walk_result(result, path, options, with_truth=not arguments.no_truth))
    if arguments.csv is not None:
        write_csv(arguments.csv, outcome.walk, regions_of(result).graph.names, origin=result.world.origin)
        note(f"{arguments.csv}: {len(outcome.walk):,} frames")
    if arguments.plot is not None:
        from app.commands.walk_plot import plot_walk

        plot_walk(
            arguments.plot,
            outcome.walk,
            names=regions_of(result).graph.names,
            distance=result.settings.column_distances[options.column],
            title=result.scene_path.stem,
        )
        note(f"{arguments.plot}: written")
    if arguments.json:
        say_json(walk_summary(result, outcome))
    else:
        say(walk_text(result, outcome))
    return 0


def _normal(text: str) -> tuple[float, float, float]:
    from bake.errors import SettingsError

    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise SettingsError(f"{text!r} is no direction", where="--normal", remedy="write X,Y,Z") from None
    return (x, y, z)
