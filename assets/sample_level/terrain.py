"""The ground: hills around levelled sites, a plain beyond them, and a ring of mountains far away."""

from __future__ import annotations

import numpy as np

from assets.sample_level.level import Level
from assets.sample_level.mesh import Points, joined, shaded, welded
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


def height_at(x: float, z: float) -> float:
    """Height of the ground at one place."""
    return float(ground_height(np.array([x]), np.array([z]))[0])


def add_terrain(level: Level) -> None:
    """Ground, plain and mountains."""
    xs = graded_between([-HALF, -11.0, -6.0, 0.0, 9.0, 15.5, 20.5, 48.5, HALF], 2.0, 0.75)
    zs = graded_between([-HALF, -25.0, -15.0, -7.0, 0.0, 7.0, 27.0, 33.0, HALF], 2.0, 0.75)
    level.place("Terrain/Ground", (shaded(height_field(xs, zs, ground_height), "Grass", crease=80.0),))
    level.place("Backdrop/Plain", (shaded(_plain(), "Meadow", crease=80.0),))
    level.place("Backdrop/Mountains", (shaded(_mountains(), "Rock", crease=28.0),))


def _plain():
    """Rings from the square edge of the ground out to the foot of the mountains."""
    side = np.linspace(-HALF, HALF, 13)[:-1]
    square = [(s, -HALF) for s in side] + [(HALF, s) for s in side] + [(-s, HALF) for s in side]
    inner = np.array(square + [(-HALF, -s) for s in side])
    angles = np.arctan2(inner[:, 1], inner[:, 0])
    rings = [np.stack([inner[:, 0], np.zeros(len(inner)), inner[:, 1]], axis=1)]
    for radius, drop in ((110.0, -2.0), (190.0, -5.0), (330.0, -8.0), (580.0, -6.0), (1010.0, -2.0)):
        flat = np.stack([radius * np.cos(angles), np.zeros(len(angles)), radius * np.sin(angles)], axis=1)
        flat[:, 1] = drop + 0.012 * radius * value_noise(flat / 90.0, 21)
        rings.append(flat)
    points = np.stack([np.concatenate([ring, ring[:1]]) for ring in rings])
    return welded(sheet(points).flipped())


def _mountains():
    """Large triangles from 1 to 3 km: foothills, a broken ridge at about 2.2 km, and its far side."""
    angles = np.arange(49) * (2 * np.pi / 48)
    rows = []
    profile = ((1000.0, -30.0), (1300.0, 60.0), (1650.0, 190.0), (2200.0, 430.0), (2600.0, 210.0), (3000.0, -60.0))
    for i, (radius, height) in enumerate(profile):
        place = np.stack([np.cos(angles), np.full(49, i * 0.7), np.sin(angles)], axis=1)
        place[-1] = place[0]
        ripple = value_noise(place * (4.0, 1.0, 4.0) + 9.0, 31)
        inside = 0 < i < len(profile) - 1
        far = radius + (120.0 * value_noise(place * (5.0, 1.0, 5.0), 32) if inside else 0.0)
        up = height * (1.0 + 0.55 * ripple) if inside else np.full(49, height)
        rows.append(np.stack([far * np.cos(angles), up, far * np.sin(angles)], axis=1))
        rows[-1][-1] = rows[-1][0]
    return welded(joined(sheet(np.stack(rows)).flipped()))
