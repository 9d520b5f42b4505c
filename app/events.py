"""A callback list with a type: how Qt-free state tells its observers that it changed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, ParamSpec

Arguments = ParamSpec("Arguments")


class Event(Generic[Arguments]):
    """Calls every connected function, in the order of connection, on the emitting thread."""

    def __init__(self) -> None:
        self._observers: list[Callable[Arguments, object]] = []

    def connect(self, observer: Callable[Arguments, object]) -> None:
        """Calls `observer` at every later emission."""
        self._observers.append(observer)

    def disconnect(self, observer: Callable[Arguments, object]) -> None:
        """Stops calling `observer`; it may be unknown."""
        if observer in self._observers:
            self._observers.remove(observer)

    def clear(self) -> None:
        """Forgets every observer, so that state and widgets can be freed."""
        self._observers.clear()

    def emit(self, *args: Arguments.args, **kwargs: Arguments.kwargs) -> None:
        """Calls the observers; one that connects or disconnects meanwhile takes effect at the next emission."""
        for observer in tuple(self._observers):
            observer(*args, **kwargs)
