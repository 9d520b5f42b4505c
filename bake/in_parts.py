"""Work on large arrays part by part, on all processors."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from bake.devices import worker_count

AT_ONCE = 1 << 14
"""Rows that are worked on together: what lies between two passes over them stays in the processor's cache, and the
system need not hand out and take back pages for it."""


def in_parts(work: Callable[[int, int], None], rows: int, at_once: int = AT_ONCE) -> None:
    """Calls `work` with the first row and the end of one part after the other: NumPy lets go of the interpreter.

    Args:
        work: Must not depend on what it does to other parts; what it raises is raised here.
        rows: How many there are; where they are one part, no thread is started.
        at_once: Rows of a part.
    """
    if rows <= at_once:
        work(0, rows)
        return
    errors = np.geterr()  # threads start with those of the process

    def part(begin: int) -> None:
        with np.errstate(**errors):
            work(begin, min(begin + at_once, rows))

    with ThreadPoolExecutor(worker_count(), "parts") as pool:
        running = [pool.submit(part, begin) for begin in range(0, rows, at_once)]
        for ended in running:
            ended.result()
