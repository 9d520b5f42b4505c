"""All about a walk that no model decides: where the character is, in which region, and which regions are around."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.regions.boxes import Boxes
from bake.types import BoolArray, Float64Array, Int32Array, Regions
from bake.walk.frames import Frames, frames_along
from bake.walk.lag import Leavings, leavings
from bake.walk.spatial import SpatialBlend, Weights
from bake.walk.tags import tag_regions
from bake.walk.types import WalkPath


@dataclass(frozen=True, slots=True)
class Course:
    """A path laid out over the frames of one speed and frame rate; it serves any models of the same regions.

    Attributes:
        path: What was laid out.
        speed, frame_rate: m/s and Hz.
        frames: The frames.
        region: Shape (n,), int32: the region that the character is tagged with.
        inside: Shape (n,), bool: whether any region holds it.
        place: Shape (n, 3): where the tagged region's model is evaluated: in its box, where the character is outside.
        weights: What the regions around count in the spatial blend.
        weighed_place: Shape (w, 3): where the model of each row of the weights is evaluated.
        leavings: What the regions count around the moments at which they are left.
    """

    path: WalkPath
    speed: float
    frame_rate: float
    frames: Frames
    region: Int32Array
    inside: BoolArray
    place: Float64Array
    weights: Weights
    weighed_place: Float64Array
    leavings: Leavings


def lay_out(regions: Regions, path: WalkPath, *, speed: float, frame_rate: float) -> Course:
    """Lays a path out over frames and regions.

    Raises:
        InputError: more frames than anyone could look at.
    """
    frames = frames_along(path, speed=speed, frame_rate=frame_rate)
    boxes = Boxes(regions.graph, regions.points)
    region, inside = tag_regions(regions.graph, boxes, frames.position, frames.teleported)
    place = boxes.clamped(region, frames.position)
    weights = SpatialBlend(regions.graph, boxes).weights(frames.position, place, region)
    rows = np.repeat(np.arange(len(frames)), np.diff(weights.first))
    weighed = boxes.clamped(weights.region, frames.position[rows])
    left = leavings(region, frames.teleported, weights, frame_rate=frame_rate)
    return Course(path, speed, frame_rate, frames, region, inside, place, weights, weighed, left)
