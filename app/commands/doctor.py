"""`doctor`: what this machine has, what is missing, and the command that mends it."""

from __future__ import annotations

import argparse
from dataclasses import asdict

from app.commands.console import say, say_json

USAGE = "[--json]"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(arguments: argparse.Namespace) -> int:
    """Prints the checks; the exit code is 1 if something needed is missing."""
    from app.commands.checks import MISSING, run_checks

    checks = []
    for check in run_checks():
        checks.append(check)
        if not arguments.json:
            say(f"{check.status:9} {check.name:28} {check.detail}")
            if check.remedy:
                say(f"{'':9} {'':28} → {check.remedy}")
    is_complete = all(check.status != MISSING for check in checks)
    if arguments.json:
        say_json({"ok": is_complete, "checks": [asdict(check) for check in checks]})
    else:
        say("\nEverything needed is here." if is_complete else "\nSomething is missing: see the commands above.")
    return 0 if is_complete else 1
