"""The command line: which command is meant, and how every error ends in one line and an exit code."""

from __future__ import annotations

import argparse
import contextlib
import difflib
import importlib
import os
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from app.commands import COMMANDS
from app.commands.console import note, note_crash, set_up_log
from app.commands.settings_options import joined_values
from bake import __version__
from bake.errors import Cancelled, InputError, ObscuraError, OutOfMemoryError

_DESCRIPTION = "Bakes ambient obscurance for game levels and explains every value."
_EPILOG = "Without a command the window opens: on a scene, on a result, or on the sample level."


class _Parser(argparse.ArgumentParser):
    """A parser whose complaints are errors like all others."""

    def error(self, message: str) -> NoReturn:
        raise InputError(message, remedy=f"see {self.prog} --help")


class _Help(argparse.RawDescriptionHelpFormatter):
    """Help with room for long option names."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog, max_help_position=34, width=min(110, shutil.get_terminal_size().columns))


def main(words: Sequence[str] | None = None) -> int:
    """Runs the program.

    Args:
        words: The command line without the program's name; that of the process by default.

    Returns:
        The exit code: 0 done, 1 failed, 2 bad input or usage, 130 cancelled.
    """
    given = list(sys.argv[1:] if words is None else words)
    verbose = "--verbose" in given or os.environ.get("OBSCURA_DEBUG", "") not in ("", "0")
    set_up_log(verbose=verbose)
    try:
        return _run(given)
    except KeyboardInterrupt:
        note(str(Cancelled()))
        return Cancelled.exit_code
    except BrokenPipeError:  # whoever read our output has gone
        with contextlib.suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # nor must the last flush complain
        return 1
    except ObscuraError as error:
        if verbose and not isinstance(error, InputError | Cancelled):
            note_crash(error, verbose=True)
        note(str(error))
        return error.exit_code
    except MemoryError as error:
        if verbose:
            note_crash(error, verbose=True)
        note(str(OutOfMemoryError("the work does not fit into memory", remedy="use fewer rays or samples per face")))
        return OutOfMemoryError.exit_code
    except Exception as error:  # noqa: BLE001
        note_crash(error, verbose=verbose)
        return 1


def _run(words: list[str]) -> int:
    program = Path(sys.argv[0]).name or "main.py"
    if words and words[0] in COMMANDS:
        module = importlib.import_module(f"app.commands.{words[0]}")
        name = f"{program} {words[0]}"
        parser = _Parser(
            prog=name,
            usage=f"{name} {module.USAGE}",
            description=COMMANDS[words[0]].capitalize(),
            formatter_class=_Help,
            allow_abbrev=False,
        )
        module.add_arguments(parser)
        _add_common(parser)
        return module.run(_parsed(parser, joined_values(words[1:])))
    parser = _Parser(
        prog=program,
        usage=f"{program} [SCENE | RESULT]\n       {program} {{{','.join(COMMANDS)}}} …",
        description=_DESCRIPTION,
        epilog="\n".join(["commands:", *(f"  {name:8}{summary}" for name, summary in COMMANDS.items()), "", _EPILOG]),
        formatter_class=_Help,
        allow_abbrev=False,
    )
    parser.add_argument("path", type=Path, nargs="?", metavar="SCENE | RESULT", help="what the window opens")
    parser.add_argument("--version", action="version", version=f"Obscura {__version__}")
    _add_common(parser)
    path = _parsed(parser, words).path
    if path is not None and not path.exists():
        near = difflib.get_close_matches(str(path), list(COMMANDS), 1)
        remedy = f"did you mean the command {near[0]!r}?" if near else f"commands are {', '.join(COMMANDS)}"
        raise InputError("no such file, and no command of that name", where=str(path), remedy=remedy)
    from app.commands.window import run_window

    return run_window(path)


def _add_common(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--verbose", action="store_true", help="log what is done, and show tracebacks")


def _parsed(parser: argparse.ArgumentParser, words: list[str]) -> argparse.Namespace:
    arguments, unknown = parser.parse_known_args(words)
    if unknown:
        known = [option for action in parser._actions for option in action.option_strings]
        near = difflib.get_close_matches(unknown[0].split("=")[0], known, 1)
        what = "unknown option" if unknown[0].startswith("-") else "unexpected argument"
        remedy = f"did you mean {near[0]}?" if near else f"see {parser.prog} --help"
        raise InputError(f"{what} {unknown[0]}", remedy=remedy)
    return arguments
