"""What the weighted average needs of a world: nothing of it depends on samples, so it can be made before they are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.settings import BakeSettings
from bake.solve.weld import weld_vertices
from bake.types import BoolArray, Int32Array, Int64Array, World


@dataclass(frozen=True, slots=True)
class Receivers:
    """Unknowns of the receiving objects.

    Attributes:
        row: Shape (world faces,), int64: row of a face in `corners`, -1 if its object receives nothing; None where
            every face's row is its own number.
        corners: Shape (m, 3), int64: unknowns of each receiving face.
        unknown: Shape (n,), int64: the unknown of each vertex, -1 where it has none.
        count: How many there are.
        baked: Shape (n,), bool: a receiving face uses the vertex.
        referenced: Shape (n,), bool: a face uses the vertex.
    """

    row: Int64Array | None
    corners: Int64Array
    unknown: Int64Array
    count: int
    baked: BoolArray
    referenced: BoolArray

    def rows(self, face: Int32Array) -> Int64Array:
        """Rows of some of the world's faces."""
        return face.astype(np.int64) if self.row is None else self.row[face]


def find_receivers(world: World, settings: BakeSettings) -> Receivers:
    """Welds the receiving objects' vertices.

    Args:
        world: The flattened scene.
        settings: `weld_instances` and `crease_angle` decide which vertices are one.
    """
    receives = np.array([role.receives_per_vertex for role in world.object_roles], np.bool_)
    referenced = np.zeros(world.vertex_count, np.bool_)
    referenced[world.faces.reshape(-1)] = True
    row, faces, baked = None, world.faces, referenced
    if not receives.all():
        chosen = np.flatnonzero(receives[world.face_object])
        row = np.full(world.face_count, -1, np.int64)
        row[chosen] = np.arange(len(chosen))
        faces, baked = world.faces[chosen], np.zeros(world.vertex_count, np.bool_)
        baked[faces.reshape(-1)] = True
    unknown, count = weld_vertices(
        world, baked, crease_angle=settings.crease_angle, weld_instances=settings.weld_instances
    )
    return Receivers(row, unknown[faces], unknown, count, baked, referenced)
