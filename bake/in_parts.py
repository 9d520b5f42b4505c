"""Work on large arrays on all processors: part by part, or one piece of work beside another."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor, wait
from functools import cache
from typing import TypeVar

import numpy as np

from bake.devices import worker_count

_T = TypeVar("_T")

AT_ONCE = 1 << 14
"""Rows that are worked on together: what lies between two passes over them stays in the processor's cache, and the
system need not hand out and take back pages for it."""


def in_parts(work: Callable[[int, int], None], rows: int, at_once: int = AT_ONCE) -> None:
    """Calls `work` with the first row and the end of one part after the other: NumPy lets go of the interpreter.

    Args:
        work: Must not depend on what it does to other parts; what it raises is raised here.
        rows: How many there are; where they are one part, no thread is started.
        at_once: The most rows of a part; parts are equally large.
    """
    parts = max(1, -(-rows // at_once))
    in_spans(work, [(rows * part // parts, rows * (part + 1) // parts) for part in range(parts)])


def in_spans(work: Callable[[int, int], None], spans: Iterable[tuple[int, int]]) -> None:
    """The same for parts of any sizes.

    Args:
        work: As for `in_parts`.
        spans: First row and end of each part; where there is one, no thread is started.
    """
    parts = list(spans)
    helpers = min(worker_count(), len(parts)) - 1
    waiting = iter(parts)

    def take() -> None:
        try:
            for begin, end in waiting:  # each thread takes the next one
                work(begin, end)
        except BaseException:
            for _ in waiting:  # nobody goes on
                pass
            raise

    if helpers <= 0:
        take()
        return
    errors = np.geterr()  # threads start with those of the process

    def help_out() -> None:
        with np.errstate(**errors):
            take()

    helping = [_helpers().submit(help_out) for _ in range(helpers)]
    try:
        take()
    finally:
        # Whoever has not begun has nothing left to do: so nobody waits for helpers that wait themselves.
        begun = [helper for helper in helping if not helper.cancel()]
        wait(begun)
    for helper in begun:
        helper.result()


@cache
def _helpers() -> ThreadPoolExecutor:
    """Threads that stay, as starting them takes longer than many a part."""
    return ThreadPoolExecutor(max(1, worker_count() - 1), "parts")


def meanwhile(work: Callable[[], _T], rows: int) -> Callable[[], _T]:
    """Starts work that goes on beside what the caller does next.

    Args:
        work: What to do; what it raises is raised where its value is asked for.
        rows: How large it is; where that is one part, it is done at once, and no thread is started.

    Returns:
        What waits for the value.
    """
    if rows <= AT_ONCE:
        value = work()
        return lambda: value
    errors = np.geterr()

    def run() -> _T:
        with np.errstate(**errors):
            return work()

    pool = ThreadPoolExecutor(1, "meanwhile")
    ended = pool.submit(run)
    pool.shutdown(wait=False)
    return ended.result
