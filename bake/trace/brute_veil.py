"""Fog and trees in NumPy, every ray against every box and leaf: the oracle of the kernels' walks."""

from __future__ import annotations

import numpy as np

from bake import geometry
from bake.decorator_types import FogBoxes
from bake.settings import BakeSettings
from bake.trace.veil import tree_faces
from bake.types import Float64Array, Int32Array, Int64Array, World

_PAIRS = 1 << 20  # ray-box or ray-triangle pairs at a time
_TINY = 1e-20


class PlainVeil:
    """What dims rays, without any structure.

    Attributes:
        fog_boxes, tree_triangles: How many of them.
    """

    def __init__(self, world: World, settings: BakeSettings, fog: FogBoxes | None) -> None:
        self._world, self._fog, self._leaves = world, fog, tree_faces(world, settings)
        self.fog_boxes = 0 if fog is None else int(np.count_nonzero(fog.density > 0.0))
        self.tree_triangles = len(self._leaves)
        positions = geometry.as_traced(world.positions).astype(np.float64)
        corners = geometry.faces_corners(positions, world.faces[self._leaves.face])
        self._corner, self._edge1, self._edge2 = corners[0], corners[1] - corners[0], corners[2] - corners[0]

    def depth(self, origins: Float64Array, directions: Float64Array, end: Float64Array, *, trees: bool) -> Float64Array:
        """Optical depth of rays, shape (n, 3) each, up to the distances `end`, (n,); clamped, shape (n,)."""
        total = np.zeros(len(origins))
        counts = (self.fog_boxes, self.tree_triangles if trees else 0)
        for count, add in zip(counts, (self._fog_depth, self._tree_depth), strict=True):
            if count:
                step = max(1, _PAIRS // count)
                for a in range(0, len(origins), step):
                    part = slice(a, a + step)
                    total[part] += add(origins[part], directions[part], end[part])
        return np.minimum(total, geometry.MAX_OPTICAL_DEPTH)

    def crossings(
        self, origins: Float64Array, directions: Float64Array, end: Float64Array
    ) -> tuple[Int64Array, Int32Array, Float64Array]:
        """Every crossing of fog and leaves: its ray, its object and its optical depth, ray by ray, shape (c,) each."""
        rays: list[Int64Array] = [np.zeros(0, np.int64)]
        objects: list[Int32Array] = [np.zeros(0, np.int32)]
        depths: list[Float64Array] = [np.zeros(0)]
        for i in range(len(origins)):
            ray = slice(i, i + 1)
            if self._fog is not None and self.fog_boxes:
                inside = self._fog_lengths(origins[ray], directions[ray], end[ray])[0] * self._fog.density
                box = np.flatnonzero(inside > 0.0)
                objects.append(self._fog.object[box])
                depths.append(inside[box])
                rays.append(np.full(len(box), i))
            if self.tree_triangles:
                _, leaf, crossing = self._leaves_met(origins[ray], directions[ray], end[ray])
                objects.append(self._world.face_object[self._leaves.face[leaf]])
                depths.append(crossing)
                rays.append(np.full(len(leaf), i))
        return np.concatenate(rays), np.concatenate(objects), np.concatenate(depths)

    def _fog_depth(self, origins: Float64Array, directions: Float64Array, end: Float64Array) -> Float64Array:
        fog = self._fog
        assert fog is not None
        return self._fog_lengths(origins, directions, end) @ fog.density.astype(np.float64)

    def _fog_lengths(self, origins: Float64Array, directions: Float64Array, end: Float64Array) -> Float64Array:
        fog = self._fog
        assert fog is not None
        inverse = 1.0 / np.where(np.abs(directions) < _TINY, _TINY, directions)
        low = (fog.minimum[None].astype(np.float64) - origins[:, None]) * inverse[:, None]
        high = (fog.maximum[None].astype(np.float64) - origins[:, None]) * inverse[:, None]
        enter = np.maximum(np.minimum(low, high).max(2), 0.0)
        leave = np.minimum(np.maximum(low, high).min(2), end[:, None])
        return np.maximum(leave - enter, 0.0)

    def _tree_depth(self, origins: Float64Array, directions: Float64Array, end: Float64Array) -> Float64Array:
        ray, _, crossing = self._leaves_met(origins, directions, end)
        return np.bincount(ray, crossing, minlength=len(origins)).astype(np.float64)

    def _leaves_met(
        self, origins: Float64Array, directions: Float64Array, end: Float64Array
    ) -> tuple[Int64Array, Int64Array, Float64Array]:
        """Every crossing of a leaf (Möller and Trumbore 1997): its ray, the leaf and the optical depth, shape (c,)."""
        cross_d = np.cross(directions[:, None, :], self._edge2[None])
        determinant = np.einsum("rtk,tk->rt", cross_d, self._edge1)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            inverse = 1.0 / determinant
            to_origin = origins[:, None, :] - self._corner[None]
            u = np.einsum("rtk,rtk->rt", to_origin, cross_d) * inverse
            cross_o = np.cross(to_origin, self._edge1[None])
            v = np.einsum("rtk,rk->rt", cross_o, directions) * inverse
            t = np.einsum("rtk,tk->rt", cross_o, self._edge2) * inverse
            struck = (determinant != 0) & (u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0) & (t <= end[:, None])
        ray, leaf = np.nonzero(struck)
        return ray, leaf, self._crossing(leaf, u[ray, leaf], v[ray, leaf])

    def _crossing(self, leaf: np.ndarray, u: Float64Array, v: Float64Array) -> Float64Array:
        """Optical depth of crossings of leaves at barycentric weights of corners 1 and 2."""
        world, leaves = self._world, self._leaves
        depth = leaves.depth[leaf].astype(np.float64)
        if world.face_texture is None or world.vertex_uv is None:
            return depth
        weights = np.stack([1.0 - u - v, u, v], axis=1)
        uv = np.einsum("ij,ijk->ik", weights, world.vertex_uv[world.faces[leaves.face[leaf]]])
        uv -= np.floor(uv)
        for i, texels in enumerate(world.textures):
            of = world.face_texture[leaves.face[leaf]] == i
            height, width = texels.shape
            x = np.minimum((uv[of, 0] * width).astype(int), width - 1)
            y = np.minimum((uv[of, 1] * height).astype(int), height - 1)
            openness = texels[y, x].astype(np.float64)
            passes = openness + (1.0 - openness) * leaves.transmission[leaf[of]]
            with np.errstate(divide="ignore"):
                depth[of] = np.minimum(-np.log(passes), geometry.MAX_OPTICAL_DEPTH)
        return depth
