"""The weighted average of the samples around each vertex, and the filling of vertices without any.

    x_v = Σ_s dA_s φ_sv AO_s / Σ_s dA_s φ_sv

This is the lumped form of the least squares fit: M replaced by its row sums. It stays within the samples' range but
blurs by about one ring of faces. Reference: NVIDIA's baking sample, its fallback mapping.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from bake.solve.surface import Surface
from bake.types import BoolArray, Float64Array, Int64Array

TIES = 32
"""How many equally near vertices are told apart."""

TIED = 1e-9
"""By how much of a distance another may differ and count as equal."""

OPEN = 1.0
"""Value of everything where a scene has no valid sample at all."""


def weighted_average(surface: Surface, mass: Float64Array, rhs: Float64Array) -> tuple[Float64Array, BoolArray]:
    """The weighted average at every unknown.

    An unknown without valid samples is starved. Within a component, starved unknowns take the mean of their
    neighbours, ring by ring from those that have samples; a component without any valid sample takes, vertex by
    vertex, the value of the nearest unknown in space that has one.

    Args:
        surface: The welded surface.
        mass: Shape (u,), float64, m²: lumped mass.
        rhs: Shape (u, k), float64, m².

    Returns:
        Values, shape (u, k), float64, in [0, 1]; and which unknowns were starved, shape (u,).
    """
    starved = mass <= 0.0
    values = rhs / np.where(starved, 1.0, mass)[:, None]
    if starved.all():
        return np.full_like(values, OPEN), starved
    if starved.any():
        reached = fill_by_rings(surface.edges, values, starved)
        lost = np.flatnonzero(starved & ~reached)
        if len(lost):
            values[lost] = values[nearest_among(surface.position, np.flatnonzero(~starved), lost)]
    return np.clip(values, 0.0, 1.0), starved


def nearest_among(position: Float64Array, known: Int64Array, wanted: Int64Array) -> Int64Array:
    """The unknown of `known`, sorted, that is nearest in space to each of `wanted`; of equally near ones the first.

    Twin sheets make equal distances common, and which one a search tree meets first hangs on all that is in it.
    """
    return known[nearest_in(cKDTree(position[known], balanced_tree=False, compact_nodes=False), position[wanted])[0]]


def nearest_in(tree: cKDTree, points: Float64Array) -> tuple[Int64Array, Float64Array]:
    """Which of a tree's points is nearest to each of some others, of equally near ones the first, and how near."""
    found = tree.query(points, min(TIES, tree.n))
    distance: Float64Array = np.asarray(found[0], np.float64).reshape(len(points), -1)
    place: Int64Array = np.asarray(found[1], np.int64).reshape(len(points), -1)
    ties = distance <= distance[:, :1] * (1.0 + TIED)
    return np.where(ties, place, tree.n).min(axis=1), distance[:, 0]


def fill_by_rings(edges: Int64Array, values: Float64Array, starved: BoolArray) -> BoolArray:
    """Fills `values` of starved unknowns from their component in place; returns which are known afterwards.

    Args:
        edges: Shape (e, 2): all that touch a starved unknown, each once; others do not matter.
        values: Shape (u, k).
        starved: Shape (u,).
    """
    known = ~starved
    touching = edges[starved[edges].any(axis=1)]
    tail: Int64Array = np.concatenate([touching[:, 0], touching[:, 1]])
    head: Int64Array = np.concatenate([touching[:, 1], touching[:, 0]])
    into = starved[head]
    tail, head = tail[into], head[into]
    while len(tail):
        ready = known[tail]
        if not ready.any():
            break
        targets, slot = np.unique(head[ready], return_inverse=True)
        share = np.bincount(slot)
        for column in range(values.shape[1]):
            values[targets, column] = np.bincount(slot, values[tail[ready], column]) / share
        known[targets] = True
        waiting = ~known[head]
        tail, head = tail[waiting], head[waiting]
    return known
