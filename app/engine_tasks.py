"""What the engine process can do with a stored result besides baking and solving: tasks by name."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from typing import Any

from app.explain_task import explain_spot, preview_remedy, spot_without
from app.walk_task import trace_walk
from bake.types import BakeResult, Progress

Task = Callable[[BakeResult, Any], Generator[Progress, None, Any]]
"""Works on a result with arguments of its own; yields progress often and returns what the window wants. Arguments and
what is returned travel through a pipe: plain frozen records of a few megabytes at most."""

TASKS: Mapping[str, Task] = {
    "walk": trace_walk,
    "explain": explain_spot,
    "without": spot_without,
    "surface-without": spot_without,
    "preview": preview_remedy,
}
