"""What of the trees an edit leaves as it is: voxels, local AO, fits."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from bake.decorator_types import Decorators, TreeFits, TreeModel, TreeVolume
from bake.decorators.fit import GlobalFit
from bake.decorators.local_ao import instance_scale, representatives
from bake.decorators.volume import KnownVoxels, tree_boxes, voxel_seeds
from bake.decorators.volume_grid import VoxelGrid, cell_of, find
from bake.rebake.reach import Places, reach
from bake.rebake.state import Edit, State
from bake.rebake.wanted_points import wanted_points
from bake.trace.changed_points import ChangedPoints
from bake.types import BoolArray, Float32Array, Float64Array, Int64Array, SceneObject, UInt32Array

SPHERE_SCALE = 3.5
"""Most by which a harmonic's coefficient changes where the open share of a cosine-weighted view changes by one."""


VOXEL_RAY = 13.8
"""Most that one of N rays may change of a coefficient, times N: 4π times the largest harmonic."""


class KnownTrees:
    """What a rebake need not find again; see `bake.decorators.trees.TreesKnown`.

    Args:
        state: Before the edit; its result has trees.
        edit: What differs; settings of the trees and of the solve are as before.
        bound: Most that may be skipped for a voxel or a tree.
        changed: Tells voxels with a ray that can have changed; None if nobody can.

    Attributes:
        skipped_voxels, skipped_trees: What is skipped after this edit, one a voxel and one a tree.
        traced_voxels: How many were traced.
    """

    def __init__(self, state: State, edit: Edit, bound: float, changed: ChangedPoints | None) -> None:
        decorators = state.result.decorators or Decorators()
        assert decorators.volume is not None and decorators.fits is not None
        self._state, self._edit, self._bound, self._changed = state, edit, bound, changed
        self._volume: TreeVolume = decorators.volume
        self._models: tuple[TreeModel, ...] = decorators.models
        self._fits: TreeFits = decorators.fits
        objects: list[int] = self._fits.object.tolist()
        self._row_of = {state.result.world.object_paths[number]: row for row, number in enumerate(objects)}
        self._former: Int64Array = np.zeros(0, np.int64)
        self._grid: VoxelGrid | None = None
        self._fit_anew: dict[int, bool] = {}
        self._check_anew: dict[int, bool] = {}
        self.skipped_voxels: Float32Array = np.zeros(0, np.float32)
        self.skipped_trees: dict[int, float] = {}
        self.traced_voxels = 0

    def voxels(self, grid: VoxelGrid) -> KnownVoxels | None:
        """Voxels out of the edit's reach."""
        old = self._volume
        if grid.spacing != old.spacing:
            self.skipped_voxels, self.traced_voxels = np.zeros(len(grid.voxel), np.float32), len(grid.voxel)
            return None
        origin = self._state.result.world.origin
        first = np.rint((old.origin + origin) / old.spacing).astype(np.int64)
        former = find(grid.voxel + (grid.first - first), old.voxel)
        known = np.maximum(former, 0)
        places = Places.of(grid.positions.astype(np.float32))
        settings = self._edit.settings
        found = reach(places, self._edit.casters, settings, near=self._bound / 8.0)
        kept = self._state.result.skipped
        before = np.zeros(len(old.voxel), np.float32) if kept is None or not len(kept.voxels) else kept.voxels
        wanted, skipped = wanted_points(
            former,
            found,
            before[known],
            bound=self._bound,
            scale=SPHERE_SCALE,
            ray=VOXEL_RAY / settings.volume_directions,
            look=self._look(places.points, voxel_seeds(grid, settings.seed)),
        )
        self.skipped_voxels, self._former, self._grid = skipped, former, grid
        self.traced_voxels = int(np.count_nonzero(wanted))
        valid: BoolArray = (former >= 0) & (old.valid[known] != 0)
        return KnownVoxels(sh=np.asarray(old.sh)[known], valid=valid, wanted=wanted)

    def _look(self, points: Float32Array, seeds: UInt32Array) -> Callable[[Int64Array], BoolArray] | None:
        changed, directions = self._changed, self._edit.settings.volume_directions
        return None if changed is None else lambda rows: changed.find(points[rows], seeds[rows], directions)

    def model(self, mesh: int, trees: Sequence[int]) -> TreeModel | None:
        """The mesh's local AO, if its first instance and, nearly, the mean scale are what they were."""
        scene, former = self._edit.scene, self._state.scene
        old_world, world = self._state.result.world, self._edit.world
        rows = [self._row_of.get(world.object_paths[number]) for number in trees]
        row = rows[0]
        if row is None:
            return None
        old_first = int(self._fits.object[row])
        model = int(self._fits.model[row])
        group = np.flatnonzero(self._fits.model == model)
        if int(group[0]) != row:
            return None  # another instance lent it its keys and its seeds
        numbers: list[int] = self._fits.object[group].tolist()
        same = [world.object_hash[number] for number in trees] == [old_world.object_hash[number] for number in numbers]
        if same:
            return TreeModel(mesh, self._models[model].local_ao)
        if former is None or self._bound <= 0.0:
            return None
        one, other = scene.objects[trees[0]], former.objects[old_first]
        if former.meshes[other.mesh] is not scene.meshes[mesh] or one.keys != other.keys:
            return None
        now = _mean_scale([scene.objects[number] for number in trees])
        then = _mean_scale([former.objects[number] for number in numbers])
        if not 0.5 * then <= now <= 2.0 * then:
            return None
        return TreeModel(mesh, self._models[model].local_ao)

    def fits_anew(self, trees: Sequence[int], model: TreeModel, volume: TreeVolume) -> bool:
        """Whether any tree changed, the voxels in it did, or the local AO that all share as a volume shows it."""
        world, old = self._edit.world, self._state.result.world
        rows = [self._row_of.get(world.object_paths[number], -1) for number in trees]
        same = [
            row >= 0 and old.object_hash[int(self._fits.object[row])] == world.object_hash[number]
            for row, number in zip(rows, trees, strict=True)
        ]
        former = int(self._fits.model[rows[0]]) if rows[0] >= 0 else -1
        count = int(np.count_nonzero(self._fits.model == former))
        chosen = representatives(len(trees))
        all_anew = (
            former < 0
            or count != len(trees)
            or not all(same[int(i)] for i in chosen)
            or not np.shares_memory(model.local_ao, self._models[former].local_ao)
        )
        low, high = tree_boxes(world.positions, world.faces, world.first_face, np.array(trees))
        changed = self._changed_voxels(volume)
        reached, bound = self._reached(low, high)
        for i, number in enumerate(trees):
            inside = _any_inside(changed, low[i], high[i], volume)
            self._fit_anew[number] = all_anew or not same[i] or inside
            skipped = self._skipped_before(rows[i]) + float(bound[i])
            check = not same[i] or inside or (bool(reached[i]) if self._bound <= 0.0 else skipped > self._bound)
            check |= all_anew and (self._bound <= 0.0 or former < 0)
            self._check_anew[number] = check
            self.skipped_trees[number] = 0.0 if check else skipped
        return any(self._fit_anew[number] for number in trees)

    def seen(self, number: int, spacing: float) -> Float64Array | None:
        """What was found in this session of a tree alone, of the same content."""
        return self._state.seen.get((self._edit.world.object_hash[number], spacing))

    def remember(self, number: int, spacing: float, seen: Float64Array) -> None:
        """Keeps it for the session."""
        self._state.seen[self._edit.world.object_hash[number], spacing] = seen

    def fit(self, number: int) -> GlobalFit | None:
        """The fit as it was."""
        if self._fit_anew[number]:
            return None
        row = self._row_of[self._edit.world.object_paths[number]]
        columns = int(self._fits.coefficients.shape[2])
        coefficients = np.asarray(self._fits.coefficients[row], np.float64)
        condition: Float64Array = np.ones(columns)
        return GlobalFit(coefficients, np.asarray(self._fits.terms[row], np.int64), condition)

    def errors(self, number: int) -> Float64Array | None:
        """The errors as they were."""
        if self._check_anew[number]:
            return None
        row, fits = self._row_of[self._edit.world.object_paths[number]], self._fits
        return np.stack([fits.rmse_global[row], fits.rmse_product[row], fits.rmse_volume[row]]).astype(np.float64)

    def _changed_voxels(self, volume: TreeVolume) -> Int64Array:
        """Grid coordinates of voxels whose harmonics differ, or that are new, shape (c, 3)."""
        if self._grid is None:
            return volume.voxel.astype(np.int64)
        known = np.maximum(self._former, 0)
        other = np.asarray(volume.sh != np.asarray(self._volume.sh)[known])
        differs = (self._former < 0) | other.any(axis=(1, 2))
        return volume.voxel[differs].astype(np.int64)

    def _reached(self, low: Float64Array, high: Float64Array) -> tuple[BoolArray, Float32Array]:
        half = 0.5 * np.linalg.norm(high - low, axis=1)
        middle = (0.5 * (low + high)).astype(np.float32)
        places = Places.of(middle, lift=float(half.max(initial=0.0)))
        settings = self._edit.settings
        found = reach(places, self._edit.casters, settings, near=self._bound / 8.0)
        return found.touched, found.bound

    def _skipped_before(self, row: int) -> float:
        kept = self._state.result.skipped
        return 0.0 if kept is None or row < 0 or not len(kept.trees) else float(kept.trees[row])


def _mean_scale(items: Sequence[SceneObject]) -> float:
    return float(np.mean([instance_scale(item) for item in items]))


def _any_inside(voxels: Int64Array, low: Float64Array, high: Float64Array, volume: TreeVolume) -> bool:
    """Whether any of some grid points is a corner of a cell that a box touches."""
    first = cell_of(low[None], volume.origin, volume.spacing)[0]
    last = cell_of(high[None], volume.origin, volume.spacing)[0] + 1
    return bool(((voxels >= first) & (voxels <= last)).all(axis=1).any())
