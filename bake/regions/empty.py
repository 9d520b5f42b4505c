"""Models for regions in which no point is valid."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from bake.arrays import BoolArray, Int32Array
from bake.region_types import CentreKind, RegionGraph, RegionModels
from bake.regions.evaluate import harmonics

OPEN = math.sqrt(4.0 * math.pi)
"""First coefficient of convolved harmonics that give AO 1 about every normal; the others are 0."""


def fill_empty(models: RegionModels, graph: RegionGraph, owner: Int32Array, has_points: BoolArray) -> RegionModels:
    """Gives each region without points a constant: what its neighbours say at the boundaries, weighted by area.

    Ring by ring, so that a neighbour that was empty too serves once it has a value. What no chain of links joins to a
    region with points is open.

    Args:
        models: One a region; those without points are replaced.
        graph: The regions and their links.
        owner: Shape (r,): whose model each region uses.
        has_points: Shape (r,): whether any valid point went into its model.
    """
    if has_points.all():
        return models
    coefficients, terms, kind = models.coefficients.copy(), models.terms.copy(), models.centre_kind.copy()
    centre = models.centre.copy()
    empty = ~has_points
    centre[empty] = 0.5 * (graph.minimum + graph.maximum)[empty]
    coefficients[empty], terms[empty], kind[empty] = 0.0, 0, CentreKind.BOX
    filled = RegionModels(centre, coefficients, terms, kind, models.rmse)
    known = has_points.copy()
    ends = owner[np.concatenate([graph.link, graph.link[:, ::-1]])]
    area, middle = np.tile(np.maximum(graph.link_area, 1e-12), 2), np.tile(graph.link_centre, (2, 1))
    while True:
        useful = ~known[ends[:, 0]] & known[ends[:, 1]]
        if not useful.any():
            break
        taker, giver = ends[useful].T
        said = harmonics(filled, giver, middle[useful])
        total = np.bincount(taker, area[useful], len(graph))
        sums = np.zeros((len(graph), *said.shape[1:]))
        np.add.at(sums, taker, said * area[useful][:, None, None])
        reached = total > 0.0
        coefficients[reached, 0] = sums[reached] / total[reached][:, None, None]
        known |= reached
    coefficients[~known, 0, 0] = OPEN
    return dataclasses.replace(filled, centre=centre[owner], coefficients=coefficients[owner])
