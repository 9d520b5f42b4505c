"""Runs one measurement in a process of its own: its memory is its own, and its crash is a row and not the end."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any


def isolated(measure: Callable[..., dict[str, Any]], scene: Path, *arguments: Any) -> dict[str, Any]:
    """The row that `measure(scene, *arguments)` returns in a fresh process.

    Args:
        measure: A function at the top level of a module, so that the other process finds it.
        scene: What it measures.
        arguments: What else it takes.
    """
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        try:
            return pool.submit(measure, scene, *arguments).result()
        except BrokenProcessPool:
            return {"scene": scene.name, "refused": "the engine died", "passed": False}
