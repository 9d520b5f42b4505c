"""The engine's share of a walk: a tour needs a tracer, and so does the truth along a path."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

from bake.types import BakeResult, BoolArray, Progress
from bake.walk.types import PathTruth, WalkOptions, WalkPath


@dataclass(frozen=True, slots=True)
class WalkRequest:
    """What to trace.

    Attributes:
        path: Along which path; None for a tour of the regions.
        with_truth: Whether the path is traced as well, to compare with.
    """

    path: WalkPath | None
    with_truth: bool


@dataclass(frozen=True, slots=True)
class TracedWalk:
    """What came of it.

    Attributes:
        request: What was asked for.
        path: The path asked for, or the tour.
        visited: Regions that the tour visited, shape (r,), bool; None where the path was given.
        truth: What was traced along it; None if that was not asked for.
    """

    request: WalkRequest
    path: WalkPath
    visited: BoolArray | None
    truth: PathTruth | None


def trace_walk(result: BakeResult, request: WalkRequest) -> Generator[Progress, None, TracedWalk]:
    """Traces a walk through a result; close the generator to cancel."""
    from bake.walk.result_walk import walk_result

    outcome = yield from walk_result(result, request.path, WalkOptions(), with_truth=request.with_truth)
    return TracedWalk(request, outcome.path, outcome.visited, outcome.truth)
