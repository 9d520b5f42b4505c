"""The small level that stress cases distort: every role, every stage, some 2,000 triangles, y up, in metres."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bake.arrays import Float32Array, Float64Array, Int32Array
from bake.bench.shapes import Shaded, Solid, ball, block, flat, joined, shaded
from bake.scene_types import Material, Mesh, ObjectKeys, RegionBox, Role, Scene, SceneObject

Box = tuple[Float64Array, Float64Array]


@dataclass(frozen=True, slots=True)
class Part:
    """One object; positions are world metres in float64.

    Attributes:
        name: Unique.
        positions: Shape (n, 3), float64.
        normals: Shape (n, 3), float32.
        faces: Shape (m, 3), int32.
        role: What it is to the bake.
        keys: Its own settings.
    """

    name: str
    positions: Float64Array
    normals: Float32Array
    faces: Int32Array
    role: Role = Role.STATIC
    keys: ObjectKeys = ObjectKeys()


@dataclass(frozen=True, slots=True)
class Level:
    """Objects and boxes in which things move."""

    parts: tuple[Part, ...]
    regions: tuple[Box, ...] = ()

    def mapped(self, change: Callable[[Float64Array], Float64Array]) -> Level:
        """Every position replaced; normals stay, so `change` may move and scale, but not turn."""
        return Level(
            tuple(replace(part, positions=change(part.positions)) for part in self.parts),
            tuple((change(low), change(high)) for low, high in self.regions),
        )

    def moved(self, shift: Float64Array) -> Level:
        """Shifted in float64."""
        return self.mapped(lambda points: points + shift)

    def scaled(self, factor: float) -> Level:
        """Grown about the origin."""
        return self.mapped(lambda points: points * factor)

    def with_parts(self, *more: Part) -> Level:
        """With objects after the others, so that nothing of theirs is numbered anew."""
        return Level((*self.parts, *more), self.regions)

    def each(self, change: Callable[[Part], Part]) -> Level:
        """Every object replaced."""
        return Level(tuple(change(part) for part in self.parts), self.regions)


def part(name: str, shape: Shaded | Solid, role: Role = Role.STATIC) -> Part:
    """An object of a shape; a bare solid gets normals by crease angle."""
    form = shaded(shape) if isinstance(shape, Solid) else shape
    return Part(name, form.positions, form.normals, form.faces, role)


def make_level() -> Level:
    """A yard with a hut, an upright ball, a tree, a shrub, two pebbles and two regions that touch.

    Walls stand flush on the ground's own grid lines, so that rays in planes and along edges are the rule; the tree
    stands in the ground, as trees do.
    """
    ground = flat(-6.0, 6.0, -6.0, 6.0, 0.0, 12)
    walls = joined(
        block((-4.0, 0.0, -4.0), (-3.5, 2.0, 1.0), 1.0),
        block((1.0, 0.0, -4.0), (1.5, 2.0, 1.0), 1.0),
        block((-3.5, 0.0, -4.0), (1.0, 2.0, -3.5), 1.0),
    )
    roof = block((-4.0, 2.0, -4.0), (1.5, 2.25, 0.0), 1.0)
    column = ball(3, 0.8, 0.8, 0.8).moved(-1.0, 0.8, 2.5)
    trunk = block((3.9, -0.1, 1.9), (4.1, 1.5, 2.1), 0.8)
    crown = joined(*(_card(turn) for turn in range(6)))
    return Level(
        (
            part("ground", ground),
            part("walls", walls),
            part("roof", roof),
            part("ball", column),
            part("tree", joined(trunk, crown), Role.TREE),
            part("shrub", ball(1, 0.5, 0.4, 0.5).moved(-4.0, 0.4, 4.0), Role.SHRUB),
            part("pebble", ball(0, 0.1, 0.1, 0.1).moved(0.0, 0.05, 4.5), Role.SMALL),
            part("stone", ball(0, 0.15, 0.1, 0.1).moved(-3.3, 0.05, 0.5), Role.SMALL),
        ),
        (
            (np.array([-3.4, 0.1, -3.4]), np.array([0.9, 1.9, 1.0])),
            (np.array([-3.4, 0.1, 1.0]), np.array([3.0, 1.9, 5.0])),
        ),
    )


def _card(turn: int) -> Solid:
    """Two opposed leaves of the tree's crown."""
    angle = turn * np.pi / 3.0
    across = 0.9 * np.array([np.cos(angle), 0.15, np.sin(angle)])
    up = np.array([0.1 * np.sin(angle), 0.8, -0.1 * np.cos(angle)])
    centre = np.array([4.0, 1.9, 2.0]) + 0.3 * across
    corners = np.array([centre - across, centre + across, centre + across + up, centre - across + up])
    return Solid(corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32))


def as_scene(level: Level) -> Scene:
    """The level as a loader would hand it over, at identity transforms: coordinates stay in float64."""
    meshes = tuple(
        Mesh(
            item.name,
            np.ascontiguousarray(item.positions, np.float64),
            np.ascontiguousarray(item.normals, np.float32),
            np.ascontiguousarray(item.faces, np.int32),
            np.zeros(len(item.faces), np.int32),
        )
        for item in level.parts
    )
    objects = tuple(
        SceneObject(item.name, number, np.eye(4), item.role, item.keys) for number, item in enumerate(level.parts)
    )
    regions = tuple(
        RegionBox(f"region {number}", _triple(low), _triple(high)) for number, (low, high) in enumerate(level.regions)
    )
    return Scene(Path("stability"), meshes, (Material("default"),), objects, regions, up_axis=1)


def _triple(point: Float64Array) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in point)
    return x, y, z
