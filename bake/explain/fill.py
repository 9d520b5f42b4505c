"""Where the filled average of vertices without samples comes from: the transpose of `bake/solve/average.py`."""

from __future__ import annotations

import numpy as np

from bake.solve.average import nearest_among
from bake.solve.scatter import scatter_add
from bake.solve.surface import Surface
from bake.types import BoolArray, Float64Array, Int64Array


class Fill:
    """Which vertices with samples a starved vertex takes its average from, and with what weights.

    Ring by ring, a starved unknown takes the mean of those of its neighbours that were known before; what no ring
    reaches takes the nearest unknown in space.

    Args:
        surface: The welded surface.
        starved: Shape (u,), bool: unknowns without a valid sample.
    """

    def __init__(self, surface: Surface, starved: BoolArray) -> None:
        self._surface = surface
        self._starved = starved
        self._any_known = not starved.all()
        self._ring, self._tail, self._head = _rings(surface, starved)
        self._first = np.searchsorted(self._head, np.arange(len(starved) + 1))

    def sources(self, unknowns: Int64Array, weights: Float64Array) -> tuple[Int64Array, Float64Array]:
        """Takes weights of averages at any unknowns to unknowns that have samples.

        Args:
            unknowns: Shape (m,), int64, distinct.
            weights: Shape (m,), float64.

        Returns:
            Distinct unknowns with samples and their weights, which add up to as much; empty if there are none at all.
        """
        here = {int(i): float(w) for i, w in zip(unknowns, weights, strict=True) if self._starved[i]}
        given = ~self._starved[unknowns]
        ends, amounts = [unknowns[given]], [weights[given]]
        if here and not self._any_known:
            return np.zeros(0, np.int64), np.zeros(0)
        lost = [i for i in here if self._ring[i] < 0]
        if lost:
            known = np.flatnonzero(~self._starved)
            ends.append(nearest_among(self._surface.position, known, np.array(lost, np.int64)))
            amounts.append(np.array([here.pop(i) for i in lost]))
        pending = np.array(list(here), np.int64)
        carried = np.array(list(here.values()))
        while len(pending):
            farthest = self._ring[pending] == self._ring[pending].max()
            now, amount = pending[farthest], carried[farthest]
            pending, carried = pending[~farthest], carried[~farthest]
            begin, count = self._first[now], self._first[now + 1] - self._first[now]
            place = np.repeat(begin - (np.cumsum(count) - count), count) + np.arange(int(count.sum()))
            to, share = self._tail[place], np.repeat(amount / count, count)
            still = self._starved[to]
            ends.append(to[~still])
            amounts.append(share[~still])
            pending, carried = _gathered(np.concatenate([pending, to[still]]), np.concatenate([carried, share[still]]))
        return _gathered(np.concatenate(ends), np.concatenate(amounts))


def _gathered(unknowns: Int64Array, weights: Float64Array) -> tuple[Int64Array, Float64Array]:
    """Distinct unknowns, sorted, with the sums of their weights."""
    distinct, at = np.unique(unknowns, return_inverse=True)
    return distinct, scatter_add(at, weights, len(distinct))


def _rings(surface: Surface, starved: BoolArray) -> tuple[Int64Array, Int64Array, Int64Array]:
    """The round in which each unknown is filled, shape (u,), 0 if it has samples and -1 if never; and who fills whom.

    Pairs (tail, head) are sorted by head.
    """
    ring = np.where(starved, -1, 0).astype(np.int64)
    touching = surface.edges[starved[surface.edges].any(axis=1)]
    tail: Int64Array = np.concatenate([touching[:, 0], touching[:, 1]])
    head: Int64Array = np.concatenate([touching[:, 1], touching[:, 0]])
    into = starved[head]
    tail, head = tail[into], head[into]
    waiting_tail, waiting_head = tail, head
    turn = 0
    while len(waiting_tail):
        ready = ring[waiting_tail] >= 0
        if not ready.any():
            break
        turn += 1
        ring[waiting_head[ready]] = turn
        waiting = ring[waiting_head] < 0
        waiting_tail, waiting_head = waiting_tail[waiting], waiting_head[waiting]
    fills = (ring[tail] >= 0) & (ring[tail] < ring[head])
    tail, head = tail[fills], head[fills]
    order = np.argsort(head, kind="stable")
    return ring, tail[order], head[order]
