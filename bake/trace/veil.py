"""What dims rays in a world: fog boxes and trees' triangles, sorted out once for every tracer."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Any

import numpy as np

from bake.change_types import WorldChange
from bake.decorator_types import FogBoxes
from bake.errors import SceneError
from bake.geometry import MAX_OPTICAL_DEPTH
from bake.settings import BakeSettings
from bake.trace.primitives import Primitives
from bake.trace.wide_bvh import build_wide_bvh
from bake.types import Float32Array, Int32Array, Role, World

TREE_TRANSMISSION = 0.5
"""Share of light that passes a leaf unless its object says otherwise (Sloan et al. 2013, section 2.1)."""


@dataclass(frozen=True, slots=True)
class TreeFaces:
    """Triangles that dim and do not stop.

    Attributes:
        face: Shape (t,), int32, index into `World.faces`.
        openness: Shape (t,), float32, in [0, 1]: what the leaf card's texture leaves open.
        transmission: Shape (t,), float32, in [0, 1]: what passes where it is closed.
        depth: Shape (t,), float32: optical depth of a crossing, -ln(openness + (1 - openness) transmission).
    """

    face: Int32Array
    openness: Float32Array
    transmission: Float32Array
    depth: Float32Array

    def __len__(self) -> int:
        return len(self.face)


def tree_faces(world: World, settings: BakeSettings) -> TreeFaces:
    """The faces of all trees that do not cast as opaque surfaces; none if the stage `trees` is skipped."""
    trees = np.array([role is Role.TREE for role in world.object_roles], np.bool_)
    if not trees.any() or "trees" in settings.skip:
        return TreeFaces(np.zeros(0, np.int32), *(np.zeros(0, np.float32) for _ in range(3)))
    face = np.flatnonzero(trees[world.face_object] & ~world.face_casts).astype(np.int32)
    given = [TREE_TRANSMISSION if keys.transmission is None else keys.transmission for keys in world.object_keys]
    transmission = np.array(given, np.float32)[world.face_object[face]]
    openness = world.face_openness[face]
    passes = openness.astype(np.float64) + (1.0 - openness.astype(np.float64)) * transmission
    with np.errstate(divide="ignore"):
        depth = np.minimum(-np.log(passes), MAX_OPTICAL_DEPTH)
    return TreeFaces(face, openness, transmission, np.maximum(depth, 0.0).astype(np.float32))


class DeviceVeil:
    """The same on a Warp device; builds a structure only for what the world has.

    Attributes:
        fog_boxes, tree_triangles: How many of them; of what there is none, nothing is built.
        argument: The kernels' `Veil`.
        fog_object: Object of each box, in the order of the kernels' densities.
        tree_face: Shape (t,), int32: face of each tree triangle; -1 where it is gone.
    """

    def __init__(
        self, wp: Any, device: str, world: World, settings: BakeSettings, fog: FogBoxes | None, positions: Any
    ) -> None:
        """Uploads and builds.

        Args:
            wp: The initialised module `warp`.
            device: A Warp device.
            world: Whose trees dim.
            settings: Its `skip` may leave trees out.
            fog: Boxes, or None.
            positions: `World.positions` on the device.

        Raises:
            RuntimeError: the device failed.
            SceneError: a box is not finite.
        """
        from bake.kernels import veil

        self._wp, self._device = wp, device
        self.argument: Any = veil.Veil()
        leaves = tree_faces(world, settings)
        self._leaves = Primitives(leaves.face, np.zeros(0, np.int32))
        self.fog_object = np.zeros(0, np.int32)
        self._set_fog(fog)
        self._mesh = self._added_mesh = None
        if len(leaves):
            self._mesh = self._leaf_mesh(world, leaves.face, positions)
            self.argument.trees = int(np.uint64(self._mesh.id))
            self.argument.tree_uvs = self._uvs(world)
        self._set_leaves(world, leaves)

    def updated(
        self, world: World, settings: BakeSettings, change: WorldChange, fog: FogBoxes | None, positions: Any
    ) -> DeviceVeil:
        """The same in an edited world: the mesh of leaves is shared, and what was added goes into a second one.

        Args:
            world: The edited world.
            settings: Those that this was made with.
            change: How the world follows from this one's.
            fog: Its boxes, or None.
            positions: `World.positions` on the device.

        Raises:
            RuntimeError: the device failed.
            SceneError: a box is not finite.
        """
        leaves = tree_faces(world, settings)
        dims = np.zeros(world.face_count, np.bool_)
        dims[leaves.face] = True
        followed = self._leaves.followed(dims, change)
        if followed.worn:
            return DeviceVeil(self._wp, self._device, world, settings, fog, positions)
        other = self._copy()
        other._leaves = followed
        other._set_fog(fog)
        other._added_mesh = None
        if len(followed.added):
            other._added_mesh = self._leaf_mesh(world, followed.added, positions)
            other.argument.added = int(np.uint64(other._added_mesh.id))
            other.argument.first_added = len(followed.kept)
        other._set_leaves(world, leaves)
        return other

    def without(self, world: World, wanted: int, fog: FogBoxes | None) -> DeviceVeil:
        """The same without one object; trees keep their structure.

        Args:
            world: The same.
            wanted: The object; as a tree it dims nothing, as a shrub it is not in `fog`.
            fog: Boxes as they are without it.
        """
        other, mine = self._copy(), self.argument
        other.argument.added, other.argument.first_added = mine.added, mine.first_added
        other.argument.tree_transmission = mine.tree_transmission
        own = (self.tree_face >= 0) & (world.face_object[self.tree_face] == wanted)
        depth, texture = mine.tree_depth, mine.tree_texture
        if own.any():
            depth = self._array(np.where(own, np.float32(0.0), depth.numpy()), self._wp.float32)
            if world.face_texture is not None:
                texture = self._array(np.where(own, np.int32(-1), texture.numpy()), self._wp.int32)
        other.argument.tree_depth, other.argument.tree_texture = depth, texture
        other._set_fog(fog)
        return other

    def _copy(self) -> DeviceVeil:
        """The same fog and the same first mesh of leaves, to be changed."""
        from bake.kernels import veil

        other, mine = copy.copy(self), self.argument
        argument: Any = veil.Veil()
        argument.trees, argument.tree_uvs = mine.trees, mine.tree_uvs
        argument.bounds, argument.node, argument.density = mine.bounds, mine.node, mine.density
        other.argument = argument
        return other

    def _set_fog(self, fog: FogBoxes | None) -> None:
        from bake.kernels import veil

        dims = np.zeros(0, np.bool_) if fog is None else fog.density > 0.0
        self.fog_boxes = int(np.count_nonzero(dims))
        if fog is None or self.fog_boxes == 0:
            nothing: Any = veil.Veil()
            argument = self.argument
            argument.bounds, argument.node, argument.density = nothing.bounds, nothing.node, nothing.density
            return
        if not np.isfinite(fog.minimum[dims]).all() or not np.isfinite(fog.maximum[dims]).all():
            raise SceneError("a shrub's box is not finite", where="fog", remedy="check the shrubs' transforms")
        tree = build_wide_bvh(fog.minimum[dims], fog.maximum[dims])
        density = np.zeros(tree.places, np.float32)
        density[: len(tree.order)] = fog.density[dims][tree.order]
        self.fog_object = fog.object[dims][tree.order]
        self.argument.bounds = self._array(tree.bounds.ravel(), self._wp.float32)
        self.argument.node = self._array(tree.node.ravel(), self._wp.int32)
        self.argument.density = self._array(density, self._wp.float32)

    def _leaf_mesh(self, world: World, faces: Int32Array, positions: Any) -> Any:
        # On the CPU the slower build is worth its time: every ray walks the result.
        constructor = "sah" if self._device == "cpu" else None
        indices = self._array(world.faces[faces].ravel(), self._wp.int32)
        return self._wp.Mesh(points=positions, indices=indices, bvh_constructor=constructor)

    def _set_leaves(self, world: World, leaves: TreeFaces) -> None:
        """Says what each triangle does: nothing if it is gone."""
        wp, argument = self._wp, self.argument
        face = self.tree_face = self._leaves.faces
        self.tree_triangles = len(leaves)
        if self.tree_triangles == 0:
            return
        row, there = np.searchsorted(leaves.face, np.maximum(face, 0)), face >= 0
        row[~there] = 0
        argument.tree_depth = self._array(np.where(there, leaves.depth[row], np.float32(0.0)), wp.float32)
        argument.tree_transmission = self._array(leaves.transmission[row], wp.float32)
        texture = np.zeros(0, np.int32)
        if world.face_texture is not None:
            texture = np.where(there, world.face_texture[face], np.int32(-1))
        argument.tree_texture = self._array(texture, wp.int32)

    def _uvs(self, world: World) -> Any:
        return self._array(np.zeros((0, 2), np.float32) if world.vertex_uv is None else world.vertex_uv, self._wp.vec2)

    def _array(self, values: Any, dtype: Any) -> Any:
        return self._wp.array(np.ascontiguousarray(values), dtype=dtype, device=self._device, copy=False)
