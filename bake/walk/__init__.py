"""The walk: what a character moving through the regions would be lit by, and where it pops."""

from bake.walk.path import path_in_pieces, path_through
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
    "PathTruth",
    "Pop",
    "Variant",
    "Walk",
    "WalkMetrics",
    "WalkOptions",
    "WalkPath",
    "path_in_pieces",
    "path_through",
]
