"""The ground: hills around levelled sites, a plain beyond them, and a ring of mountains far away."""

from __future__ import annotations

import numpy as np

from assets.sample_level.level import Level
from assets.sample_level.mesh import Points, Solid, shaded, welded
from assets.sample_level.randomness import value_noise
from assets.sample_level.shapes import graded_between, height_field, sheet

HALF = 60.0  # the detailed ground reaches this far from the middle [m]

# Levelled sites: x0, z0, x1, z1 and the height they lie at.
SITES = (
    (-11.5, -9.0, 24.0, 10.0, 0.0),  # house and yard
    (-34.5, -26.5, -25.5, -17.5, 1.5),  # tower
    (19.0, 24.5, 50.0, 36.5, -0.5),  # dark corner
    (24.0, -26.0, 38.0, -14.0, 0.8),  # colonnade
)
_BLEND = 9.0  # a site's level fades into the hills over this width [m]


def ground_height(x: Points, z: Points) -> Points:
    """Height of the ground in metres, any shape; 0 at and beyond the edge of the detailed ground."""
    hills = 2.3 * np.sin(0.071 * x + 1.3) * np.cos(0.063 * z - 0.4) + 1.2 * np.sin(0.13 * x - 0.11 * z)
    flat = np.stack([np.ravel(x) * 0.21, np.zeros(np.size(x)), np.ravel(z) * 0.21], axis=1)
    rough = value_noise(flat, 11) * 0.55 + value_noise(flat * 3.1, 12) * 0.12
    height = hills + rough.reshape(np.shape(x)) + 0.6
    for x0, z0, x1, z1, level in SITES:
        away = np.hypot(np.maximum(np.maximum(x0 - x, x - x1), 0), np.maximum(np.maximum(z0 - z, z - z1), 0))
        t = np.clip(away / _BLEND, 0.0, 1.0)
        t = t * t * (3 - 2 * t)
        height = level + (height - level) * t
    edge = np.clip((HALF - np.maximum(np.abs(x), np.abs(z))) / 14.0, 0.0, 1.0)
    return height * edge * edge * (3 - 2 * edge)


# The ground's lines lie closer where there is something to cast a contact shadow.
_XS = graded_between([-HALF, -11.0, -5.0, 0.0, 5.0, 10.0, 15.5, 20.0, 24.0, 29.0, 34.0, 38.0, 48.5, HALF], 2.0, 0.6)
_ZS = graded_between([-HALF, -25.0, -20.0, -15.0, -7.0, -2.0, 3.0, 8.0, 26.5, 30.5, 34.5, HALF], 2.0, 0.6)


def surface_height(x: Points, z: Points) -> Points:
    """Height of the ground's triangles at places inside its edge, shape (n,): what things stand on."""
    i = np.clip(np.searchsorted(_XS, x, "right") - 1, 0, len(_XS) - 2)
    j = np.clip(np.searchsorted(_ZS, z, "right") - 1, 0, len(_ZS) - 2)
    s, t = (x - _XS[i]) / (_XS[i + 1] - _XS[i]), (z - _ZS[j]) / (_ZS[j + 1] - _ZS[j])
    a, b, c, d = (ground_height(_XS[i + u], _ZS[j + v]) for u, v in ((0, 0), (1, 0), (1, 1), (0, 1)))
    rising = np.where(s >= t, a + s * (b - a) + t * (c - b), a + t * (d - a) + s * (c - d))
    falling = np.where(s + t <= 1, a + s * (b - a) + t * (d - a), c + (1 - s) * (d - c) + (1 - t) * (b - c))
    return np.where((i + j) % 2 == 0, rising, falling)  # the two ways that `shapes.grid_faces` cuts a cell


def height_at(x: float, z: float) -> float:
    """Height of the ground's triangles at one place."""
    return float(surface_height(np.array([x]), np.array([z]))[0])


def add_terrain(level: Level) -> None:
    """Ground, plain and mountains."""
    level.place("Terrain/Ground", (shaded(height_field(_XS, _ZS, ground_height), "Grass", crease=80.0),))
    level.place("Backdrop/Plain", (shaded(_plain(), "Meadow", crease=80.0),))
    level.place("Backdrop/Mountains", (shaded(_mountains(), "Rock", crease=28.0),))


def _square_edge() -> Points:
    """Twelve points a side along the edge of the detailed ground and the first one again, shape (49, 3)."""
    side = np.linspace(-HALF, HALF, 13)[:-1]
    corner = np.full(12, HALF)
    x = np.concatenate([side, corner, -side, -corner, side[:1]])
    z = np.concatenate([-corner, side, corner, -side, -corner[:1]])
    return np.stack([x, np.zeros(49), z], axis=1)


def _ring(radius: float) -> Points:
    """The directions of the square's points, at one distance and height 0, shape (49, 3)."""
    edge = _square_edge()
    return edge * (radius / np.hypot(edge[:, 0], edge[:, 2]))[:, None]


def _plain_ring(radius: float, height: float) -> Points:
    ring = _ring(radius)
    ring[:, 1] = height + 0.012 * radius * value_noise(ring / 90.0, 21)
    return ring


_FOOT = (1000.0, -2.0)  # where the plain ends and the mountains begin: distance and mean height


def _plain() -> Solid:
    """Rings from the square edge of the ground out to the foot of the mountains."""
    rings = [(110.0, -2.0), (190.0, -5.0), (330.0, -8.0), (580.0, -6.0), _FOOT]
    return welded(sheet(np.stack([_square_edge(), *(_plain_ring(*ring) for ring in rings)])).flipped())


def _mountains() -> Solid:
    """Large triangles from 1 to 3 km: foothills, a broken ridge at about 2.2 km, and its far side."""
    rows = [_plain_ring(*_FOOT)]
    for i, (radius, height) in enumerate(((1300.0, 60.0), (1650.0, 190.0), (2200.0, 430.0), (2600.0, 210.0))):
        place = _ring(1.0) + np.array([0.0, 0.7 * i, 0.0])
        far = _ring(1.0) * (radius + 120.0 * value_noise(place * (5.0, 1.0, 5.0), 32))[:, None]
        far[:, 1] = height * (1.0 + 0.55 * value_noise(place * (4.0, 1.0, 4.0) + 9.0, 31))
        rows.append(far)
    outer = _ring(3000.0)
    outer[:, 1] = -60.0
    return welded(sheet(np.stack([*rows, outer])).flipped())
