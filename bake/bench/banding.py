"""How visibly interpolated AO changes its slope from one triangle to the next."""

from __future__ import annotations

import numpy as np

from bake.types import Float64Array, World


def banding(world: World, ao: np.ndarray, *, flat: float = 0.94) -> float:
    """Root mean square of the kinks between neighbouring faces, in 8-bit codes of the first column.

    A kink is the change of slope across an edge times half the mean height of its two triangles: by how much the one
    triangle carried on over its neighbour would miss it half-way. Edges count whose faces are nearly coplanar;
    positions decide who is whose neighbour.

    Args:
        world: The scene.
        ao: Shape (v, k) at the vertices, or (m, 3, k) at the corners of the faces.
        flat: Least cosine between the two faces' normals.
    """
    value = (ao if ao.ndim == 3 else ao[world.faces])[:, :, 0].astype(np.float64)
    _, place = np.unique(world.positions, axis=0, return_inverse=True)
    corners = place.reshape(-1)[world.faces]
    edges = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1), axis=-1).reshape(-1, 2)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    same = (edges[order[1:]] == edges[order[:-1]]).all(axis=1)
    starts = np.flatnonzero(same & ~np.append(same[1:], False) & ~np.insert(same[:-1], 0, False))
    first, second = order[starts], order[starts + 1]
    slope, height, normal = _across(world.positions[world.faces], value)
    unit = normal[first // 3], normal[second // 3]
    usable = (np.einsum("ij,ij->i", *unit) > flat) & (height.ravel()[first] > 0) & (height.ravel()[second] > 0)
    usable &= world.face_samples[first // 3] & world.face_samples[second // 3]
    first, second = first[usable], second[usable]
    jump = slope.ravel()[first] + slope.ravel()[second]
    kink = jump * (height.ravel()[first] + height.ravel()[second]) / 4.0
    kink = kink[np.isfinite(kink)]
    return float(255.0 * np.sqrt(np.mean(kink * kink))) if len(kink) else 0.0


def _across(triangle: Float64Array, value: Float64Array) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Slope away from each edge and the height over it, shape (m, 3) each, and unit normals, shape (m, 3)."""
    slope, height = np.zeros(value.shape), np.zeros(value.shape)
    cross = np.cross(triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0])
    double = np.linalg.norm(cross, axis=1)
    for k in range(3):
        a, b, c = triangle[:, k], triangle[:, (k + 1) % 3], triangle[:, (k + 2) % 3]
        edge = b - a
        square = np.einsum("ij,ij->i", edge, edge)
        safe = np.where(square > 0, square, 1.0)
        foot = np.einsum("ij,ij->i", c - a, edge) / safe
        height[:, k] = double / np.sqrt(safe)
        below = value[:, k] + foot * (value[:, (k + 1) % 3] - value[:, k])
        slope[:, k] = (value[:, (k + 2) % 3] - below) / np.where(height[:, k] > 0, height[:, k], 1.0)
    return slope, height, cross / np.where(double > 0, double, 1.0)[:, None]
