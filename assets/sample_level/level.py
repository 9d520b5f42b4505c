"""The node tree of the level, as it goes into the file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from assets.sample_level.mesh import Part, Points

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


@dataclass(frozen=True)
class Instances:
    """Copies of a node's mesh for EXT_mesh_gpu_instancing: shapes (n, 3), (n, 4) as x y z w, and (n, 3)."""

    translations: Points
    rotations: Points
    scales: Points


@dataclass
class Node:
    """A node: a name, a placement, maybe a mesh, maybe children.

    Attributes:
        name: Last part of its path.
        mesh: Key into `Level.meshes`, or empty.
        translation, rotation, scale: Local placement; the rotation is a quaternion x y z w.
        instances: Placements of the mesh below this node.
        extras: Goes into the file as it is.
    """

    name: str
    mesh: str = ""
    translation: Vector3 = (0.0, 0.0, 0.0)
    rotation: Quaternion = (0.0, 0.0, 0.0, 1.0)
    scale: Vector3 = (1.0, 1.0, 1.0)
    instances: Instances | None = None
    extras: dict[str, Any] = field(default_factory=dict)
    children: list[Node] = field(default_factory=list)

    def add(self, child: Node) -> Node:
        """Appends a child and returns it."""
        self.children.append(child)
        return child


@dataclass
class Level:
    """Everything that goes into the file: meshes by name, and the tree below one root."""

    root: Node
    meshes: dict[str, tuple[Part, ...]] = field(default_factory=dict)

    def group(self, path: str) -> Node:
        """The node at a path below the root, made on the way if it is not there."""
        node = self.root
        for name in path.split("/"):
            found = next((child for child in node.children if child.name == name), None)
            node = found or node.add(Node(name))
        return node

    def place(self, path: str, parts: tuple[Part, ...], **placement: Any) -> Node:
        """A node with a mesh of its own; the mesh is called as the path, the root left out."""
        self.meshes[path] = parts
        return self.place_shared(path, path, **placement)

    def place_shared(self, path: str, mesh: str, **placement: Any) -> Node:
        """A node that shows a mesh which may be shown elsewhere too."""
        parent, _, name = path.rpartition("/")
        above = self.group(parent) if parent else self.root
        return above.add(Node(name, mesh, **placement))

    def walk(self) -> Iterator[tuple[str, Node]]:
        """Every node with its path, parents first."""
        waiting = [(self.root.name, self.root)]
        while waiting:
            path, node = waiting.pop(0)
            yield path, node
            waiting[:0] = [(f"{path}/{child.name}", child) for child in node.children]


def turned(yaw: float, pitch: float = 0.0, roll: float = 0.0) -> Quaternion:
    """Quaternion of a rotation in degrees: roll about Z first, then pitch about X, then yaw about Y."""
    y, p, r = np.radians([yaw, pitch, roll]) / 2
    result = _product(
        _product((0, np.sin(y), 0, np.cos(y)), (np.sin(p), 0, 0, np.cos(p))), (0, 0, np.sin(r), np.cos(r))
    )
    return (float(result[0]), float(result[1]), float(result[2]), float(result[3]))


def _product(a: tuple[float, ...], b: tuple[float, ...]) -> tuple[float, ...]:
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )
