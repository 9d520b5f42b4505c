"""Results that are kept as long as the arrays that they were worked out from.

Meshes never change once they are loaded: what loading finds out about one need not be found out again when it is
placed, nor when its scene is flattened anew after an edit elsewhere.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable
from concurrent.futures import Future
from functools import update_wrapper
from typing import Any, Generic, TypeVar

_T = TypeVar("_T")


class remembered(Generic[_T]):
    """The same function of arrays, which are told apart by identity and must not be changed in place.

    A result is forgotten as soon as one of its arrays is. Threads that want the same one wait for the first of them.

    Args:
        function: Of arrays.
    """

    def __init__(self, function: Callable[..., _T]) -> None:
        self._function = function
        self._kept: dict[tuple[int, ...], tuple[Future[_T], list[weakref.ref[Any]]]] = {}
        update_wrapper(self, function)

    def __call__(self, *arrays: Any) -> _T:
        """The function's result."""
        own: Future[_T] = Future()
        first = self._kept.setdefault(tuple(map(id, arrays)), self._entry(own, arrays))[0]
        if first is not own:
            return first.result()
        try:
            result = self._function(*arrays)
        except BaseException as error:
            self._kept.pop(tuple(map(id, arrays)), None)
            own.set_exception(error)
            raise
        own.set_result(result)
        return result

    def tell(self, result: _T, *arrays: Any) -> None:
        """Says what the function would give for some arrays, where that is known from elsewhere."""
        told: Future[_T] = Future()
        told.set_result(result)
        self._kept[tuple(map(id, arrays))] = self._entry(told, arrays)

    def _entry(self, result: Future[_T], arrays: tuple[Any, ...]) -> tuple[Future[_T], list[weakref.ref[Any]]]:
        key, kept = tuple(map(id, arrays)), self._kept

        def forget(_: weakref.ref[Any]) -> None:
            kept.pop(key, None)  # a single step: an array may die at any moment, in any thread

        return result, [weakref.ref(array, forget) for array in arrays]
