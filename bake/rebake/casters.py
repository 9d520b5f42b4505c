"""The parts of two worlds that rays see differently, covered by spheres and boxes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.change_types import WorldChange
from bake.decorator_types import FogBoxes
from bake.geometry import as_traced
from bake.rebake.changes import ray_faces
from bake.types import BoolArray, Float32Array, Float64Array, Int64Array, World

MOST_SPHERES = 16
"""Most spheres that cover what changed of one object."""

_GAIN = 0.8  # a sphere is split if the two halves cover that much less of a distant view


@dataclass(frozen=True, slots=True)
class Parts:
    """What one of the two worlds has and the other has not.

    Attributes:
        centre, radius: Shape (s, 3) and (s,), float64, metres relative to `World.origin`: spheres that hold it.
        low, high: Shape (b, 3), float32: boxes that hold it, one an object or a fog box.
        opaque: Shape (b,), bool: whether the box holds faces that stop rays.
    """

    centre: Float64Array
    radius: Float64Array
    low: Float32Array
    high: Float32Array
    opaque: BoolArray

    def __len__(self) -> int:
        return len(self.low)


@dataclass(frozen=True, slots=True)
class Casters:
    """What an edit changes for rays.

    Attributes:
        before: What is gone, or lay elsewhere.
        after: What is new, or lies elsewhere now.
    """

    before: Parts
    after: Parts

    def __len__(self) -> int:
        return len(self.before) + len(self.after)

    @property
    def boxes(self) -> tuple[Float32Array, Float32Array]:
        """All boxes, shape (b, 3) twice."""
        low = np.concatenate([self.before.low, self.after.low])
        return low, np.concatenate([self.before.high, self.after.high])


def changed_casters(
    old: World, new: World, change: WorldChange, old_fog: FogBoxes | None, new_fog: FogBoxes | None
) -> Casters:
    """What rays see differently: faces that are not carried, and boxes of fog that differ.

    Args:
        old, new: Both worlds, of one origin.
        change: How one follows from the other.
        old_fog, new_fog: Their fog.
    """
    gone, come = _fog_changes(old_fog, new_fog, change)
    before = _parts(old, np.flatnonzero(change.object_cast_before), change.new_face < 0, old_fog, gone)
    after = _parts(new, np.flatnonzero(change.object_casts_anew), change.old_face < 0, new_fog, come)
    return Casters(before, after)


def _fog_changes(old: FogBoxes | None, new: FogBoxes | None, change: WorldChange) -> tuple[Int64Array, Int64Array]:
    """Rows of both sets of boxes that have no equal in the other."""

    def keys(fog: FogBoxes | None) -> list[bytes]:
        if fog is None:
            return []
        rows = np.concatenate([fog.minimum, fog.maximum, fog.density[:, None]], axis=1).astype(np.float32)
        return [row.tobytes() for row in rows]

    a, b = keys(old), keys(new)
    in_a, in_b = set(a), set(b)
    gone = np.array([row for row, key in enumerate(a) if key not in in_b], np.int64)
    come = np.array([row for row, key in enumerate(b) if key not in in_a], np.int64)
    return gone, come


def _parts(world: World, objects: Int64Array, differs: BoolArray, fog: FogBoxes | None, boxes: Int64Array) -> Parts:
    notices = ray_faces(world)
    centre: list[Float64Array] = []
    radius: list[Float64Array] = []
    low: list[Float32Array] = []
    high: list[Float32Array] = []
    opaque: list[bool] = []
    for number in objects.tolist():
        own = slice(int(world.first_face[number]), int(world.first_face[number + 1]))
        chosen = np.flatnonzero(differs[own] & notices[own]) + own.start
        corners = as_traced(world.positions[world.faces[chosen].ravel()]).reshape(-1, 3, 3)
        spheres = cover(corners.astype(np.float64))
        centre.append(spheres[0])
        radius.append(spheres[1])
        low.append(corners.min(axis=(0, 1)))
        high.append(corners.max(axis=(0, 1)))
        opaque.append(bool(world.face_casts[chosen].any()))
    if fog is not None and len(boxes):
        a, b = fog.minimum[boxes], fog.maximum[boxes]
        centre.append(0.5 * (a.astype(np.float64) + b))
        radius.append(0.5 * np.linalg.norm(b.astype(np.float64) - a, axis=1))
        low += list(a)
        high += list(b)
        opaque += [False] * len(boxes)
    return Parts(
        centre=np.concatenate(centre) if centre else np.zeros((0, 3)),
        radius=np.concatenate(radius) if radius else np.zeros(0),
        low=np.array(low, np.float32).reshape(-1, 3),
        high=np.array(high, np.float32).reshape(-1, 3),
        opaque=np.array(opaque, np.bool_),
    )


def cover(corners: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Spheres that together hold triangles, few where one is as good: centres (s, 3) and radii (s,).

    A sphere is split in two at the middle of its longest axis as long as that makes what they may hide from afar, the
    sum of the squared radii, clearly less.

    Args:
        corners: Shape (t, 3, 3), at least one triangle.
    """
    done: list[tuple[Float64Array, float]] = []
    waiting = [(corners, *_sphere(corners))]
    while waiting:
        waiting.sort(key=lambda item: item[2])
        triangles, centre, radius = waiting.pop()
        halves = _halves(triangles) if len(done) + len(waiting) + 2 <= MOST_SPHERES else None
        if halves is not None:
            both = [(half, *_sphere(half)) for half in halves]
            if sum(item[2] ** 2 for item in both) < _GAIN * radius**2:
                waiting += both
                continue
        done.append((centre, radius))
    return np.array([item[0] for item in done]), np.array([item[1] for item in done])


def _sphere(corners: Float64Array) -> tuple[Float64Array, float]:
    points = corners.reshape(-1, 3)
    centre: Float64Array = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return centre, float(np.sqrt(np.square(points - centre).sum(axis=1).max()))


def _halves(corners: Float64Array) -> tuple[Float64Array, Float64Array] | None:
    middle = corners.mean(axis=1)
    extent = middle.max(axis=0) - middle.min(axis=0)
    axis = int(extent.argmax())
    left = middle[:, axis] < middle[:, axis].min() + 0.5 * extent[axis]
    if left.all() or not left.any():
        return None
    return corners[left], corners[~left]
