"""The walk: what a character moving through the regions would be lit by, and where it pops."""

from bake.walk.course import Course, lay_out
from bake.walk.path import path_in_pieces, path_through
from bake.walk.simulate import simulate
from bake.walk.truth import trace_truth
from bake.walk.types import (
    CHOSEN,
    STEP_BOUND,
    PathTruth,
    Pop,
    Variant,
    Walk,
    WalkMetrics,
    WalkOptions,
    WalkPath,
)

__all__ = [
    "CHOSEN",
    "STEP_BOUND",
    "Course",
    "PathTruth",
    "Pop",
    "Variant",
    "Walk",
    "WalkMetrics",
    "WalkOptions",
    "WalkPath",
    "lay_out",
    "path_in_pieces",
    "path_through",
    "simulate",
    "trace_truth",
]
