"""What the command line says: data on stdout, everything else on stderr."""

from __future__ import annotations

import json
import logging
import sys
import traceback
from collections.abc import Mapping
from typing import Any


def say(text: str) -> None:
    """Prints data or a result."""
    print(text, flush=True)


def say_json(content: Mapping[str, Any]) -> None:
    """Prints one JSON object, strict and on one line."""
    print(json.dumps(content, ensure_ascii=False, allow_nan=False), flush=True)


def note(text: str) -> None:
    """Prints one line for people, apart from the data."""
    print(f"obscura: {' '.join(text.split())}", file=sys.stderr, flush=True)


def note_crash(error: BaseException, *, verbose: bool) -> None:
    """One line about an error that nobody foresaw, with its traceback only on request."""
    if verbose:
        traceback.print_exception(error)
    detail = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    hint = "" if verbose else "; run again with --verbose (or OBSCURA_DEBUG=1) for the details"
    note(f"unexpected error ({detail[:200]}){hint}")


def set_up_log(*, verbose: bool) -> None:
    """Sends the program's log to stderr: warnings only, or all of it."""
    handler = logging.StreamHandler()
    handler.setFormatter(logging.Formatter("obscura: %(levelname)s: %(message)s"))
    root = logging.getLogger()
    root.handlers[:] = [handler]
    root.setLevel(logging.WARNING)
    for package in ("app", "bake", "viewer"):
        logging.getLogger(package).setLevel(logging.DEBUG if verbose else logging.WARNING)
