"""Results that are kept as long as the arrays that they were worked out from.

Meshes never change once they are loaded: what loading finds out about one need not be found out again when it is
placed, nor when its scene is flattened anew after an edit elsewhere.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar

_T = TypeVar("_T")


def remembered(function: Callable[..., _T]) -> Callable[..., _T]:
    """The same function of arrays, which are told apart by identity and must not be changed in place.

    Returns:
        A function whose result is forgotten as soon as one of its arrays is.
    """
    kept: dict[tuple[int, ...], tuple[_T, list[weakref.ref[Any]]]] = {}

    @wraps(function)
    def known(*arrays: Any) -> _T:
        key = tuple(map(id, arrays))
        found = kept.get(key)
        if found is not None:
            return found[0]
        result = function(*arrays)

        def forget(_: weakref.ref[Any]) -> None:
            kept.pop(key, None)

        kept[key] = (result, [weakref.ref(array, forget) for array in arrays])
        return result

    return known
