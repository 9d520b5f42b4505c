"""Objects as a tree of their paths: what is shown of it after filtering, in which order. Knows no Qt."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Any

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
        self._name_keys: dict[int, tuple[object, ...]] = {}
        known: dict[str, int] = {}
        for index, path in enumerate(paths):
            self.node_of.append(self._add(path, index, known))
        self._kept: BoolArray | None = None
        self._key: Callable[[int], Any] | None = None
        self._descending = False
        self._arranged: dict[int, list[int]] = {}
        self._rows: list[int] = [-1] * len(self)

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

    def children(self, node: int) -> list[int]:
        """What is shown below a node, in order; -1 for the top. Put in order when first asked for."""
        found = self._arranged.get(node)
        if found is None:
            found = self._top if node < 0 else self._all[node]
            if self._kept is not None:
                kept = self._kept
                found = [child for child in found if kept[child]]
            if self._key is not None:
                found = sorted(found, key=self._key, reverse=self._descending)
            for row, child in enumerate(found):
                self._rows[child] = row
            self._arranged[node] = found
        return found

    def has_children(self, node: int) -> bool:
        """Whether anything is shown below a node; -1 for the top. Puts nothing in order."""
        below = self._top if node < 0 else self._all[node]
        kept = self._kept
        return bool(below) if kept is None else any(kept[child] for child in below)

    def row(self, node: int) -> int:
        """Place of a node among its siblings; -1 if it is not shown."""
        if self._kept is not None and not self._kept[node]:
            return -1
        self.children(self.parents[node])
        return self._rows[node]

    def objects_below(self, node: int) -> list[int]:
        """The object of a node and all objects below it, of those that are shown."""
        found, waiting = [], [node]
        while waiting:
            node = waiting.pop()
            if self.objects[node] >= 0:
                found.append(self.objects[node])
            below = self._all[node]
            waiting += below if self._kept is None else [child for child in below if self._kept[child]]
        return found

    def show(self, wanted: BoolArray | None, key: Callable[[int], Any] | None = None, descending: bool = False) -> None:
        """Shows some objects with the groups that they are in.

        Args:
            wanted: Shape (objects,); None for all.
            key: What siblings are sorted by, of a node; None for the order of the scene.
            descending: Whether the largest comes first.
        """
        self._key, self._descending, self._kept = key, descending, None
        self._arranged = {}
        if wanted is not None:
            own = np.asarray(self.objects)
            kept = (np.where(own >= 0, wanted[own], False) if len(wanted) else np.zeros(len(self), bool)).tolist()
            for node in range(len(self) - 1, -1, -1):
                if kept[node] and self.parents[node] >= 0:
                    kept[self.parents[node]] = True
            self._kept = np.array(kept, bool)

    def name_key(self, node: int) -> tuple[object, ...]:
        """What names sort by: `rock_9` comes before `rock_10`."""
        key = self._name_keys.get(node)
        if key is None:
            key = self._name_keys[node] = _natural(self.names[node])
        return key


def _natural(name: str) -> tuple[object, ...]:
    """Letters and numbers in turn, so that like compares with like."""
    parts = _DIGITS.split(name.lower())
    return tuple(int(part) if number % 2 else part for number, part in enumerate(parts))
