"""Obscura: bakes ambient obscurance for game levels and explains every value. `main.py --help` says how."""

from __future__ import annotations

import os
import sys


def run() -> int:
    """Runs the command line; a half-installed program says so in one line."""
    try:
        from app.cli import main
    except ModuleNotFoundError as error:
        print(f"obscura: the package {error.name} is missing; run `make setup`", file=sys.stderr)
        return 1
    return main()


if __name__ == "__main__":
    code = run()
    sys.stdout.flush()
    sys.stderr.flush()
    if code == 130:
        # A cancelled stage may still be at work in its thread: what it does no longer counts, so don't wait for it.
        os._exit(code)
    sys.exit(code)
