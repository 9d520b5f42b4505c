"""`report RESULT -o FILE.html`: one self-contained page about a result."""

from __future__ import annotations

import argparse
from pathlib import Path

from app.commands.console import note, say

USAGE = "RESULT -o FILE.html [--no-pictures]"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("result", type=Path, metavar="RESULT", help="a result folder")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE.html", required=True, help="the page")
    parser.add_argument("--no-pictures", action="store_true", help="leave the rendered views out")


def run(arguments: argparse.Namespace) -> int:
    """Writes the page.

    Raises:
        ObscuraError: no result, or the page could not be written.
    """
    write_report(arguments.result, arguments.output, with_pictures=not arguments.no_pictures)
    say(f"{arguments.output}: {arguments.output.stat().st_size / 1e6:.1f} MB")
    return 0


def write_report(result_path: Path, path: Path, *, with_pictures: bool = True) -> None:
    """Writes the report of a stored result; what was there is replaced only once it is whole.

    Raises:
        ResultError: no result.
        StorageError: the page could not be written.
    """
    from app.commands.pictures import take_pictures
    from app.commands.report_page import report_page
    from bake.results import load_result
    from bake.results.storage import replacing

    result = load_result(result_path)
    with replacing(path) as file:
        pictures = take_pictures(result_path) if with_pictures else []
        if with_pictures and not pictures:
            note("nothing here could draw off screen: the report has no pictures (see `doctor`)")
        file.write(report_page(result, result_path, pictures).encode())
