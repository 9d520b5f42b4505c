"""The edges of a mesh, found by sorting: which sides of faces lie on one edge, and how many edges are odd.

A side is named by the corner that it begins at: side 3 f + c runs from corner c of face f to the next one.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.equal_rows import UInt64Array, sorted_with_places
from bake.in_parts import in_parts
from bake.scene.remembered import remembered
from bake.scene.weld import known_places
from bake.types import BoolArray, Float64Array, Int32Array, Int64Array

MOST_FACES_COMPARED = 8
"""Faces around one edge that are all compared with each other; more than that only in deliberately odd files."""


@dataclass(frozen=True, slots=True)
class EdgeCounts:
    """How many edges are odd; those that end where they begin do not count.

    Attributes:
        inconsistent: Edges of two faces that run along them in the same direction.
        non_manifold: Edges of more than two faces.
    """

    inconsistent: int
    non_manifold: int


class MeshEdges:
    """The sides of all faces, sorted by their edges.

    Args:
        welded: Shape (m, 3), int64: places of the faces' corners, below 2³¹.

    Attributes:
        start: Shape (3 m,), int64: where each side begins.
        side: Shape (3 m,), int32 or int64: the sides, those of one edge together and in their order.
    """

    def __init__(self, welded: Int64Array) -> None:
        self.start = welded.reshape(-1)
        number = int(self.start.max(initial=-1)) + 1
        keys = np.empty(welded.shape, np.uint64)

        def part(begin: int, end: int) -> None:
            a, b, c = welded[begin:end].T
            for column, (tail, head) in enumerate(((a, b), (b, c), (c, a))):
                keys[begin:end, column] = np.minimum(tail, head) * number + np.maximum(tail, head)

        in_parts(part, len(welded))
        dtype = np.int32 if keys.size < 2**31 - 3 else np.int64
        edges, self.side = sorted_with_places(keys.reshape(-1), number * number, dtype)
        self._edges: UInt64Array = edges
        self._goes_on = np.zeros(len(edges) + 1, np.bool_)  # whether a side is on the edge of the one before
        self._goes_on[1:-1] = edges[1:] == edges[:-1]

    def neighbours(self) -> tuple[Int64Array, BoolArray]:
        """Where two sides that follow each other share their edge, shape (p,); and whether nobody else does."""
        same = np.flatnonzero(self._goes_on[1:])
        return same, ~(self._goes_on[same] | self._goes_on[same + 2])

    def farther(self) -> Iterator[tuple[NDArray[Any], NDArray[Any]]]:
        """Pairs of sides that share their edge with another between them, and with two, and so on."""
        for step in range(2, MOST_FACES_COMPARED):
            same = np.flatnonzero(self._edges[step:] == self._edges[:-step])
            if len(same) == 0:
                return
            yield self.side[same], self.side[same + step]

    def counts(self) -> EdgeCounts:
        """How many edges are odd."""
        same, alone = self.neighbours()
        pairs = same[alone]
        first, second = self.side[pairs], self.side[pairs + 1]
        alike = first[self.start[first] == self.start[second]]
        # the first two sides of an edge of three or more
        crowded = self.side[same[~alone & ~self._goes_on[same]]]
        return EdgeCounts(self._proper(alike), self._proper(crowded))

    def _proper(self, sides: NDArray[Any]) -> int:
        return int(np.count_nonzero(self.start[sides] != self.start[following(sides)]))


def following(sides: NDArray[Any]) -> NDArray[Any]:
    """The next side of the same face."""
    return sides + 1 - 3 * (sides - 3 * (sides // 3) == 2)


def preceding(sides: NDArray[Any]) -> NDArray[Any]:
    """The side of the same face before each."""
    return sides - 1 + 3 * (sides == 3 * (sides // 3))


def count_edges(welded: Int64Array) -> EdgeCounts:
    """Odd edges of faces over welded vertices, shape (m, 3)."""
    return MeshEdges(welded).counts()


@remembered
def known_edge_counts(positions: Float64Array, faces: Int32Array) -> EdgeCounts:
    """Odd edges of a mesh, whose arrays stay as they are."""
    return count_edges(known_places(positions)[faces])
