"""The command line that does what the window is about to do, for scripts and farms."""

from __future__ import annotations

import shlex
from pathlib import Path

from bake.settings import QUALITY_PRESETS, BakeSettings


def bake_command(scene: Path, result: Path, settings: BakeSettings) -> str:
    """`main.py bake …` with the options that differ from the defaults of their quality preset."""
    defaults = BakeSettings(quality=settings.quality, **QUALITY_PRESETS[settings.quality]).to_json()
    defaults["quality"] = BakeSettings().to_json()["quality"]
    words = ["python", "main.py", "bake", str(scene), "-o", str(result)]
    for option, value in settings.to_json().items():
        if value != defaults[option]:
            words += option_words(option, value)
    return shlex.join(words)


def option_words(option: str, value: object) -> list[str]:
    """One option as the command line reads it."""
    if isinstance(value, bool):
        return [f"--{option}"] if value else [f"--no-{option}"]
    if isinstance(value, list):
        separator = ":" if option == "samples-per-face" else ","
        value = separator.join(str(item).removesuffix(".0") for item in value)
    # With an equals sign, so that a value such as -y:100:0.03 is not taken for an option.
    return [f"--{option}={value}"] if str(value).startswith("-") else [f"--{option}", str(value)]
