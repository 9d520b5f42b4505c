"""How much the noise of each surface sample matters to the values at the vertices, before any ray is traced.

A weighted average maps the samples to vertices (bake/solve/average.py), and linear interpolation spreads the values
over the surface. If sample s has an error of variance V_s and the errors are independent, the mean square error over
the surface is, but for what neighbouring vertices share,

    Σ_s V_s Σ_v a_v (dA_s φ_sv / m_v)²,

where a_v is the share of the surface that vertex v stands for and m_v the mass of its valid samples. The inner sum is
the importance of s. The least squares fit passes more noise on, but in the same proportions.
"""

from __future__ import annotations

import numpy as np

from bake.geometry import face_normals
from bake.settings import BakeSettings
from bake.solve.weld import weld_vertices
from bake.types import Float64Array, Int64Array, SampleSet, World


class SampleImportance:
    """The importance of samples, again and again as it becomes known which of them are valid.

    Half of a vertex's share goes by area and half by its number of faces: levels mix faces of a square centimetre with
    mountains.
    """

    def __init__(self, world: World, samples: SampleSet, settings: BakeSettings) -> None:
        taken = np.zeros(world.vertex_count, np.bool_)
        receives = np.array([role.receives_per_vertex for role in world.object_roles], np.bool_)
        faces = world.faces[receives[world.face_object]]
        taken[faces.ravel()] = True
        unknown, self._count = weld_vertices(
            world, taken, crease_angle=settings.crease_angle, weld_instances=settings.weld_instances
        )
        self._corner = unknown[world.faces[samples.face]]
        phi = np.empty((len(samples), 3))
        phi[:, :2] = samples.barycentric
        phi[:, 2] = 1.0 - phi[:, 0] - phi[:, 1]
        self._weighted: Float64Array = phi * samples.area[:, None].astype(np.float64)
        around = np.bincount(unknown[faces].ravel(), minlength=self._count)
        area = face_normals(world.positions, faces)[1]
        spread = np.bincount(unknown[faces].ravel(), np.repeat(area / 3.0, 3), self._count)
        by_area = 0.5 * spread / max(float(spread.sum()), 1e-300)
        self._share: Float64Array = by_area + 0.5 * around / max(int(around.sum()), 1)

    def of(self, valid: Float64Array, rows: Int64Array) -> Float64Array:
        """The importance that some samples have if they are valid, shape (m,), float64.

        Args:
            valid: Shape (n,), 0 to 1: how likely each sample is to be valid. Where a vertex loses most of its samples,
                the few that are left count for more.
            rows: Shape (m,): which samples.
        """
        chances = (self._weighted * valid[:, None]).ravel()
        mass = np.bincount(self._corner.ravel(), chances, self._count)
        weighted, corner = self._weighted[rows], self._corner[rows]
        # whatever becomes of the others, the sample itself is there
        mass = mass[corner] + weighted * (1.0 - valid[rows, None])
        return ((weighted / np.maximum(mass, 1e-100)) ** 2 * self._share[corner]).sum(axis=1)
