"""Command-line options made from the fields of `BakeSettings`."""

from __future__ import annotations

import argparse
import dataclasses
import enum
import types
import typing
from typing import Any

from bake.setting_fields import option_name
from bake.settings import BakeSettings

# What a type alone cannot say.
_METAVARS = {
    "device": "auto|cpu|cuda[:N]",
    "samples-per-face": "MIN[:MAX]",
    "ground": "AXIS[:SCALE[:OFFSET]]",
    "regions": "auto|none|FILE.json",
    "skip": "STAGE,…",
}
_VECTORS = ("--normal", "--point")
_DESTINATION = "setting:"


def add_settings_options(parser: argparse.ArgumentParser) -> None:
    """Adds an option for every setting; values stay text, for `BakeSettings.from_options` to judge."""
    common = parser.add_argument_group("settings")
    advanced = parser.add_argument_group("advanced settings")
    hints = typing.get_type_hints(BakeSettings)
    for item in dataclasses.fields(BakeSettings):
        option = option_name(item.name)
        group = advanced if item.metadata["advanced"] else common
        shared: dict[str, Any] = {
            "dest": _DESTINATION + option,
            "default": argparse.SUPPRESS,
            "help": _help(item).replace("%", "%%"),
        }
        if hints[item.name] is bool:
            group.add_argument(f"--{option}", action=argparse.BooleanOptionalAction, **shared)
        else:
            group.add_argument(f"--{option}", metavar=_metavar(option, hints[item.name], item), **shared)


def explicit_options(arguments: argparse.Namespace) -> dict[str, Any]:
    """The settings that were given, by long option name."""
    return {
        name.removeprefix(_DESTINATION): value
        for name, value in vars(arguments).items()
        if name.startswith(_DESTINATION)
    }


def joined_values(words: list[str]) -> list[str]:
    """Words of a command line, with `--ground -y:100` and `--normal -1,0,0` as one: argparse takes them for two."""
    joined: list[str] = []
    for word in words:
        last = joined[-1] if joined else ""
        if (last == "--ground" and word[:2] in ("-x", "-y", "-z")) or (last in _VECTORS and _is_negative(word)):
            joined[-1] = f"{last}={word}"
        else:
            joined.append(word)
    return joined


def _is_negative(word: str) -> bool:
    return word.startswith("-") and word[1:2] in tuple("0123456789.")


def _metavar(option: str, wanted: Any, item: dataclasses.Field[Any]) -> str:
    if option in _METAVARS:
        return _METAVARS[option]
    if typing.get_origin(wanted) is types.UnionType:
        wanted = typing.get_args(wanted)[0]
    if isinstance(wanted, type) and issubclass(wanted, enum.Enum):
        return "|".join(str(member.value) for member in wanted)
    letter = {"m": "M", "°": "DEGREES"}.get(item.metadata["unit"], "N" if wanted is int else "X")
    return f"{letter},…" if typing.get_origin(wanted) is tuple else letter


def _help(item: dataclasses.Field[Any]) -> str:
    default = BakeSettings().to_json()[option_name(item.name)]
    if default in (None, [], False):
        shown = "none" if default is None else ""
    elif isinstance(default, list):
        shown = (":" if item.name == "samples_per_face" else ",").join(f"{value:g}" for value in default)
    else:
        shown = f"{default:g}" if isinstance(default, float) else str(default)
    unit = f" {item.metadata['unit']}" if item.metadata["unit"] and shown not in ("", "none") else ""
    return f"{item.metadata['help']}" + (f" ({shown}{unit})" if shown else "")
