"""Rectangles of columns while they are being found: their corners, their floor, and whose each cell is."""

from __future__ import annotations

import numpy as np

from bake.types import Float64Array, Int32Array, Int64Array


class Rectangles:
    """A list of rectangles that grows.

    Attributes:
        most: Longest edge, in columns.
        rise: How much the floor of one may rise, metres.
        owner: Shape (n,), int32: the first rectangle in which each cell can be reached; -1 for none.
        first_cell: The cell from which each grew.
        fresh: How many cells each owns.
    """

    def __init__(self, cells: int, most: int, rise: float) -> None:
        self.most = most
        self.rise = rise
        self.owner: Int32Array = np.full(cells, -1, np.int32)
        self.first_cell: list[int] = []
        self.fresh: list[int] = []
        self._corners = np.zeros((64, 4), np.int64)
        self._floor = np.zeros((64, 2))

    def __len__(self) -> int:
        return len(self.first_cell)

    @property
    def corners(self) -> Int64Array:
        """First and last column (i, j, i, j) of each, both in it, shape (r, 4)."""
        return self._corners[: len(self)]

    @property
    def floor(self) -> Float64Array:
        """Lowest and highest floor in each, metres, shape (r, 2)."""
        return self._floor[: len(self)]

    def add(self, first_cell: int, corners: Int64Array, lowest: float, highest: float) -> int:
        """Adds one that owns nothing yet; returns its number."""
        number = len(self)
        if number == len(self._corners):
            self._corners = np.concatenate([self._corners, np.zeros_like(self._corners)])
            self._floor = np.concatenate([self._floor, np.zeros_like(self._floor)])
        self.first_cell.append(first_cell)
        self.fresh.append(0)
        self._corners[number] = corners
        self._floor[number] = lowest, highest
        return number

    def enlarge(self, number: int, corners: Int64Array, lowest: float, highest: float) -> None:
        """Enlarges one so that it holds other columns and heights too."""
        own, floor = self._corners[number], self._floor[number]
        own[:2], own[2:] = np.minimum(own[:2], corners[:2]), np.maximum(own[2:], corners[2:])
        floor[0], floor[1] = min(floor[0], lowest), max(floor[1], highest)

    def give(self, number: int, cells: Int64Array) -> None:
        """Gives cells of nobody's to a rectangle."""
        self.owner[cells] = number
        self.fresh[number] += len(cells)
