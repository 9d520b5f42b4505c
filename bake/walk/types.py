"""What the parts of the walk pass to each other: a path, how it is walked, and what came of it."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bake.errors import SettingsError
from bake.regions.evaluate import AXIS_NORMALS
from bake.types import BoolArray, Float32Array, Float64Array, Int32Array

CHOSEN = 6
"""Column of `Walk.ao` that holds the chosen normal; the six axis normals come before it."""

STEP_BOUND = 0.009
"""Largest step a frame that stays within one 8-bit sRGB code at white."""


class Variant(enum.StrEnum):
    """How the AO of a frame is found."""

    RAW = "raw"
    """The model of the character's region as it was fitted."""
    REGULARISED = "regularised"
    """The same after the regularisation."""
    BLENDED = "blended"
    """The regularised model, blended with the frames before (Sloan et al. 2013, section 3)."""
    SPATIAL = "spatial"
    """The regularised models of all regions around, weighted by how deep inside them the character is."""
    SPATIAL_BLENDED = "spatial+blended"
    """The former, blended with the frames before as well."""
    TRUTH = "truth"
    """What is traced at the character's place."""


@dataclass(frozen=True, slots=True)
class WalkPath:
    """A polyline in one or several pieces; from piece to piece the character teleports.

    Attributes:
        points: Shape (n, 3), float64, metres relative to `World.origin`.
        piece: Shape (n,), int32, ascending: which piece a point belongs to.
        distance: Shape (n,), float64: metres walked on the way to each point; teleports count nothing.
    """

    points: Float64Array
    piece: Int32Array
    distance: Float64Array

    @property
    def length(self) -> float:
        """Metres walked."""
        return float(self.distance[-1])


@dataclass(frozen=True, slots=True, kw_only=True)
class WalkOptions:
    """How a path is walked, and what is looked at.

    Attributes:
        speed: m/s.
        frame_rate: Frames a second.
        half_life: Seconds after which half of a jump is left to be blended in; 0 does not blend.
        normal: The chosen normal; any length but zero.
        column: Which of the baked distances, as an index; negative ones count from the last.

    Raises:
        SettingsError: on construction, if a value is out of its bounds.
    """

    speed: float = 1.5
    frame_rate: float = 60.0
    half_life: float = 0.25
    normal: tuple[float, float, float] = (0.0, 1.0, 0.0)
    column: int = -1

    def __post_init__(self) -> None:
        for option, value, low, high in (
            ("speed", self.speed, 0.01, 1000.0),
            ("fps", self.frame_rate, 1.0, 1000.0),
            ("half-life", self.half_life, 0.0, 60.0),
        ):
            if not low <= value <= high:
                raise SettingsError(
                    f"{value!r} is out of range", where=f"--{option}", remedy=f"use {low:g} to {high:g}"
                )
        if len(self.normal) != 3 or not 1e-12 < math.hypot(*self.normal) < math.inf:
            raise SettingsError(f"{self.normal!r} is no direction", where="--normal", remedy="write X,Y,Z")

    @property
    def normals(self) -> Float64Array:
        """The six axis normals and the chosen one, shape (7, 3), unit."""
        chosen = np.array(self.normal, np.float64)
        return np.concatenate([AXIS_NORMALS, (chosen / np.linalg.norm(chosen))[None]])


@dataclass(frozen=True, slots=True)
class PathTruth:
    """What was traced along a path, kept by place: it serves every speed, frame rate, normal and distance.

    Attributes:
        distance: Shape (t,), float64, ascending: where along the path, in metres walked.
        piece: Shape (t,), int32: on which piece.
        sh: Shape (t, 9, k), float32: convolved like the models.
        directions: Rays from each place.
        valid: Shape (t,), bool: places that do not see too many back faces; the others lie inside something.
        error: Shape (k,), float64: RMS over six axis normals of what interpolation between the places gets wrong, as
            measured at places half-way between some of them.
    """

    distance: Float64Array
    piece: Int32Array
    sh: Float32Array
    directions: int
    valid: BoolArray
    error: Float64Array


@dataclass(frozen=True, slots=True)
class Pop:
    """A frame on which the character visibly jumps.

    Attributes:
        variant: Where it was found.
        frame: The first frame that shows it.
        time: s.
        before, after: Indices of the regions on either side of the boundary at fault; equal if the character crossed
            none (a kink or steep model inside a region).
        normal: Column of `Walk.ao` that jumps most, in codes.
        step: AO of this frame minus that of the frame before.
        codes: The same in 8-bit sRGB codes under ambient 1.0, unrounded, 0 or more.
    """

    variant: Variant
    frame: int
    time: float
    before: int
    after: int
    normal: int
    step: float
    codes: float


@dataclass(frozen=True, slots=True)
class WalkMetrics:
    """How one variant did, over all frames and seven normals; NaN where it cannot be told.

    Attributes:
        worst_step: Largest step of AO from frame to frame.
        worst_codes: The same in 8-bit sRGB codes.
        high_step: 99.9th percentile of the steps.
        worst_boundary_step: Largest step on a frame on which the region changed.
        jump_ratio: Largest over median step.
        excess_variation: Σ|step| over that of the truth.
        lag: Seconds from a boundary until the region that was left counts a tenth or less; the median.
        mean_error, max_error: |AO - truth|.
        pops: How many were found.
    """

    worst_step: float
    worst_codes: float
    high_step: float
    worst_boundary_step: float
    jump_ratio: float
    excess_variation: float
    lag: float
    mean_error: float
    max_error: float
    pops: int


@dataclass(frozen=True, slots=True)
class Walk:
    """What a character sees on its way, a row a frame.

    Attributes:
        options: How it walked.
        time: Shape (n,), float64, s.
        distance: Shape (n,), float64: metres walked.
        position: Shape (n, 3), float64, metres relative to `World.origin`.
        region: Shape (n,), int32: the region that the character is tagged with.
        inside: Shape (n,), bool: whether any region holds the character.
        teleported: Shape (n,), bool: first frame of a piece of the path; no step leads to it.
        ao: By variant, shape (n, 7), float32, in [0, 1]: six axis normals, then the chosen one; the truth only if it
            was traced, NaN where it is not valid.
        pops: All variants, those of most codes first.
        metrics: By variant.
    """

    options: WalkOptions
    time: Float64Array
    distance: Float64Array
    position: Float64Array
    region: Int32Array
    inside: BoolArray
    teleported: BoolArray
    ao: Mapping[Variant, Float32Array]
    pops: tuple[Pop, ...]
    metrics: Mapping[Variant, WalkMetrics]

    def __len__(self) -> int:
        return len(self.time)
