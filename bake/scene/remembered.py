"""Results that are kept as long as the arrays that they were worked out from.

Meshes never change once they are loaded: what loading finds out about one need not be found out again when it is
placed, nor when its scene is flattened anew after an edit elsewhere.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable
from functools import update_wrapper
from typing import Any, Generic, TypeVar

_T = TypeVar("_T")


class remembered(Generic[_T]):  # a decorator
    """The same function of arrays, which are told apart by identity and must not be changed in place.

    A result is forgotten as soon as one of its arrays is.

    Args:
        function: Of arrays.
    """

    def __init__(self, function: Callable[..., _T]) -> None:
        self._function = function
        self._kept: dict[tuple[int, ...], tuple[_T, list[weakref.ref[Any]]]] = {}
        update_wrapper(self, function)

    def __call__(self, *arrays: Any) -> _T:
        """The function's result."""
        found = self._kept.get(tuple(map(id, arrays)))
        if found is not None:
            return found[0]
        result = self._function(*arrays)
        self.tell(result, *arrays)
        return result

    def tell(self, result: _T, *arrays: Any) -> None:
        """Says what the function would give for some arrays, where that is known from elsewhere."""
        kept, key = self._kept, tuple(map(id, arrays))

        def forget(_: weakref.ref[Any]) -> None:
            kept.pop(key, None)

        kept[key] = (result, [weakref.ref(array, forget) for array in arrays])
