"""Where a side file puts an object: moved, turned and scaled about the object's own origin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, cast

import numpy as np

from bake.errors import SceneError
from bake.scene.extent import box_of
from bake.scene.parsed import Placement
from bake.types import Float64Array, Mesh, Placing

PLACING_KEYS = ("translate", "rotate", "scale")
FARTHEST, STEEPEST, LARGEST_SCALE = 1e9, 36_000.0, 1e6
"""Limits of metres, degrees and factors."""


def check_placing(name: str, value: Any, where: str) -> tuple[float, float, float]:
    """A placing key's three numbers; one number as `scale` stands for all three.

    Raises:
        SceneError: no numbers, too large ones, or a scale that is not positive.
    """
    items: list[Any] = [value] if not isinstance(value, list | tuple) else [*cast("Sequence[Any]", value)]
    numbers = [float(item) for item in items if isinstance(item, int | float) and not isinstance(item, bool)]
    if name == "scale" and len(items) == len(numbers) == 1 and not isinstance(value, list | tuple):
        numbers = items = numbers * 3
    shown = str(items if len(items) > 1 else items[0] if items else items)[:40]
    limit = {"translate": FARTHEST, "rotate": STEEPEST}.get(name, LARGEST_SCALE)
    fits = len(items) == len(numbers) == 3 and all(-limit <= number <= limit for number in numbers)
    if not fits or (name == "scale" and not all(number >= 1.0 / LARGEST_SCALE for number in numbers)):
        expected = {
            "translate": "three numbers in metres, [x, y, z]",
            "rotate": "three angles in degrees, [x, y, z]",
        }.get(name, f"a factor from {1.0 / LARGEST_SCALE:g} to {LARGEST_SCALE:g}, or three, [x, y, z]")
        raise SceneError(f"{name} is {shown!r}", where=where, remedy=f"use {expected}")
    return numbers[0], numbers[1], numbers[2]


class Placer:
    """Applies placing keys to the objects of one file; what instances share is worked out once.

    Args:
        meshes: Of the file.
    """

    def __init__(self, meshes: Sequence[Mesh]) -> None:
        self._meshes = meshes
        self._centres: dict[int, Float64Array] = {}

    def placing(self, placement: Placement, keys: Mapping[str, Any]) -> Placing:
        """What is said of a placement, with its own origin.

        The own origin is where the file's node stands; for files without nodes, the centre of the object's box.
        """
        if placement.node >= 0:
            pivot = placement.transform[:3, 3]
        else:
            pivot = placement.transform[:3, :3] @ self._centre(placement.mesh) + placement.transform[:3, 3]
        said = {name: keys[name] for name in PLACING_KEYS if name in keys}
        return Placing(pivot=(float(pivot[0]), float(pivot[1]), float(pivot[2])), **said)

    def _centre(self, mesh: int) -> Float64Array:
        if mesh not in self._centres:
            positions = self._meshes[mesh].positions
            bounds = box_of(positions) if len(positions) else (np.zeros(3), np.zeros(3))
            self._centres[mesh] = 0.5 * (bounds[0] + bounds[1])
        return self._centres[mesh]


def placed(transform: Float64Array, placing: Placing) -> Float64Array:
    """A file's transform, moved as a side file says.

    The linear part A becomes R A S: scaled along the object's own axes by S, then turned by R about the world's x,
    y and z axes, in this order; the own origin stays where it is and is then moved by `translate`.

    Args:
        transform: Shape (4, 4), float64, object to world.
        placing: What is said.

    Returns:
        Shape (4, 4), float64; `transform` itself, to the bit, where nothing is said.
    """
    if placing.is_as_stored:
        return transform
    result = np.array(transform, np.float64)
    linear = transform[:3, :3]
    if placing.scale != (1.0, 1.0, 1.0) or placing.rotate != (0.0, 0.0, 0.0):
        linear = rotation(placing.rotate) @ (linear * np.asarray(placing.scale))
        pivot = np.asarray(placing.pivot)
        inside = _solved(transform[:3, :3], pivot - transform[:3, 3])  # the own origin in object space
        result[:3, :3] = linear
        result[:3, 3] = pivot - linear @ inside
    result[:3, 3] += np.asarray(placing.translate)
    return result


def rotation(degrees: Sequence[float]) -> Float64Array:
    """Turns about the world's x, then y, then z axis, shape (3, 3), float64.

    Args:
        degrees: Three angles, counter-clockwise seen against the axis.
    """
    result = np.eye(3)
    for axis, angle in enumerate(np.radians(degrees)):
        c, s = np.cos(angle), np.sin(angle)
        a, b = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(3)
        turn[a, a], turn[a, b], turn[b, a], turn[b, b] = c, -s, s, c
        result = turn @ result
    return result


def rotation_degrees(turn: Float64Array) -> tuple[float, float, float]:
    """The angles about x, y and z, in degrees, of which `rotation` makes a turn, shape (3, 3)."""
    y = float(np.degrees(np.arcsin(np.clip(-turn[2, 0], -1.0, 1.0))))
    if abs(turn[2, 0]) < 1.0 - 1e-12:
        x, z = np.arctan2(turn[2, 1], turn[2, 2]), np.arctan2(turn[1, 0], turn[0, 0])
    else:  # x and z turn about one axis: all is said of z
        x, z = 0.0, np.arctan2(-turn[0, 1], turn[1, 1])
    return float(np.degrees(x)), y, float(np.degrees(z))


def _solved(linear: Float64Array, point: Float64Array) -> Float64Array:
    """The object-space point that a linear map takes to `point`; the nearest one where it flattens the object."""
    if not point.any():
        return np.zeros(3)
    return np.asarray(np.linalg.lstsq(linear, point, rcond=None)[0], np.float64)
