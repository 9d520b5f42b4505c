"""The tree volume as marks: bricks, voxels, slices, and the harmonics of one voxel as a deformed sphere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.decorator_types import TreeVolume
from bake.decorators.harmonics import OPEN, ambient_obscurance
from bake.types import Float32Array, Float64Array, Int32Array, Int64Array, UInt8Array
from viewer.colormaps import CIVIDIS
from viewer.decorator_view import ALL_LAYERS, DecoratorView, VoxelColor
from viewer.overlays import FILLED_COLOR, MOST_POINTS

VALID_COLOR = (176, 168, 84)

DIRECTIONS: tuple[tuple[str, tuple[float, float, float] | None], ...] = (
    ("all (mean)", None),
    ("+X", (1.0, 0.0, 0.0)),
    ("−X", (-1.0, 0.0, 0.0)),
    ("+Y", (0.0, 1.0, 0.0)),
    ("−Y", (0.0, -1.0, 0.0)),
    ("+Z", (0.0, 0.0, 1.0)),
    ("−Z", (0.0, 0.0, -1.0)),
)
"""Where a voxel can be asked to look; None is the mean over the sphere."""

_BRICK = 8  # cells along an edge
_GLYPH_ROWS = 24


@dataclass(frozen=True, slots=True)
class Voxels:
    """Voxels to draw.

    Attributes:
        number: Shape (n,), int64: which they are.
        positions: Shape (n, 3), float32, metres from the world's origin.
        colors: Shape (n, 3), uint8.
        total: How many there are, of which n are drawn.
    """

    number: Int64Array
    positions: Float32Array
    colors: UInt8Array
    total: int


def brick_boxes(volume: TreeVolume) -> tuple[Float64Array, Float64Array]:
    """Corners of all bricks, metres from the world's origin, shape (bricks, 3) twice."""
    low = volume.origin + np.argwhere(volume.top >= 0) * (_BRICK * volume.spacing)
    return low, low + _BRICK * volume.spacing


def voxel_positions(volume: TreeVolume) -> Float64Array:
    """Where voxels lie, shape (v, 3), metres from the world's origin."""
    return volume.origin + volume.voxel * volume.spacing


def layers(volume: TreeVolume, up_axis: int) -> Int64Array:
    """Grid coordinates along the up axis at which there are voxels, ascending."""
    return np.unique(volume.voxel[:, up_axis]).astype(np.int64)


def voxel_ao(volume: TreeVolume, column: int, direction: int, chosen: Int64Array | None = None) -> Float32Array:
    """AO of voxels about a direction, or the mean of ρ over the sphere, shape (n,), in [0, 1]."""
    sh = volume.sh[:, :, column] if chosen is None else volume.sh[chosen, :, column]
    normal = DIRECTIONS[direction][1]
    if normal is None:
        return np.clip(sh[:, 0] / OPEN, 0.0, 1.0).astype(np.float32)
    normals = np.broadcast_to(np.array(normal), (len(sh), 3))
    return ambient_obscurance(sh[:, :, None], normals)[:, 0]


