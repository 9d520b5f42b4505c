"""Objects as a tree of their paths: what is shown of it after filtering, in which order. Knows no Qt."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

import numpy as np

from bake.types import BoolArray, Int64Array

_DIGITS = re.compile(r"(\d+)")


class ObjectTree:
    """Nodes are numbered so that parents come before their children; a node may be an object, a group, or both.

    Args:
        paths: Of all objects, in scene order.

    Attributes:
        names: Last part of each node's path.
        parents: Node above each node, -1 at the top.
        objects: Object of each node, -1 for a mere group.
        node_of: Node of each object.
    """

    def __init__(self, paths: Sequence[str]) -> None:
        self.names: list[str] = []
        self.parents: list[int] = []
        self.objects: list[int] = []
        self.node_of: list[int] = []
        self._all: list[list[int]] = []
        self._top: list[int] = []
        self._sort_keys: list[tuple[object, ...]] | None = None
        known: dict[str, int] = {}
        for index, path in enumerate(paths):
            self.node_of.append(self._add(path, index, known))
        self._parent_array = np.array(self.parents, np.int64)
        self.children: list[list[int]] = self._all
        self.top: list[int] = self._top
        self.rows: list[int] = []
        self._number_rows()

    def __len__(self) -> int:
        return len(self.names)

    def _add(self, path: str, index: int, known: dict[str, int]) -> int:
        node = known.get(path)
        if node is not None:
            self.objects[node] = index
            return node
        above, _, name = path.rpartition("/")
        parent = known[above] if above in known else (self._add(above, -1, known) if above else -1)
        node = known[path] = len(self.names)
        self.names.append(name)
        self.parents.append(parent)
        self.objects.append(index)
        self._all.append([])
        (self._all[parent] if parent >= 0 else self._top).append(node)
        return node

    def path(self, node: int) -> str:
        """Path of a node."""
        parts = []
        while node >= 0:
            parts.append(self.names[node])
            node = self.parents[node]
        return "/".join(reversed(parts))

    def totals(self, counts: Int64Array) -> Int64Array:
        """Sums of a number of each object over each node and what is below it, shape (nodes,)."""
        own = np.asarray(self.objects)
        totals = np.where(own >= 0, counts[own], 0).astype(np.int64) if len(counts) else np.zeros(len(self), np.int64)
        for node in range(len(self) - 1, -1, -1):
            if self.parents[node] >= 0:
                totals[self.parents[node]] += totals[node]
        return totals

    def objects_below(self, node: int) -> list[int]:
        """The object of a node and all objects below it, of those that are shown."""
        found, waiting = [], [node]
        while waiting:
            node = waiting.pop()
            if self.objects[node] >= 0:
                found.append(self.objects[node])
            waiting += self.children[node]
        return found

    def show(
        self, wanted: BoolArray | None, key: Callable[[int], object] | None = None, descending: bool = False
    ) -> None:
        """Shows some objects with the groups that they are in.

        Args:
            wanted: Shape (objects,); None for all.
            key: What siblings are sorted by, of a node; None for the order of the scene.
            descending: Whether the largest comes first.
        """
        if wanted is None:
            kept = None
        else:
            own = np.asarray(self.objects)
            kept = np.where(own >= 0, wanted[own], False) if len(wanted) else np.zeros(len(self), bool)
            for node in range(len(self) - 1, -1, -1):
                if kept[node] and self.parents[node] >= 0:
                    kept[self.parents[node]] = True

        def arranged(nodes: list[int]) -> list[int]:
            found = nodes if kept is None else [node for node in nodes if kept[node]]
            return found if key is None else sorted(found, key=key, reverse=descending)  # type: ignore[arg-type]

        untouched = kept is None and key is None
        self.top = self._top if untouched else arranged(self._top)
        self.children = self._all if untouched else [arranged(nodes) if nodes else nodes for nodes in self._all]
        self._number_rows()

    def name_key(self, node: int) -> tuple[object, ...]:
        """What names sort by: `rock_9` comes before `rock_10`."""
        if self._sort_keys is None:
            self._sort_keys = [_natural(name) for name in self.names]
        return self._sort_keys[node]

    def _number_rows(self) -> None:
        self.rows = [-1] * len(self)
        for siblings in (self.top, *self.children):
            for row, node in enumerate(siblings):
                self.rows[node] = row


def _natural(name: str) -> tuple[object, ...]:
    """Letters and numbers in turn, so that like compares with like."""
    parts = _DIGITS.split(name.lower())
    return tuple(int(part) if number % 2 else part for number, part in enumerate(parts))
