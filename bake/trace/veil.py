"""What dims rays in a world: fog boxes and trees' triangles, sorted out once for every tracer."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Any

import numpy as np

from bake.decorator_types import FogBoxes
from bake.errors import SceneError
from bake.geometry import MAX_OPTICAL_DEPTH
from bake.settings import BakeSettings
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
        tree_face: Shape (t,), int32: face of each tree triangle.
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
        self.fog_boxes = 0 if fog is None else int(np.count_nonzero(fog.density > 0.0))
        self.tree_triangles = len(leaves)
        self.fog_object, self.tree_face = np.zeros(0, np.int32), leaves.face
        if fog is not None and self.fog_boxes:
            self._add_fog(fog)
        if self.tree_triangles:
            # On the CPU the slower build is worth its time: every ray walks the result.
            constructor = "sah" if device == "cpu" else None
            self._add_trees(world, leaves, positions, constructor)

    def without(self, world: World, wanted: int, fog: FogBoxes | None) -> DeviceVeil:
        """The same without one object; trees keep their structure.

        Args:
            world: The same.
            wanted: The object; as a tree it dims nothing, as a shrub it is not in `fog`.
            fog: Boxes as they are without it.
        """
        from bake.kernels import veil

        other, mine = copy.copy(self), self.argument
        argument: Any = veil.Veil()
        argument.trees, argument.tree_depth = mine.trees, mine.tree_depth
        argument.tree_transmission, argument.tree_texture = mine.tree_transmission, mine.tree_texture
        other.argument = argument
        own = world.face_object[self.tree_face] == wanted
        if own.any():
            argument.tree_depth = self._array(np.where(own, np.float32(0.0), mine.tree_depth.numpy()), self._wp.float32)
            if world.face_texture is not None:
                texture = np.where(own, np.int32(-1), world.face_texture[self.tree_face])
                argument.tree_texture = self._array(texture, self._wp.int32)
        other.fog_boxes = 0 if fog is None else int(np.count_nonzero(fog.density > 0.0))
        if fog is not None and other.fog_boxes:
            other._add_fog(fog)
        return other

    def _add_fog(self, fog: FogBoxes) -> None:
        dims = fog.density > 0.0
        if not np.isfinite(fog.minimum[dims]).all() or not np.isfinite(fog.maximum[dims]).all():
            raise SceneError("a shrub's box is not finite", where="fog", remedy="check the shrubs' transforms")
        tree = build_wide_bvh(fog.minimum[dims], fog.maximum[dims])
        density = np.zeros(tree.places, np.float32)
        density[: len(tree.order)] = fog.density[dims][tree.order]
        self.fog_object = fog.object[dims][tree.order]
        self.argument.bounds = self._array(tree.bounds.ravel(), self._wp.float32)
        self.argument.node = self._array(tree.node.ravel(), self._wp.int32)
        self.argument.density = self._array(density, self._wp.float32)

    def _add_trees(self, world: World, leaves: TreeFaces, positions: Any, constructor: str | None) -> None:
        wp, argument = self._wp, self.argument
        indices = self._array(world.faces[leaves.face].ravel(), wp.int32)
        self._mesh = wp.Mesh(points=positions, indices=indices, bvh_constructor=constructor)
        argument.trees = int(np.uint64(self._mesh.id))
        argument.tree_depth = self._array(leaves.depth, wp.float32)
        argument.tree_transmission = self._array(leaves.transmission, wp.float32)
        texture = np.zeros(0, np.int32) if world.face_texture is None else world.face_texture[leaves.face]
        argument.tree_texture = self._array(texture, wp.int32)

    def _array(self, values: Any, dtype: Any) -> Any:
        return self._wp.array(np.ascontiguousarray(values), dtype=dtype, device=self._device, copy=False)
