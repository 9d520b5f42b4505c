"""One field of the settings: its title, help, unit and bounds, from which forms and options are made."""

from __future__ import annotations

import dataclasses
import math
from typing import Any, cast

from bake.errors import SettingsError


def setting(
    default: Any,
    title: str,
    text: str,
    *,
    unit: str = "",
    low: float | None = None,
    high: float | None = None,
    above: float | None = None,
    suggested: float | None = None,
    advanced: bool = False,
    affects: str = "trace",
) -> Any:
    """A field with what validation and the generated forms need.

    `low` and `high` are inclusive bounds, `above` an exclusive one. `suggested` is where a form starts when an optional
    number is switched on. `affects` names the earliest stage that must run again when the value changes: "trace",
    "solve", "regions" (their models are fitted again) or "nothing".
    """
    return dataclasses.field(
        default=default,
        metadata={
            "title": title,
            "help": text,
            "unit": unit,
            "low": low,
            "high": high,
            "above": above,
            "suggested": suggested,
            "advanced": advanced,
            "affects": affects,
        },
    )


def option_name(field_name: str) -> str:
    """The long option of a field, without dashes: `samples_per_face` is `samples-per-face`."""
    return field_name.replace("_", "-")


def check_bounds(item: dataclasses.Field[Any], value: Any) -> None:
    """Refuses a value outside its field's bounds.

    Raises:
        SettingsError: it names the option and the bounds.
    """
    low, high, above = (item.metadata[key] for key in ("low", "high", "above"))
    if low is None and high is None and above is None:
        return
    numbers = cast("tuple[Any, ...]", value) if isinstance(value, tuple) else (value,)
    for number in numbers:
        if number is None:
            continue
        if not math.isfinite(number):
            problem = "is not finite"
        elif low is not None and number < low:
            problem = f"is below {low:g}"
        elif above is not None and not number > above:
            problem = f"is not above {above:g}"
        elif high is not None and number > high:
            problem = f"is above {high:g}"
        else:
            continue
        unit = f" {item.metadata['unit']}" if item.metadata["unit"] else ""
        bounds = f"{'above ' + format(above, 'g') if above is not None else f'{low:g}'} to {high:g}{unit}"
        raise SettingsError(f"{number!r} {problem}", where=f"--{option_name(item.name)}", remedy=f"use {bounds}")
