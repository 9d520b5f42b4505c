"""Objects that enclose the rest of the scene: a sky dome that blocks light is a classic cause of black bakes."""

from __future__ import annotations

import numpy as np

from bake.scene.extent import box_of, used_positions
from bake.scene.remembered import remembered
from bake.types import Float64Array, Int32Array, Scene

DIRECTIONS = 64
COVERED_SHARE = 0.9  # of the directions that must end on the shell
MOST_FACES = 50_000  # shells are coarse; an object of more triangles is the level itself
TOLERANCE = 0.01  # by which the rest may stick out of the shell, as a share of its size


def enclosing_objects(
    scene: Scene, boxes: Float64Array, known: dict[tuple[int, bytes, bytes], float] | None = None
) -> list[int]:
    """Numbers of the objects that cast and close off the space around everything else.

    The rest must lie inside the object's box, and nine of ten directions must end on the object: all those around the
    middle of the rest, or where the file says what is up, those above the horizon at the top of the rest.

    Args:
        scene: With roles.
        boxes: Shape (o, 2, 3): world bounding box of each object.
        known: Shares of directions that shells cover, by mesh (its identity), transform and centre; it is added to.
    """
    known = {} if known is None else known
    casting = [number for number, item in enumerate(scene.objects) if item.role.casts_opaque]
    if len(casting) < 2:
        return []
    low, high = boxes[casting, 0], boxes[casting, 1]
    found: list[int] = []
    slack = TOLERANCE * (high - low)
    around = ((low.min(axis=0) >= low - slack) & (high.max(axis=0) <= high + slack)).all(axis=1)
    for place in np.flatnonzero(around).tolist():
        number = casting[place]
        item = scene.objects[number]
        if len(scene.meshes[item.mesh].faces) > MOST_FACES:
            continue
        others = np.arange(len(casting)) != place
        centre = 0.5 * (low[others].min(axis=0) + high[others].max(axis=0))
        if scene.up_axis >= 0:
            centre[scene.up_axis] = high[others, scene.up_axis].max()
        mesh = scene.meshes[item.mesh]
        key = (id(mesh), item.transform.tobytes(), centre.tobytes())
        if key not in known:
            corners = (mesh.positions @ item.transform[:3, :3].T + (item.transform[:3, 3] - centre))[mesh.faces]
            known[key] = _covered_share(corners, _directions(scene.up_axis))
        if known[key] >= COVERED_SHARE:
            found.append(number)
    return found


def _directions(up_axis: int) -> Float64Array:
    """Evenly spread unit vectors, shape (DIRECTIONS, 3): a Fibonacci sphere, or its upper half."""
    turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(DIRECTIONS)
    height = (np.arange(DIRECTIONS) + 0.5) / DIRECTIONS
    height = height if up_axis >= 0 else 2.0 * height - 1.0
    radius = np.sqrt(1.0 - height * height)
    vectors = np.stack((radius * np.cos(turn), radius * np.sin(turn), height), axis=1)
    return np.roll(vectors, up_axis - 2, axis=1) if up_axis >= 0 else vectors


def _covered_share(corners: Float64Array, directions: Float64Array) -> float:
    """Share of rays from the origin that meet a triangle of `corners`, shape (m, 3, 3)."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    # The ray d is inside the cone over a triangle if d·(a×b), d·(b×c) and d·(c×a) have one sign, that of a·(b×c).
    sides = [np.cross(a, b), np.cross(b, c), np.cross(c, a)]
    volume = np.einsum("ij,ij->i", a, sides[1])
    orientation = np.sign(volume)
    covered = np.zeros(len(directions), np.bool_)
    for begin in range(0, len(corners), 8192):
        part = slice(begin, begin + 8192)
        inside = np.ones((len(a[part]), len(directions)), np.bool_)
        for side in sides:
            inside &= (side[part] @ directions.T) * orientation[part, None] >= 0.0
        covered |= (inside & (orientation[part, None] != 0.0)).any(axis=0)
    return float(covered.mean())


@remembered
def box_corners(positions: Float64Array, faces: Int32Array) -> Float64Array:
    """The eight corners of the box around the vertices in use, shape (8, 3)."""
    low, high = box_of(used_positions(positions, faces))
    choice = np.array([[(corner >> axis) & 1 for axis in range(3)] for corner in range(8)])
    return low + choice * (high - low)
