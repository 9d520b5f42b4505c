"""A shallow tree over boxes, eight to a node: made for many rays through few thousand boxes that all count."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.arrays import Float32Array, Int32Array, Int64Array

WIDTH = 8
_NOWHERE = np.float32(3e38)  # a box there is behind the end of any ray


@dataclass(frozen=True, slots=True)
class WideBvh:
    """Nodes in level order, the root first; a node's children are consecutive, and so are a leaf's boxes.

    Attributes:
        bounds: Shape (nodes, 6, 8), float32: low x, y, z and high x, y, z of eight children; absent ones lie nowhere.
        child: Shape (nodes,), int32: the first child node, or -1 - (first box) in a leaf.
        order: Shape (n,), int32: the box that each place in the leaves holds.
    """

    bounds: Float32Array
    child: Int32Array
    order: Int32Array


def build_wide_bvh(low: Float32Array, high: Float32Array) -> WideBvh:
    """Builds the tree over boxes, shape (n, 3) each, n at least 1, by splitting at medians of the widest axis.

    All nodes but the last of a level are full, so that the place of a child follows from that of its parent.
    """
    order = _kd_order(0.5 * (low.astype(np.float64) + high))
    levels: list[Float32Array] = []
    low, high = low[order], high[order]
    while True:
        count = -(-len(low) // WIDTH)
        level = np.full((2, count * WIDTH, 3), _NOWHERE, np.float32)
        level[0, : len(low)], level[1, : len(high)] = low, high
        level = level.reshape(2, count, WIDTH, 3)
        levels.append(level.transpose(1, 0, 3, 2).reshape(count, 6, WIDTH))
        low = level[0].min(axis=1)
        level[1][level[1] == _NOWHERE] = -_NOWHERE
        high = level[1].max(axis=1)
        if count == 1:
            break
    levels.reverse()
    first = np.cumsum([len(level) for level in levels])
    child = [first[i] + WIDTH * np.arange(len(level)) for i, level in enumerate(levels[:-1])]
    child.append(-1 - WIDTH * np.arange(len(levels[-1])))
    return WideBvh(np.ascontiguousarray(np.concatenate(levels)), np.concatenate(child).astype(np.int32), order)


def _kd_order(centre: np.ndarray) -> Int32Array:
    """An order of points, shape (n, 3), in which aligned runs of every power of the width are compact."""
    order = np.arange(len(centre), dtype=np.int64)
    pending: list[tuple[int, int]] = [(0, len(order))]
    while pending:
        begin, end = pending.pop()
        count = end - begin
        if count <= WIDTH:
            continue
        run = WIDTH  # the children of a node are runs of this many
        while run * WIDTH < count:
            run *= WIDTH
        children = -(-count // run)
        middle = run * (children // 2)
        part: Int64Array = order[begin:end]
        points = centre[part]
        axis = int(np.argmax(points.max(axis=0) - points.min(axis=0)))
        order[begin:end] = part[np.argpartition(points[:, axis], middle)]
        pending += [(begin, begin + middle), (begin + middle, end)]
    return order.astype(np.int32)
