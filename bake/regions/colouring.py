"""Which regions may be set side by side: those that share no link."""

from __future__ import annotations

import numpy as np

from bake.arrays import Int32Array


def colouring(count: int, ends: Int32Array) -> Int32Array:
    """A colour for each of `count` nodes so that no edge, shape (e, 2), joins two of one colour; greedy by degree."""
    neighbours: list[list[int]] = [[] for _ in range(count)]
    pairs: list[list[int]] = ends.tolist()
    for a, b in pairs:
        neighbours[a].append(b)
        neighbours[b].append(a)
    colour = [-1] * count
    for node in sorted(range(count), key=lambda i: -len(neighbours[i])):
        taken = {colour[other] for other in neighbours[node]}
        free = 0
        while free in taken:
            free += 1
        colour[node] = free
    return np.array(colour, np.int32)
