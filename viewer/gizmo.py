"""Handles for moving, turning and scaling objects: their shape, which one a ray meets, and what a drag of it means."""

from __future__ import annotations

import dataclasses
import enum
import math
from dataclasses import dataclass

import numpy as np

from bake.types import Float32Array, Float64Array, Int32Array, UInt8Array

AXIS_COLORS = ((226, 74, 68), (112, 190, 66), (74, 132, 240))
CENTRE_COLOR = (225, 225, 225)
ACTIVE_COLOR = (255, 200, 40)
_ARROW_BEGIN, _ARROW_END, _HEAD = 0.16, 1.0, 0.16
_PLANE_LOW, _PLANE_HIGH = 0.30, 0.48
_RING, _RING_PARTS = 0.78, 48
_CENTRE = 0.085
_EDGE_ON = 0.05
"""Sine of the angle below which a plane is looked at too flatly to be dragged in."""


_Ray = tuple[Float64Array, Float64Array]


class Kind(enum.Enum):
    """What dragging a handle does."""

    MOVE_ALONG = "move along"
    MOVE_ACROSS = "move across"
    TURN = "turn about"
    SCALE = "scale"


@dataclass(frozen=True, slots=True)
class Handle:
    """One handle; `axis` is that which it moves along, across or turns about, -1 for scaling."""

    kind: Kind
    axis: int = -1


HANDLES = (
    Handle(Kind.SCALE),
    *(Handle(Kind.MOVE_ALONG, axis) for axis in range(3)),
    *(Handle(Kind.MOVE_ACROSS, axis) for axis in range(3)),
    *(Handle(Kind.TURN, axis) for axis in range(3)),
)


@dataclass(frozen=True, slots=True)
class Motion:
    """What a drag amounts to: scaled about the gizmo's centre, then turned about it, then moved.

    Attributes:
        shift: Metres.
        turn: Shape (3, 3), a rotation.
        factor: Positive.
        text: For people, in their units.
    """

    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn: Float64Array = dataclasses.field(default_factory=lambda: np.eye(3))
    factor: float = 1.0
    text: str = ""

    @property
    def is_still(self) -> bool:
        """Whether it leaves everything where it is."""
        return not any(self.shift) and self.factor == 1.0 and np.array_equal(self.turn, np.eye(3))

    def moved(self, points: Float64Array, centre: Float64Array) -> Float64Array:
        """Points after it, shape (n, 3)."""
        return centre + (self.factor * (points - centre)) @ self.turn.T + np.asarray(self.shift)


