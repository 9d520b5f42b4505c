"""Frozen values as plain JSON and back; what no longer fits is left at its default."""

from __future__ import annotations

import dataclasses
import enum
import types
import typing
from typing import Any, TypeVar

Value = TypeVar("Value")


def to_plain(value: Any) -> Any:
    """A value as JSON can hold it: data classes become objects, enums their names, tuples lists."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: to_plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, enum.Enum):
        return value.name
    if isinstance(value, tuple | list):
        return [to_plain(item) for item in value]
    return value


def from_plain(kind: type[Value], data: Any) -> Value:
    """A data class from what `to_plain` made of one.

    Fields that are missing, of another type, or refused by the class keep their defaults: it may have been stored by
    another version, or by hand.

    Args:
        kind: A data class whose fields all have defaults.
        data: As read from JSON.
    """
    value = kind()
    if not isinstance(data, dict):
        return value
    hints = typing.get_type_hints(kind)
    for field in dataclasses.fields(kind):  # type: ignore[arg-type]
        if field.name in data:
            try:
                value = dataclasses.replace(value, **{field.name: _read(hints[field.name], data[field.name])})  # type: ignore[type-var]
            except (TypeError, ValueError, KeyError):
                continue
    return value


def _read(hint: Any, data: Any) -> Any:
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin in (types.UnionType, typing.Union):
        if data is None and type(None) in arguments:
            return None
        return _read(next(argument for argument in arguments if argument is not type(None)), data)
    if origin is tuple:
        if not isinstance(data, list):
            raise TypeError
        if len(arguments) == 2 and arguments[1] is Ellipsis:
            return tuple(_read(arguments[0], item) for item in data)
        return tuple(_read(argument, item) for argument, item in zip(arguments, data, strict=True))
    if isinstance(hint, type) and issubclass(hint, enum.Enum):
        return hint[data]
    if dataclasses.is_dataclass(hint):
        return from_plain(typing.cast("type[Any]", hint), data)
    if hint is float and isinstance(data, int | float) and not isinstance(data, bool):
        return float(data)
    if isinstance(hint, type) and type(data) is hint:
        return data
    raise TypeError
