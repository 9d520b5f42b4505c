"""Fog boxes, bricks, voxels, slices and glyphs: where they are and what their colours say."""

from __future__ import annotations

import math

import numpy as np
import pytest
from decorated_level import OPEN_SHARE, with_decorators

from bake.decorator_types import FogBoxes, TreeVolume
from bake.types import BakeResult
from viewer.colormaps import CIVIDIS
from viewer.decorator_view import DecoratorView, FogColor, VoxelColor
from viewer.fog_view import box_corners, box_edges, box_sides, fog_colors, fog_scale, fog_values
from viewer.overlays import FILLED_COLOR
from viewer.volume_view import (
    DIRECTIONS,
    brick_boxes,
    drawn_voxels,
    glyph,
    layers,
    nearest_voxel,
    slice_quads,
    voxel_along,
    voxel_ao,
    voxel_positions,
    voxel_table,
    voxel_title,
)


@pytest.fixture(scope="module")
def fog(baked: BakeResult) -> FogBoxes:
    """Two boxes, the first lowered by a quarter."""
    decorators = with_decorators(baked).decorators
    assert decorators is not None
    assert decorators.fog is not None
    return decorators.fog


@pytest.fixture(scope="module")
def volume(baked: BakeResult) -> TreeVolume:
    """A volume that is equally open everywhere."""
    decorators = with_decorators(baked).decorators
    assert decorators is not None
    assert decorators.volume is not None
    return decorators.volume


def test_boxes_are_whole(fog: FogBoxes) -> None:
    """Each box has its own corners; edges have the box's lengths, sides lie in its faces."""
    corners = box_corners(fog.minimum, fog.maximum)
    edges, sides = box_edges(len(fog)), box_sides(len(fog))
    assert (len(corners), len(edges), len(sides)) == (16, 24, 12)
    np.testing.assert_array_equal(corners[:8].min(0), fog.minimum[0])
    np.testing.assert_array_equal(corners[8:].max(0), fog.maximum[1])
    across = np.abs(corners[edges[:, 1]] - corners[edges[:, 0]])
    assert np.all(np.count_nonzero(across, axis=1) == 1)
    flat = corners[sides].max(1) - corners[sides].min(1)
    assert np.all(np.count_nonzero(flat, axis=1) == 2)


def test_fog_colours_share_a_range(fog: FogBoxes) -> None:
    """Given and used densities can be compared; what was lost is in per cent."""
    np.testing.assert_allclose(fog_values(fog, FogColor.LOST), [25.0, 0.0], atol=1e-5)
    used, given = fog_scale(fog, FogColor.USED), fog_scale(fog, FogColor.GIVEN)
    assert (used.low, used.high, used.unit) == (given.low, given.high, "1/m") == (0.0, 1.0, "1/m")
    colors = {color: fog_colors(fog, color) for color in FogColor}
    assert not np.array_equal(colors[FogColor.USED][0], colors[FogColor.GIVEN][0])
    np.testing.assert_array_equal(colors[FogColor.USED][1], colors[FogColor.GIVEN][1])


def test_every_voxel_lies_in_a_brick(volume: TreeVolume) -> None:
    """Bricks are eight cells wide and hold all voxels."""
    low, high = brick_boxes(volume)
    np.testing.assert_allclose(high - low, 8.0 * volume.spacing)
    points = voxel_positions(volume)
    inside = ((points[:, None] >= low - 1e-9) & (points[:, None] <= high + 1e-9)).all(2).any(1)
    assert inside.all()


def test_voxels_have_the_volumes_values(volume: TreeVolume) -> None:
    """Equally open everywhere means that AO in every direction, and on average."""
    for direction in range(len(DIRECTIONS)):
        np.testing.assert_allclose(voxel_ao(volume, 1, direction), OPEN_SHARE, atol=1e-5)
    np.testing.assert_allclose(voxel_table(volume, 0), OPEN_SHARE, atol=1e-5)
    drawn = drawn_voxels(volume, DecoratorView(voxels=VoxelColor.AO), 1)
    expected = CIVIDIS.colors(np.array([OPEN_SHARE], np.float32), 0.0, 1.0)
    assert drawn.total == len(volume.voxel)
    np.testing.assert_array_equal(np.unique(drawn.colors, axis=0), expected)
    validity = drawn_voxels(volume, DecoratorView(voxels=VoxelColor.VALIDITY), 1)
    filled = (validity.colors == np.array(FILLED_COLOR)).all(1)
    np.testing.assert_array_equal(filled, volume.valid == 0)


def test_slice_is_one_layer(volume: TreeVolume) -> None:
    """A slice has the voxels of its layer, as squares of a cell's size that do not overlap."""
    layer = int(layers(volume, 1)[1])
    drawn = drawn_voxels(volume, DecoratorView(voxels=VoxelColor.AO, layer=layer), 1)
    np.testing.assert_array_equal(drawn.number, np.flatnonzero(volume.voxel[:, 1] == layer))
    corners, cells, colors = slice_quads(drawn, volume.spacing, 1)
    assert len(cells) == drawn.total
    assert len(colors) == len(corners)
    sizes = corners[cells].max(1) - corners[cells].min(1)
    np.testing.assert_allclose(sizes, np.broadcast_to([volume.spacing, 0.0, volume.spacing], sizes.shape), atol=1e-5)


def test_voxels_are_picked_along_a_ray(volume: TreeVolume) -> None:
    """The nearest voxel in the ray's way is found, unless something hides it."""
    points = voxel_positions(volume).astype(np.float32)
    target = int(np.argmax(points[:, 1]))
    origin, down = points[target] + np.array([0.0, 5.0, 0.0]), np.array([0.0, -1.0, 0.0])
    assert voxel_along(points, origin, down, 1e-3, 0.0, math.inf) == target
    assert voxel_along(points, origin, down, 1e-3, 0.0, 4.0) == -1
    assert voxel_along(points, origin, -down, 1e-3, 0.0, math.inf) == -1
    assert nearest_voxel(volume, voxel_positions(volume)[5] + 0.1 * volume.spacing) == 5
    assert nearest_voxel(volume, np.array([1e3, 0.0, 0.0])) == -1


def test_glyph_is_as_wide_as_the_voxel_is_open(volume: TreeVolume) -> None:
    """A voxel equally open in all directions is a sphere of that share of the spacing, closed and facing outwards."""
    positions, faces, colors = glyph(volume, 7, 0)
    centre = voxel_positions(volume)[7]
    np.testing.assert_allclose(
        np.linalg.norm(positions - centre, axis=1), OPEN_SHARE * volume.spacing, rtol=1e-4, atol=1e-5
    )
    assert len(colors) == len(positions)
    a, b, c = (positions[faces[:, corner]] - centre for corner in range(3))
    outward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a + b + c)
    assert outward.min() > -1e-9
    assert "filled" in voxel_title(volume, 0, np.zeros(3))
    assert "valid" in voxel_title(volume, 1, np.zeros(3))
