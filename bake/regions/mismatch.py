"""How far the models of linked regions are apart where they meet."""

from __future__ import annotations

import numpy as np

from bake import spherical_harmonics
from bake.arrays import Float32Array
from bake.region_types import RegionGraph, RegionModels
from bake.regions.evaluate import AXIS_NORMALS, harmonics


def boundary_mismatch(models: RegionModels, graph: RegionGraph) -> Float32Array:
    """|M_a(b) - M_b(b)| at the middle of each link's boundary, the largest over six axis normals, shape (l, k).

    Of AO as it is shown, cut off at 0 and 1: how far something that crosses there would pop.
    """
    lobes = spherical_harmonics.evaluate(AXIS_NORMALS)
    first, second = (
        np.clip(np.einsum("nc,lck->lnk", lobes, harmonics(models, end, graph.link_centre)), 0.0, 1.0)
        for end in graph.link.T
    )
    return np.abs(first - second).max(axis=1, initial=0.0).astype(np.float32)
