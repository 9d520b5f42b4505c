"""The tree volume: which voxels exist, how invalid ones are filled, what interpolation gives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bake.decorator_types import TreeVolume
from bake.decorators.harmonics import OPEN
from bake.decorators.volume import evaluate, interpolate, trace_volume, tree_boxes, voxel_seeds
from bake.decorators.volume_fill import fill_invalid
from bake.decorators.volume_grid import BRICK, MOST_VOXELS, VoxelGrid, build_grid, cell_of, corners_of, find


@dataclass
class Counts:
    """What a stand-in for a tracer returns."""

    sh: np.ndarray
    hits: np.ndarray
    back_faces: np.ndarray


class Field:
    """Stands in for a tracer: harmonics that are linear in position, and a slab in which all is back faces."""

    def __init__(self, buried_below: float = -np.inf) -> None:
        self.buried_below = buried_below
        self.points = np.zeros((0, 3), np.float32)

    def sh(self, points: np.ndarray) -> np.ndarray:
        """Two distances; the second is the first with other slopes."""
        sh = np.zeros((len(points), 9, 2), np.float32)
        sh[:, 0, 0] = OPEN * (0.5 + 0.01 * points @ [1.0, -2.0, 0.5])
        sh[:, 0, 1] = OPEN * (0.4 + 0.01 * points @ [0.0, 1.0, 1.0])
        sh[:, 2, 1] = 0.3
        return sh

    def gather_sphere(self, points: np.ndarray, seeds: np.ndarray, directions: int) -> Counts:
        """As a tracer would."""
        self.points = np.concatenate([self.points, points])
        buried = points[:, 1] < self.buried_below
        hits = np.full(len(points), directions, np.uint16)
        sh = np.where(buried[:, None, None], np.float32(1e6), self.sh(points))
        return Counts(sh, hits, np.where(buried, hits, 0).astype(np.uint16))


def bake(grid: VoxelGrid, tracer: Field) -> tuple[TreeVolume, int]:
    """Traces a volume to its end."""
    work = trace_volume(grid, tracer, directions=1024, back_face_threshold=0.25, seed=1)
    with pytest.raises(StopIteration) as done:
        while True:
            next(work)
    return done.value.value


coordinate = st.floats(-60.0, 60.0, allow_subnormal=False)
boxes = st.lists(st.tuples(coordinate, coordinate, coordinate, *([st.floats(0.0, 9.0)] * 3)), min_size=1, max_size=6)


@given(boxes, st.sampled_from([0.5, 1.0, 0.7, 3.0]), st.sampled_from([0.0, 1e6, -12345.678]), st.data())
@settings(max_examples=60, deadline=None)
def test_every_point_of_every_box_has_its_corners(
    found: list[tuple[float, ...]], spacing: float, shift: float, data: st.DataObject
) -> None:
    """Points of closed boxes, corners included, have all eight voxels, and these lie around the point."""
    rows = np.array(found)
    low, high = rows[:, :3], rows[:, :3] + rows[:, 3:]
    grid = build_grid(low, high, spacing, np.full(3, shift))
    assert grid.spacing == spacing
    seed = data.draw(st.integers(0, 2**32 - 1))
    share = np.random.default_rng(seed).random((len(rows), 40, 3))
    share[:, :8] = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    points = np.clip(low[:, None] + share * (high - low)[:, None], low[:, None], high[:, None]).reshape(-1, 3)
    voxels, there = corners_of(cell_of(points, grid.origin, spacing), grid.top, grid.brick_voxels)
    assert there.all()
    corners = grid.positions[voxels]
    tolerance = 1e-9 * (abs(shift) + 100.0)
    assert (corners.min(1) <= points + tolerance).all()
    assert (corners.max(1) >= points - tolerance).all()
    np.testing.assert_allclose(corners.max(1) - corners.min(1), spacing, rtol=1e-6)


@given(boxes, st.sampled_from([0.5, 1.0, 3.0]))
@settings(max_examples=40, deadline=None)
def test_no_voxel_is_there_for_nothing(found: list[tuple[float, ...]], spacing: float) -> None:
    """Each voxel is the corner of a cell that some box touches, is there once, and every brick is used."""
    rows = np.array(found)
    low, high = rows[:, :3], rows[:, :3] + rows[:, 3:]
    grid = build_grid(low, high, spacing, np.zeros(3))
    assert len(np.unique(grid.voxel, axis=0)) == len(grid.voxel)
    first, last = cell_of(low, grid.origin, spacing), cell_of(high, grid.origin, spacing) + 1
    within = (grid.voxel[:, None] >= first) & (grid.voxel[:, None] <= last)
    assert within.all(axis=2).any(axis=1).all()
    assert sorted(grid.top[grid.top >= 0]) == list(range(len(grid.brick_voxels)))
    assert (np.bincount(grid.brick_voxels[grid.brick_voxels >= 0], minlength=len(grid.voxel)) > 0).all()


def test_outside_is_told() -> None:
    """Points beyond the cells, far away or not finite have no value; those inside do."""
    grid = build_grid(np.array([[0.2, 0.2, 0.2]]), np.array([[2.4, 2.4, 2.4]]), 1.0, np.zeros(3))
    volume, _ = bake(grid, Field())
    points = np.array([[1.0, 1, 1], [-0.1, 1, 1], [1, 3.1, 1], [1e9, 1, 1], [np.nan, 1, 1], [2.999, 2.999, 0.0]])
    ao = evaluate(volume, points, np.tile([0.0, 1.0, 0.0], (6, 1)))
    assert np.isfinite(ao).all(axis=1).tolist() == [True, False, False, False, False, True]


def test_interpolation_is_exact_for_linear_fields() -> None:
    """Between voxels harmonics that change linearly are met exactly, across bricks and sparse boxes."""
    low, high = np.array([[-3.3, 0, 0], [6.0, 2, 1]]), np.array([[5.1, 12, 3], [21.0, 4.5, 9]])
    tracer = Field()
    volume, lost = bake(build_grid(low, high, 1.0, np.array([5.5, 0.25, 0.0])), tracer)
    assert lost == 0
    assert volume.valid.all()
    points = low[:, None] + np.random.default_rng(1).random((2, 200, 3)) * (high - low)[:, None]
    points = points.reshape(-1, 3)
    np.testing.assert_allclose(interpolate(volume, points), tracer.sh(points), atol=1e-5)
    assert len(tracer.points) == len(volume.voxel)
    assert volume.memory_bytes > 0


def test_buried_voxels_take_over_from_valid_ones() -> None:
    """What invalid voxels traced is never used: values stay within those of the valid ones."""
    grid = build_grid(np.array([[0.0, -3.5, 0.0]]), np.array([[6.0, 6.0, 6.0]]), 1.0, np.zeros(3))
    tracer = Field(buried_below=0.5)
    volume, lost = bake(grid, tracer)
    buried = grid.positions[:, 1] < 0.5
    assert lost == 0
    assert buried.any()
    np.testing.assert_array_equal(volume.valid == 0, buried)
    valid_values = volume.sh[volume.valid == 1]
    assert (volume.sh >= valid_values.min(axis=0) - 1e-5).all()
    assert (volume.sh <= valid_values.max(axis=0) + 1e-5).all()
    np.testing.assert_array_equal(valid_values, tracer.sh(grid.positions.astype(np.float32))[~buried])


def test_a_ring_is_the_distance_weighted_mean() -> None:
    """A single invalid voxel is the mean of its 26 neighbours, weighted by inverse distance."""
    edge = np.arange(3)
    voxel = np.stack(np.meshgrid(edge, edge, edge, indexing="ij"), axis=-1).reshape(-1, 3).astype(np.int32)
    sh = np.random.default_rng(2).random((27, 9, 1)).astype(np.float32)
    valid = np.ones(27, bool)
    valid[13] = False
    filled, lost = fill_invalid(voxel, sh, valid)
    distance = np.linalg.norm(voxel - 1.0, axis=1)
    wanted = np.average(sh[valid], axis=0, weights=1.0 / distance[valid])
    assert lost == 0
    np.testing.assert_allclose(filled[13], wanted, rtol=1e-5)


def test_a_tree_buried_whole_counts_as_open() -> None:
    """Without any valid voxel in a piece nothing is known, so it is open, and counted."""
    low, high = np.array([[0.0, -9.0, 0.0], [20.0, 2.0, 0.0]]), np.array([[2.0, -5.0, 2.0], [22.0, 4.0, 2.0]])
    grid = build_grid(low, high, 1.0, np.zeros(3))
    volume, lost = bake(grid, Field(buried_below=0.0))
    buried = grid.positions[:, 1] < 0.0
    assert lost == buried.sum() > 0
    np.testing.assert_allclose(evaluate(volume, low[:1], np.array([[0.0, 1.0, 0.0]])), 1.0, atol=1e-6)


@pytest.mark.slow  # minutes and gigabytes: millions of voxels, on purpose
def test_a_volume_too_large_is_coarsened() -> None:
    """A tree of a kilometre, or two trees far apart at a fine spacing, still fit."""
    huge = build_grid(np.zeros((1, 3)), np.full((1, 3), 1000.0), 1.0, np.zeros(3))
    assert huge.spacing > 1.0
    assert len(huge.voxel) <= MOST_VOXELS
    apart = build_grid(
        np.array([[0.0, 0, 0], [9e4, 9e3, 9e4]]), np.array([[5.0, 5, 5], [9e4 + 5, 9e3 + 5, 9e4 + 5]]), 1.0, np.zeros(3)
    )
    assert apart.top.size <= 1 << 24
    assert len(apart.brick_voxels) <= 16


def test_voxels_keep_place_and_seed_when_the_scene_grows() -> None:
    """The grid hangs in the world: another origin moves neither voxels nor their seeds."""
    low, high = np.array([[10.25, 0.0, -3.0]]), np.array([[14.0, 6.0, 2.0]])
    shift = np.array([100.5, -7.25, 31.125])
    here = build_grid(low, high, 1.0, np.zeros(3))
    there = build_grid(low - shift, high - shift, 1.0, shift)
    np.testing.assert_allclose(there.positions + shift, here.positions, atol=1e-12)
    np.testing.assert_array_equal(voxel_seeds(here, 7), voxel_seeds(there, 7))
    assert not np.array_equal(voxel_seeds(here, 7), voxel_seeds(here, 8))
    assert len(np.unique(voxel_seeds(here, 7))) == len(here.voxel)


def test_boxes_hold_positions_as_float32_too() -> None:
    """Rounded to float32, as tracers see them, vertices stay in their box; vertices without faces don't count."""
    positions = np.random.default_rng(3).normal(0.0, 1e4, (60, 3))
    positions[-1] = 1e9
    faces = np.arange(57).reshape(-1, 3).astype(np.int32)
    low, high = tree_boxes(positions, faces, np.array([0, 19]), np.array([0]))
    for seen in (positions[:57], positions[:57].astype(np.float32).astype(np.float64)):
        assert (seen >= low).all()
        assert (seen <= high).all()
    assert high.max() < 1e8


def test_grid_points_are_found() -> None:
    """Present points give their number, others -1."""
    voxel = np.array([[0, 0, 3], [5, 1, 0], [2, 2, 2]], np.int32)
    wanted = np.array([[2, 2, 2], [0, 0, 3], [0, 0, 4], [-1, 0, 0], [5, 1, 0], [6, 0, 0]])
    assert find(wanted, voxel).tolist() == [2, 0, -1, -1, 1, -1]
    assert BRICK == 8
