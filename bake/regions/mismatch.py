"""How far the models of linked regions are apart where they meet."""

from __future__ import annotations

import numpy as np

from bake import spherical_harmonics
from bake.arrays import Float32Array
from bake.region_types import RegionGraph, RegionModels
from bake.regions.evaluate import AXIS_NORMALS, harmonics


def boundary_mismatch(models: RegionModels, graph: RegionGraph) -> Float32Array:
    """|M_a(b) - M_b(b)| at the middle of each link's boundary, the largest over six axis normals, shape (l, k)."""
    a, b = graph.link.T
    apart = harmonics(models, a, graph.link_centre) - harmonics(models, b, graph.link_centre)
    at_normals = np.einsum("nc,lck->lnk", spherical_harmonics.evaluate(AXIS_NORMALS), apart)
    return np.abs(at_normals).max(axis=1, initial=0.0).astype(np.float32)