def drawn_voxels(volume: TreeVolume, view: DecoratorView, up_axis: int) -> Voxels:
    """The voxels that a view asks for: all or one layer, thinned if they are too many."""
    chosen = np.arange(len(volume.voxel), dtype=np.int64)
    if view.layer != ALL_LAYERS:
        chosen = chosen[volume.voxel[:, up_axis] == view.layer]
    total = len(chosen)
    chosen = chosen[:: max(1, -(-total // MOST_POINTS))]
    if view.voxels is VoxelColor.AO:
        colors = CIVIDIS.colors(voxel_ao(volume, view.column, view.direction, chosen), 0.0, 1.0)
    else:
        colors = np.where(volume.valid[chosen, None] == 1, VALID_COLOR, FILLED_COLOR).astype(np.uint8)
    positions = (volume.origin + volume.voxel[chosen] * volume.spacing).astype(np.float32)
    return Voxels(chosen, positions, colors, total)


def slice_quads(voxels: Voxels, spacing: float, up_axis: int) -> tuple[Float32Array, Int32Array, UInt8Array]:
    """Voxels of a layer as squares: corner positions (4n, 3), corners (n, 4) and colours (4n, 3)."""
    first, second = np.eye(3)[[axis for axis in range(3) if axis != up_axis]] * (0.5 * spacing)
    around = np.array([-first - second, first - second, first + second, second - first])
    corners = (voxels.positions[:, None, :] + around).reshape(-1, 3).astype(np.float32)
    cells = np.arange(len(corners), dtype=np.int32).reshape(-1, 4)
    return corners, cells, np.repeat(voxels.colors, 4, axis=0)


def voxel_along(
    positions: Float32Array, origin: Float64Array, direction: Float64Array, angle: float, radius: float, limit: float
) -> int:
    """The nearest point that a ray passes closely.

    Args:
        positions: Shape (n, 3).
        origin, direction: The ray; the direction has unit length.
        angle: How far beside the ray a point may be seen, radians.
        radius: How far beside the ray it may lie in any case, metres.
        limit: Points further along the ray are hidden, metres.

    Returns:
        Index of the point, -1 for none.
    """
    offset = positions - origin.astype(np.float32)
    depth = offset @ direction.astype(np.float32)
    beside = np.einsum("ij,ij->i", offset, offset) - depth * depth
    reach = np.maximum(angle * depth, radius)
    close = np.flatnonzero((depth > 0.0) & (depth < limit) & (beside < reach * reach))
    return int(close[np.argmin(depth[close])]) if len(close) else -1


def nearest_voxel(volume: TreeVolume, point: Float64Array) -> int:
    """The voxel nearest to a point, -1 if it is further than a cell's diagonal."""
    distance = np.linalg.norm(voxel_positions(volume) - point, axis=1)
    best = int(np.argmin(distance)) if len(distance) else -1
    return best if best >= 0 and distance[best] <= np.sqrt(3.0) * volume.spacing else -1


def glyph(volume: TreeVolume, voxel: int, column: int) -> tuple[Float32Array, Int32Array, UInt8Array]:
    """A voxel's AO about every direction as a sphere whose radius and colour are the AO: 1 is the spacing.

    Returns:
        Positions (n, 3), triangles (m, 3) and colours (n, 3).
    """
    directions, faces = unit_sphere(_GLYPH_ROWS)
    sh = np.broadcast_to(volume.sh[voxel, :, column, None], (len(directions), volume.sh.shape[1], 1))
    ao = ambient_obscurance(sh, directions)[:, 0]
    centre = volume.origin + volume.voxel[voxel] * volume.spacing
    positions = centre + volume.spacing * ao[:, None] * directions
    return positions.astype(np.float32), faces, CIVIDIS.colors(ao, 0.0, 1.0)


def voxel_title(volume: TreeVolume, voxel: int, origin: Float64Array) -> str:
    """Which voxel it is, whether it is valid, and where; `origin` is that of the world."""
    x, y, z = volume.origin + volume.voxel[voxel] * volume.spacing + origin
    state = "valid" if volume.valid[voxel] else "filled from its neighbours"
    return f"Voxel {voxel:,}, {state}, at {x:.2f}, {y:.2f}, {z:.2f} m"


def voxel_table(volume: TreeVolume, voxel: int) -> Float32Array:
    """AO of a voxel by distance and direction, shape (k, len(DIRECTIONS))."""
    number = np.array([voxel], np.int64)
    columns, ways = range(volume.sh.shape[2]), range(len(DIRECTIONS))
    rows = [[voxel_ao(volume, column, way, number)[0] for way in ways] for column in columns]
    return np.array(rows, np.float32)


def unit_sphere(rows: int) -> tuple[Float64Array, Int32Array]:
    """Unit directions on a latitude-longitude grid and its triangles."""
    polar, angle = np.linspace(0.0, np.pi, rows + 1), np.linspace(0.0, 2.0 * np.pi, 2 * rows + 1)
    theta, phi = np.meshgrid(polar, angle, indexing="ij")
    points = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)], axis=-1)
    index = np.arange(points.shape[0] * points.shape[1], dtype=np.int32).reshape(points.shape[:2])
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = np.concatenate([np.stack([a, d, c], -1).reshape(-1, 3), np.stack([a, c, b], -1).reshape(-1, 3)])
    return points.reshape(-1, 3), faces
