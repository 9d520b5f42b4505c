"""How far a model has moved from its fit: the metric of the regularisation."""

from __future__ import annotations

import math

import numpy as np

from bake.arrays import BoolArray, Float64Array, Int32Array
from bake.region_types import PARAMETERS, RegionGraph, RegionModels
from bake.regions.fit import RIDGE, GroupedPoints
from bake.regions.gram import box_gram, box_volumes
from bake.regions.moments import Moments

_UNKNOWN = 1e-3  # weight of the fit of a region without points


def determined_terms(models: RegionModels) -> BoolArray:
    """Parameters that may change, shape (r, 7): the first, and what the points determined; all without any points."""
    free = np.unpackbits(models.terms[:, None], axis=1, count=PARAMETERS, bitorder="little").astype(np.bool_)
    free[:, 0] = True
    free[models.terms == 0] = True
    return free


def whitening(
    models: RegionModels,
    graph: RegionGraph,
    owner: Int32Array,
    half: Float64Array,
    free: BoolArray,
    moments: Moments | None,
) -> Float64Array:
    """L of each model's Gram matrix G = L Lᵀ, so that Lᵀ d has the length by which parameters d change AO.

    The mean square over the valid points of the regions that share the model, as the fit weighs them: to change a model
    where nothing is valid costs next to nothing. Without moments, and for regions without points, over the boxes. The
    fit's ridge on the derivatives comes on top.

    Args:
        models: One a region.
        graph: The regions.
        owner: Shape (r,): whose model each region uses.
        half: Shape (r, 3): lengths that offsets are divided by.
        free: Shape (r, 7), as from `determined_terms`.
        moments: Sums over the valid points of each region.

    Returns:
        Shape (r, 7, 7), lower triangular.
    """
    gram = _over_boxes(models, graph, owner, half)
    if moments is not None:
        groups = GroupedPoints(moments, graph.minimum, graph.maximum, owner)
        known = groups.count > 0
        gram[known] = groups.gram(models.centre, half)[known]
    gram = np.where(free[:, :, None] & free[:, None, :], gram, 0.0)
    ridge = np.where(free, RIDGE, 1.0)
    ridge[:, 0] = np.where(np.bincount(owner, minlength=len(graph)) > 0, 0.0, 1.0)
    root = np.linalg.cholesky(gram + np.eye(PARAMETERS) * ridge[:, :, None]).astype(np.float64)
    root[models.terms == 0] *= math.sqrt(_UNKNOWN)
    return root


def _over_boxes(models: RegionModels, graph: RegionGraph, owner: Int32Array, half: Float64Array) -> Float64Array:
    """Means over the boxes that share each model, by volume, shape (r, 7, 7)."""
    volume = box_volumes(graph.minimum, graph.maximum)
    share = volume / np.bincount(owner, volume, len(graph))[owner]
    each = box_gram(graph.minimum, graph.maximum, models.centre[owner], half[owner])
    gram = np.zeros_like(each)
    np.add.at(gram, owner, share[:, None, None] * each)
    return gram
