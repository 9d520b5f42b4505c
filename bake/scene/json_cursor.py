"""A typed way through a JSON document that nobody has checked.

Files from the wild hold texts where numbers belong and numbers where lists belong. A cursor carries the place it
stands at, so every such mistake ends as one `SceneError` that names it, e.g. `nodes[3].mesh`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, cast

import numpy as np

from bake.errors import SceneError
from bake.types import Float64Array


class JsonCursor:
    """One value of a JSON document.

    Attributes:
        value: The value, of any JSON type.
        file: The document's file.
        place: Where in the document the value stands.
    """

    __slots__ = ("file", "place", "value")

    def __init__(self, value: Any, file: str, place: str = "") -> None:
        self.value = value
        self.file = file
        self.place = place

    def wrong(self, expected: str) -> SceneError:
        """The error that says what should have stood here."""
        shown = repr(self.value)
        shown = shown if len(shown) <= 40 else shown[:37] + "..."
        return SceneError(
            f"{self.place or 'the document'} is {shown}, not {expected}",
            where=self.file,
            remedy="export the scene again",
        )

    def object(self) -> dict[str, Any]:
        """This value as an object."""
        value: Any = self.value
        if not isinstance(value, dict):
            raise self.wrong("an object")
        return cast("dict[str, Any]", value)

    def has(self, key: str) -> bool:
        """Whether this object has a member `key`; JSON's null counts as absent."""
        return self.object().get(key) is not None

    def get(self, key: str, default: Any = None) -> JsonCursor:
        """The member `key`, or a cursor on `default` if it is absent."""
        value = self.object().get(key)
        place = f"{self.place}.{key}" if self.place else key
        return JsonCursor(default if value is None else value, self.file, place)

    def items(self) -> list[JsonCursor]:
        """The elements of this array."""
        values = self._list()
        return [JsonCursor(item, self.file, f"{self.place}[{i}]") for i, item in enumerate(values)]

    def members(self) -> Iterator[tuple[str, JsonCursor]]:
        """The members of this object, in the file's order."""
        for key in self.object():
            yield key, self.get(key)

    def element(self, index: JsonCursor) -> JsonCursor:
        """The element of this array that the document's value `index` refers to."""
        values = self._list()
        number = index.integer(low=0)
        if number >= len(values):
            raise SceneError(
                f"{index.place} refers to {self.place}[{number}], but there are only {len(values)}",
                where=self.file,
                remedy="export the scene again",
            )
        return JsonCursor(values[number], self.file, f"{self.place}[{number}]")

    def _list(self) -> list[Any]:
        value: Any = self.value
        if not isinstance(value, list):
            raise self.wrong("a list")
        return cast("list[Any]", value)

    def integer(self, *, low: int | None = None, high: int | None = None) -> int:
        """This value as a whole number within inclusive bounds."""
        value = self.value
        if isinstance(value, float) and value.is_integer():
            value = int(value)
        if not isinstance(value, int) or isinstance(value, bool):
            raise self.wrong("a whole number")
        if (low is not None and value < low) or (high is not None and value > high):
            raise self.wrong(f"between {low} and {high}" if high is not None else f"at least {low}")
        return value

    def number(self) -> float:
        """This value as a finite number."""
        if not isinstance(self.value, int | float) or isinstance(self.value, bool):
            raise self.wrong("a number")
        try:
            value = float(self.value)
        except OverflowError:
            raise self.wrong("a finite number") from None
        if not math.isfinite(value):
            raise self.wrong("a finite number")
        return value

    def numbers(self, count: int) -> Float64Array:
        """This value as `count` finite numbers, shape (count,), float64."""
        items = self.items()
        if len(items) != count:
            raise self.wrong(f"a list of {count} numbers")
        return np.array([item.number() for item in items], np.float64)

    def text(self) -> str:
        """This value as a text."""
        if not isinstance(self.value, str):
            raise self.wrong("a text")
        return self.value

    def flag(self) -> bool:
        """This value as true or false."""
        if not isinstance(self.value, bool):
            raise self.wrong("true or false")
        return self.value
