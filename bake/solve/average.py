"""The weighted average of the samples around each vertex, and the filling of vertices without any.

    x_v = Σ_s dA_s φ_sv AO_s / Σ_s dA_s φ_sv

This is the lumped form of the least squares fit: M replaced by its row sums. It stays within the samples' range but
blurs by about one ring of faces. Reference: NVIDIA's baking sample, its fallback mapping.
"""

from __future__ import annotations

from collections.abc import Callable

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


def nearest_among(
    position: Float64Array,
    known: Int64Array,
    wanted: Int64Array,
    order: Callable[[], Int64Array] | None = None,
) -> Int64Array:
    """The unknown of `known`, sorted, that is nearest in space to each of `wanted`; of equally near ones the first.

    Twin sheets make equal distances common, and which one a search tree meets first hangs on all that is in it.

    Args:
        position: Shape (u, 3).
        known: Shape (n,).
        wanted: Shape (w,).
        order: Tells the place of every unknown in the order in which the first is sought, shape (u,), if that is not
            the one of their numbers; only called if it matters.
    """
    place, distance = _nearest_places(position[known], position[wanted])
    ties = distance <= distance[:, :1] * (1.0 + TIED)
    if order is None:
        return known[np.where(ties, place, len(known)).min(axis=1)]
    if not ties[:, 1:].any():
        return known[place[:, 0]]
    rank = order()
    if ties.shape[1] < len(known) and ties.all(axis=1).any():  # there may be more: which were found is up to the tree
        known = known[np.argsort(rank[known])]
        return nearest_among(position, known, wanted)
    first = np.where(ties, rank[known[place]], np.iinfo(np.int64).max).argmin(axis=1)
    return known[place[np.arange(len(wanted)), first]]


def _nearest_places(points: Float64Array, around: Float64Array) -> tuple[Int64Array, Float64Array]:
    return nearest_few(cKDTree(points, balanced_tree=False, compact_nodes=False), around)


def nearest_in(tree: cKDTree, points: Float64Array) -> tuple[Int64Array, Float64Array]:
    """Which of a tree's points is nearest to each of some others, of equally near ones the first, and how near."""
    place, distance = nearest_few(tree, points)
    ties = distance <= distance[:, :1] * (1.0 + TIED)
    return np.where(ties, place, tree.n).min(axis=1), distance[:, 0]


def nearest_few(tree: cKDTree, points: Float64Array) -> tuple[Int64Array, Float64Array]:
    """The `TIES` points of a tree, or all, that are nearest to each of some others, by distance; and how near."""
    shape = len(points), min(TIES, tree.n)
    found = tree.query(points, shape[1])
    distance: Float64Array = np.asarray(found[0], np.float64).reshape(shape)
    place: Int64Array = np.asarray(found[1], np.int64).reshape(shape)
    return place, distance


def fill_by_rings(edges: Int64Array, values: Float64Array, starved: BoolArray) -> BoolArray:
    """Fills `values` of starved unknowns from their component in place; returns which are known afterwards.

    Args:
        edges: Shape (e, 2): all that touch a starved unknown, each once; others do not matter.
        values: Shape (u, k).
        starved: Shape (u,).
    """
    known = ~starved
    at_end = starved[edges]
    # each edge once for each of its starved ends, the second ends first
    tail: Int64Array = np.concatenate([edges[at_end[:, 1], 0], edges[at_end[:, 0], 1]])
    head: Int64Array = np.concatenate([edges[at_end[:, 1], 1], edges[at_end[:, 0], 0]])
    reached, number = np.zeros(len(starved), np.bool_), np.empty(len(starved), np.int64)
    while len(tail):
        ready = known[tail]
        if not ready.any():
            break
        reached[head[ready]] = True
        targets = np.flatnonzero(reached)
        reached[targets] = False
        number[targets] = np.arange(len(targets))
        slot = number[head[ready]]
        share = np.bincount(slot)
        for column in range(values.shape[1]):
            values[targets, column] = np.bincount(slot, values[tail[ready], column]) / share
        known[targets] = True
        waiting = ~known[head]
        tail, head = tail[waiting], head[waiting]
    return known
