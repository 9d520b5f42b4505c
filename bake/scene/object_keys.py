"""What may be said of an object, in a side file or in glTF extras, checked value by value."""

from __future__ import annotations

import dataclasses
import difflib
import math
from collections.abc import Iterable, Mapping
from typing import Any

from bake.errors import SceneError
from bake.scene.placing import PLACING_KEYS, check_placing
from bake.types import ObjectKeys, Role

CHOICES = {"normals": ("file", "faces"), "winding": ("file", "normals", "flipped")}
KEY_NAMES = tuple(item.name for item in dataclasses.fields(ObjectKeys))


def nearest(word: str, known: Iterable[str]) -> str:
    """A remedy that names the known word most like `word`, or all of them."""
    known = list(known)
    near = difflib.get_close_matches(word, known, 1)
    return f"did you mean {near[0]!r}?" if near else f"known: {', '.join(known)}"


def check_keys(values: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Checks a table of role and keys.

    Args:
        values: As read from TOML or JSON.
        where: File and place, for messages.

    Returns:
        The same by name, with `role` as a `Role`.

    Raises:
        SceneError: an unknown key or role (the nearest known one is named), a wrong type or a value out of range.
    """
    return {name: _check_value(name, value, where) for name, value in values.items()}


def _check_value(name: str, value: Any, where: str) -> Any:
    match name:
        case "role":
            if value not in Role.__members__.values():
                raise SceneError(
                    f"unknown role {value!r}", where=where, remedy=nearest(str(value), [role.value for role in Role])
                )
            return Role(value)
        case "two_sided" | "weld":
            if not isinstance(value, bool):
                raise _wrong(name, value, where, "true or false")
            return value
        case "samples":
            if not isinstance(value, int) or isinstance(value, bool) or not 1 <= value <= 4096:
                raise _wrong(name, value, where, "a whole number from 1 to 4096")
            return value
        case "offset" | "alpha" | "density":
            return _number(name, value, where, high=1e6)
        case "transmission":
            return _number(name, value, where, high=1.0)
        case "normals" | "winding":
            if value not in CHOICES[name]:
                raise _wrong(name, value, where, " or ".join(f'"{choice}"' for choice in CHOICES[name]))
            return value
        case "of":
            if not isinstance(value, str) or not value:
                raise _wrong(name, value, where, "the path of the finest level")
            return value
        case "translate" | "rotate" | "scale":
            return check_placing(name, value, where)
        case _:
            raise SceneError(
                f"unknown key {name!r}", where=where, remedy=nearest(name, ["role", *KEY_NAMES, *PLACING_KEYS])
            )


def _number(name: str, value: Any, where: str, *, high: float) -> float:
    number = finite_number(value)
    if number is None or not 0.0 <= number <= high:
        raise _wrong(name, value, where, f"a number from 0 to {high:g}")
    return number


def finite_number(value: Any) -> float | None:
    """`value` as a float, or None if it is no number that a float can hold."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


def _wrong(name: str, value: Any, where: str, expected: str) -> SceneError:
    return SceneError(f"{name} is {str(value)[:40]!r}", where=where, remedy=f"use {expected}")
