"""A shallow tree over boxes, many to a node: made for many rays through few thousand boxes that all count.

What a walk costs is mostly the wait from one level to the next; boxes side by side are tested eight at a time. So the
tree is as shallow as nodes of up to 32 children allow.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.arrays import Float32Array, Int32Array, Int64Array

LANES = 8
"""Boxes that are tested together."""

LEAF = 16
"""Boxes in a leaf."""

WIDEST = 32
"""Children of a node, at most; the walk's stack has room for six levels of them."""

_NOWHERE = np.float32(3e38)  # a box there is behind the end of any ray


@dataclass(frozen=True, slots=True)
class WideBvh:
    """Nodes in level order, the root first; a node's children are consecutive, and so are a leaf's boxes.

    Attributes:
        bounds: Shape (groups, 6, 8), float32: low x, y, z and high x, y, z of eight children; absent ones lie nowhere.
        node: Shape (nodes, 3), int32: the node's first group, how many it has, and its first child node, or
            -1 - (its first place in `order`) in a leaf.
        order: Shape (n,), int32: the box that each place in the leaves holds.
        places: Places in the leaves, filled or not: a multiple of 8, at least n.
    """

    bounds: Float32Array
    node: Int32Array
    order: Int32Array
    places: int


def build_wide_bvh(low: Float32Array, high: Float32Array) -> WideBvh:
    """Builds the tree over boxes, shape (n, 3) each, n at least 1, by splitting at medians of the widest axis.

    All nodes but the last of a level are full, so that the place of a child follows from that of its parent.
    """
    widths = node_widths(len(low))
    order = _kd_order(0.5 * (low.astype(np.float64) + high), widths)
    low, high = low[order], high[order]
    levels: list[tuple[Float32Array, Int64Array]] = []
    for width in widths:
        children = len(low)
        count = -(-children // width)
        level = np.full((2, count * width, 3), _NOWHERE, np.float32)
        level[0, :children], level[1, :children] = low, high
        grouped = level.reshape(2, count * width // LANES, LANES, 3).transpose(1, 0, 3, 2).reshape(-1, 6, LANES)
        held = np.full(count, width)
        held[-1] = children - width * (count - 1)
        levels.append((grouped[: -(-children // LANES)], -(-held // LANES)))
        level = level.reshape(2, count, width, 3)
        low = level[0].min(axis=1)
        level[1][level[1] == _NOWHERE] = -_NOWHERE
        high = level[1].max(axis=1)
    levels.reverse()
    widths = widths[::-1]
    groups = np.concatenate([count for _, count in levels])
    first_node = np.cumsum([len(count) for _, count in levels])
    child = [
        first_node[i] + widths[i] * np.arange(len(count), dtype=np.int64) for i, (_, count) in enumerate(levels[:-1])
    ]
    child.append(-1 - LEAF * np.arange(len(levels[-1][1]), dtype=np.int64))
    node = np.stack([np.cumsum(groups) - groups, groups, np.concatenate(child)], axis=1)
    return WideBvh(
        bounds=np.ascontiguousarray(np.concatenate([level for level, _ in levels])),
        node=node.astype(np.int32),
        order=order,
        places=-(-len(order) // LANES) * LANES,
    )


def node_widths(count: int) -> list[int]:
    """Children a node for each level over `count` boxes, leaves first: as few levels as `WIDEST` allows, all alike."""
    leaves = -(-count // LEAF)
    if leaves == 1:
        return [LEAF]
    inner = 1
    while WIDEST**inner < leaves:
        inner += 1
    width = LANES
    while width**inner < leaves:
        width += LANES
    return [LEAF, *[width] * inner]


def _kd_order(centre: np.ndarray, widths: list[int]) -> Int32Array:
    """An order of points, shape (n, 3), in which aligned runs of as many as a node holds are compact."""
    order = np.arange(len(centre), dtype=np.int64)
    runs = np.cumprod(widths, dtype=np.int64)
    pending: list[tuple[int, int]] = [(0, len(order))]
    while pending:
        begin, end = pending.pop()
        count = end - begin
        if count <= LEAF:
            continue
        run = int(runs[runs < count][-1])  # the children of a node are runs of this many
        middle = run * (-(-count // run) // 2)
        part: Int64Array = order[begin:end]
        points = centre[part]
        axis = int(np.argmax(points.max(axis=0) - points.min(axis=0)))
        order[begin:end] = part[np.argpartition(points[:, axis], middle)]
        pending += [(begin, begin + middle), (begin + middle, end)]
    return order.astype(np.int32)
