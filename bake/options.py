"""Option values: from strings, JSON or TOML to the type a field declares, and back."""

from __future__ import annotations

import enum
import types
import typing
from typing import Any, cast

from bake.errors import SettingsError


def plain(value: Any) -> Any:
    """A value as JSON and TOML can hold it; `convert` is its inverse."""
    if isinstance(value, enum.Enum):
        return value.value
    if callable(getattr(value, "parse", None)):
        return str(value)
    if isinstance(value, tuple):
        return [plain(item) for item in cast("tuple[Any, ...]", value)]
    return value


def convert(value: Any, wanted: Any, where: str) -> Any:
    """Turns a typed-in string or a TOML or JSON value into the field's type."""
    if typing.get_origin(wanted) is types.UnionType:
        if value is None or value == "":
            return None
        wanted = next(part for part in typing.get_args(wanted) if part is not types.NoneType)
    try:
        if hasattr(wanted, "parse"):
            return value if isinstance(value, wanted) else wanted.parse(str(value))
        if typing.get_origin(wanted) is tuple:
            return _convert_tuple(value, typing.get_args(wanted), where)
        if isinstance(wanted, type) and issubclass(wanted, enum.Enum):
            return cast("Any", wanted)(value)
        if wanted is bool:
            return _convert_bool(value)
        if wanted is str:
            return str(value)
        if isinstance(value, bool):
            raise ValueError(value)
        if wanted is int and isinstance(value, float) and not value.is_integer():
            raise ValueError(value)
        return wanted(value)
    except (ValueError, TypeError):
        raise SettingsError(f"{value!r} is no valid value", where=where, remedy=f"use {_describe(wanted)}") from None


def _convert_tuple(value: Any, parts: tuple[Any, ...], where: str) -> tuple[Any, ...]:
    separator = "," if Ellipsis in parts else ":"
    if isinstance(value, str):
        value = [piece.strip() for piece in value.split(separator) if piece.strip()]
    items = list(cast("list[Any]", value)) if isinstance(value, list | tuple) else [value]
    converted = tuple(convert(item, parts[0], where) for item in items)
    if Ellipsis in parts:
        return converted
    if len(converted) == 1:  # MIN alone: the maximum is the default's, or the minimum if that is larger
        return (converted[0], max(converted[0], 16))
    if len(converted) != len(parts):
        raise ValueError("wrong number of parts")
    return converted


def _convert_bool(value: Any) -> bool:
    known = {True: True, False: False, "true": True, "false": False, "yes": True, "no": False, "1": True, "0": False}
    key: Any = value.strip().lower() if isinstance(value, str) else value
    if key not in known:
        raise ValueError(value)
    return known[key]


def _describe(wanted: Any) -> str:
    if typing.get_origin(wanted) is tuple:
        parts = typing.get_args(wanted)
        return "numbers separated by commas" if Ellipsis in parts else "MIN or MIN:MAX"
    if isinstance(wanted, type) and issubclass(wanted, enum.Enum):
        return " or ".join(str(member.value) for member in wanted)
    names: dict[Any, str] = {int: "a whole number", float: "a number", bool: "true or false"}
    return names.get(wanted, "another value")
