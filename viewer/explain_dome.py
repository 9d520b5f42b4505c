"""The hemisphere over an explained spot as a disc: which direction is lost to what.

Rays are spread by the cosine with the normal, so the plain projection onto the tangent plane (Nusselt 1928) spreads
them evenly: equal areas of the disc count the same for the value.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bake.explain.types import Explanation, TracedRays
from bake.types import BoolArray, Float32Array, Float64Array, Int32Array

MOST_DOTS = 6144
UP = np.array([0.0, 1.0, 0.0])
_BELOW = 1.05
"""Radius at which rays are drawn that leave below the plane of the spot, as those of bent neighbours may."""


@dataclass(frozen=True, slots=True)
class Dome:
    """Rays of the heaviest samples over one spot.

    Attributes:
        tangents: Shape (2, 3), float64: directions of x and y of the disc; with the normal they are right-handed.
        position: Shape (m, 2), float32: on the disc of radius 1, or at `_BELOW` if the ray leaves below the plane.
        counts: Shape (m,), float32: what the ray counts for, from 0 (lost) to 1 (open).
        object: Shape (m,), int32: what stops the ray, or dims it most; -1 if nothing does.
        distance: Shape (m,), float32: metres to what stops it; infinite if nothing does.
        samples: How many samples the rays belong to.
    """

    tangents: Float64Array
    position: Float32Array
    counts: Float32Array
    object: Int32Array
    distance: Float32Array
    samples: int

    def __len__(self) -> int:
        return len(self.counts)

    def nearest(self, x: float, y: float, within: float) -> int:
        """The ray drawn nearest to a point of the disc, -1 if none is within a distance."""
        if not len(self):
            return -1
        away = np.square(self.position - np.array([x, y], np.float32)).sum(axis=1)
        ray = int(away.argmin())
        return ray if float(away[ray]) <= within * within else -1

    def angle_of(self, direction: Float64Array) -> float | None:
        """Where on the disc a direction points, radians against the clock from x; None if it is along the normal."""
        x, y = self.tangents @ direction
        return math.atan2(y, x) if math.hypot(x, y) > 0.05 * float(np.linalg.norm(direction)) else None


def dome_of(explanation: Explanation, column: int) -> Dome:
    """The rays of the samples that count for the value.

    Args:
        explanation: Of the spot, with the rays of its heaviest samples.
        column: Whose ρ.
    """
    rays, weight = explanation.rays, explanation.samples.weight[: len(explanation.rays.sample)]
    normal = explanation.spot.normal
    tangents = tangents_of(normal)
    chosen = np.flatnonzero(weight > 0.0)
    per_sample = rays.face.shape[1]
    flat = (chosen[:, None] * per_sample + np.arange(per_sample)).ravel()
    flat = flat[:: max(1, -(-len(flat) // MOST_DOTS))]
    direction = rays.direction.reshape(-1, 3)[flat].astype(np.float64)
    position = direction @ tangents.T
    below = direction @ normal < 0.0
    position[below] *= _BELOW / np.maximum(np.linalg.norm(position[below], axis=1), 1e-6)[:, None]
    stopped = rays.face.ravel()[flat] >= 0
    return Dome(
        tangents=tangents,
        position=position.astype(np.float32),
        counts=rays.open_share[:, :, column].ravel()[flat].astype(np.float32),
        object=_takers(rays)[flat],
        distance=np.where(stopped, rays.distance.ravel()[flat], np.inf).astype(np.float32),
        samples=len(chosen),
    )


def tangents_of(normal: Float64Array) -> Float64Array:
    """Two directions across a normal, shape (2, 3): y is as far up as it can be, or north (-z) over level ground."""
    up = UP if abs(float(normal @ UP)) < 0.95 else np.array([0.0, 0.0, -1.0])
    y = up - float(up @ normal) * normal
    y /= np.linalg.norm(y)
    return np.stack([np.cross(y, normal), y])


def horizon_of(dome: Dome, normal: Float64Array, points: int = 48) -> Float64Array:
    """The level directions above the spot's plane as a line on the disc, shape (p, 2); empty over level ground."""
    if abs(float(normal @ UP)) > 0.995:
        return np.zeros((0, 2))
    across = np.cross(UP, normal)
    across /= np.linalg.norm(across)
    ahead = np.cross(across, UP)
    turn = np.linspace(0.0, math.pi, points)
    level = np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * ahead
    return level @ dome.tangents.T


def belongs(dome: Dome, owner: int) -> BoolArray:
    """Which rays an object stops or dims most, shape (m,); all with -1."""
    return np.ones(len(dome), np.bool_) if owner < 0 else dome.object == owner


def _takers(rays: TracedRays) -> Int32Array:
    """What stops each ray, else what dims it most, flat; -1 for neither."""
    taker = rays.object.ravel().copy()
    crossing = rays.crossings
    rising = np.argsort(crossing.depth, kind="stable")  # the densest is written last
    ray, dimmer = crossing.ray[rising], crossing.object[rising]
    free = taker[ray] < 0
    taker[ray[free]] = dimmer[free]
    return taker