@dataclass(frozen=True, slots=True)
class Gizmo:
    """Handles around a point.

    Attributes:
        centre: Shape (3,), metres from the world's origin.
        size: Length of the arrows, metres.
        up: Upwards in the picture, unit, shape (3,).
    """

    centre: Float64Array
    size: float
    up: Float64Array

    def shapes(self, active: Handle | None) -> tuple[Float32Array, Int32Array, UInt8Array]:
        """Lines to be drawn: positions (n, 3), pairs (m, 2) and colours (n, 3).

        Args:
            active: The handle under the cursor or in the hand, drawn in another colour.
        """
        points: list[Float64Array] = []
        colors: list[UInt8Array] = []
        for handle in HANDLES:
            lines = self._lines(handle)
            color = CENTRE_COLOR if handle.axis < 0 else AXIS_COLORS[handle.axis]
            points.append(lines)
            colors.append(np.tile(np.array(ACTIVE_COLOR if handle == active else color, np.uint8), (len(lines), 1)))
        positions = self.centre + self.size * np.concatenate(points)
        pairs = np.arange(len(positions), dtype=np.int32).reshape(-1, 2)
        return positions.astype(np.float32), pairs, np.concatenate(colors)

    def handle_at(self, origin: Float64Array, direction: Float64Array, angle: float) -> Handle | None:
        """The handle nearest to a ray, among those within an angle of it, in radians."""
        best, nearest = None, angle
        for handle in HANDLES:
            lines = self.centre + self.size * self._lines(handle)
            shares = np.linspace(0.0, 1.0, 9)[:, None, None]
            points = ((1.0 - shares) * lines[::2] + shares * lines[1::2]).reshape(-1, 3) - origin
            along = points @ direction
            beside = np.linalg.norm(points - along[:, None] * direction, axis=1)
            away = float(np.min(np.where(along > 0.0, np.arctan2(beside, along), np.inf)))
            if away < nearest:
                best, nearest = handle, away
        return best

    def dragged(
        self, handle: Handle, start: tuple[Float64Array, Float64Array], now: tuple[Float64Array, Float64Array],
        *, snap: bool = False,
    ) -> Motion:  # fmt: skip
        """What a drag of a handle means.

        Args:
            handle: The handle.
            start, now: Rays (origin, unit direction) through the cursor where the drag began, and now.
            snap: To whole steps: a quarter of a metre, fifteen degrees, a tenth.
        """
        match handle.kind:
            case Kind.MOVE_ALONG:
                return self._along(handle.axis, start, now, snap)
            case Kind.MOVE_ACROSS:
                return self._across(handle.axis, start, now, snap)
            case Kind.TURN:
                return self._turned(handle.axis, start, now, snap)
            case Kind.SCALE:
                return self._scaled(start, now, snap)

    def _lines(self, handle: Handle) -> Float64Array:
        """Pairs of ends in units of the size around the centre, shape (2 n, 3)."""
        x, y, z = (np.eye(3)[(handle.axis + step) % 3] for step in range(3))
        match handle.kind:
            case Kind.MOVE_ALONG:
                tip, neck = _ARROW_END * x, (_ARROW_END - _HEAD) * x
                wings = [neck + 0.35 * _HEAD * side for side in (y, -y, z, -z)]
                ends = [_ARROW_BEGIN * x, tip]
                for number, wing in enumerate(wings):
                    ends += [wing, tip, wing, wings[(2, 3, 1, 0)[number]]]
                return np.array(ends)
            case Kind.MOVE_ACROSS:
                low, high = _PLANE_LOW, _PLANE_HIGH
                corners = [low * y + low * z, high * y + low * z, high * y + high * z, low * y + high * z]
                return np.array([corner for k in range(4) for corner in (corners[k], corners[(k + 1) % 4])])
            case Kind.TURN:
                angles = np.linspace(0.0, 2.0 * math.pi, _RING_PARTS + 1)[:, None]
                ring = _RING * (np.cos(angles) * y + np.sin(angles) * z)
                return np.stack((ring[:-1], ring[1:]), axis=1).reshape(-1, 3)
            case Kind.SCALE:
                corners = _CENTRE * np.array(
                    [[1 - 2 * (bit >> axis & 1) for axis in range(3)] for bit in range(8)], float
                )
                pairs = [(a, a | 1 << axis) for a in range(8) for axis in range(3) if not a >> axis & 1]
                return corners[np.array(pairs).ravel()]

    def _along(self, axis: int, start: _Ray, now: _Ray, snap: bool) -> Motion:
        line = np.eye(3)[axis]
        length = self._place_along(line, now) - self._place_along(line, start)
        length = _stepped(length, 0.25, snap)
        x, y, z = (length * line).tolist()
        return Motion((x, y, z), text=f"{length:+.3f} m along {'XYZ'[axis]}")

    def _across(self, axis: int, start: _Ray, now: _Ray, snap: bool) -> Motion:
        normal = np.eye(3)[axis]
        shift = self._place_across(normal, now) - self._place_across(normal, start)
        shift[axis] = 0.0
        x, y, z = (_stepped(value, 0.25, snap) for value in shift.tolist())
        parts = [f"{value:+.3f} m {'XYZ'[k]}" for k, value in enumerate((x, y, z)) if k != axis]
        return Motion((x, y, z), text=", ".join(parts))

    def _turned(self, axis: int, start: _Ray, now: _Ray, snap: bool) -> Motion:
        normal = np.eye(3)[axis]
        angles = []
        for ray in (start, now):
            offset = self._place_across(normal, ray) - self.centre
            angles.append(math.atan2(offset[(axis + 2) % 3], offset[(axis + 1) % 3]))
        degrees = math.degrees(math.remainder(angles[1] - angles[0], math.tau))
        degrees = _stepped(degrees, 15.0, snap)
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        turn = np.eye(3)
        a, b = (axis + 1) % 3, (axis + 2) % 3
        turn[a, a], turn[a, b], turn[b, a], turn[b, b] = c, -s, s, c
        return Motion(turn=turn if degrees else np.eye(3), text=f"{degrees:+.1f}° about {'XYZ'[axis]}")

    def _scaled(self, start: _Ray, now: _Ray, snap: bool) -> Motion:
        """Up the picture is larger: the height of the cursor over the start, in lengths of the arrows."""
        depth = max(float(np.linalg.norm(self.centre - now[0])), 1e-9)
        rise = float((now[1] - start[1]) @ self.up) * depth / self.size
        factor = _stepped(min(max(math.exp(rise), 0.01), 100.0), 0.1, snap)
        factor = max(factor, 0.1 if snap else 0.01)
        return Motion(factor=factor, text=f"x {factor:.3f}")

    def _place_along(self, line: Float64Array, ray: _Ray) -> float:
        """How far along a line through the centre it comes nearest to a ray."""
        origin, direction = ray
        across = direction - (direction @ line) * line
        square = float(across @ across)
        if square < _EDGE_ON**2:  # looked at from its end
            return 0.0
        offset = self.centre - origin
        reach = float(offset @ across) / square
        return float((reach * direction - offset) @ line)

    def _place_across(self, normal: Float64Array, ray: _Ray) -> Float64Array:
        """Where a ray meets a plane through the centre; where it hardly does, its point beside the centre."""
        origin, direction = ray
        facing = float(direction @ normal)
        offset = self.centre - origin
        if abs(facing) < _EDGE_ON or float(offset @ normal) / facing <= 0.0:
            point = origin + float(offset @ direction) * direction
            return point - ((point - self.centre) @ normal) * normal
        return origin + float(offset @ normal) / facing * direction


def _stepped(value: float, step: float, snap: bool) -> float:
    return round(value / step) * step if snap else value
