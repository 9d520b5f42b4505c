"""The command line that does what the window is about to do, for scripts and farms."""

from __future__ import annotations

import shlex
from pathlib import Path

from bake.settings import BakeSettings

_FILLED_BY_QUALITY = ("rays", "samples-per-face")


def bake_command(scene: Path, result: Path, settings: BakeSettings, base: BakeSettings | None) -> str:
    """The `main.py bake …` that bakes with these settings.

    Args:
        scene: The scene's file.
        result: Where the result goes.
        settings: What to bake with.
        base: What the scene is baked with when no option is given: the defaults, overruled by its side file. Only
            what differs is spelt out; None, if that is not known: everything is.
    """
    words = ["python", "main.py", "bake", str(scene), "-o", str(result)]
    known = {} if base is None else base.to_json()
    for option, value in settings.to_json().items():
        filled = option in _FILLED_BY_QUALITY and known.get("quality") != settings.quality.value
        if option not in known or value != known[option] or filled:
            words += option_words(option, value)
    return shlex.join(words)


def result_command(command: str, result: Path, *words: str | Path) -> str:
    """The `main.py COMMAND RESULT …` of a job on a stored result.

    Args:
        command: Name of the command.
        result: The result's folder.
        words: What follows.
    """
    return shlex.join(["python", "main.py", command, str(result), *map(str, words)])


def option_words(option: str, value: object) -> list[str]:
    """One option as the command line reads it; an empty value stands for none."""
    if isinstance(value, bool):
        return [f"--{option}"] if value else [f"--no-{option}"]
    if isinstance(value, list):
        separator = ":" if option == "samples-per-face" else ","
        value = separator.join(str(item).removesuffix(".0") for item in value)
    text = "" if value is None else str(value)
    # With an equals sign, so that a value such as -y:100:0.03 is not taken for an option.
    return [f"--{option}={text}"] if text.startswith("-") else [f"--{option}", text]
