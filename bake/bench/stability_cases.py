"""The cases of the stability matrix: what is done to the small level, or to the settings, and what may change by it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from bake.arrays import Float64Array, Int32Array
from bake.bench.shapes import Shaded, Solid, ball, block, flat, joined, sheet
from bake.bench.stability_level import Level, Part, make_level, part
from bake.scene_types import Role
from bake.settings import Kernel

FAR = np.array([1.0, -0.7123456789, 0.3123456789])
"""Where levels are moved to, times a distance: no round number, so that every coordinate is rounded anew."""


@dataclass(frozen=True, slots=True)
class Case:
    """One row of the matrix.

    Attributes:
        name: Shown.
        make: The level.
        unit: Metres that one metre of the plain level became; lengths among the settings go along.
        settings: What differs from the bench's settings.
        may_change: AO that may change against the plain level at its own vertices (greatest) and samples (root mean
            square); None where another AO is right.
    """

    name: str
    make: Callable[[], Level]
    unit: float = 1.0
    settings: Mapping[str, Any] = field(default_factory=dict[str, Any])
    may_change: float | None = None


def all_cases() -> list[Case]:
    """Every case, family by family; the first is the plain level, that others are compared with."""
    plain = Case("plain", make_level, may_change=0.0)
    return [plain, *_placed(), *_surfaces(), *_surroundings(), *_settings(), *_starved(), *_decorated()]


def _placed() -> list[Case]:
    moved = [Case(f"moved by 1e{n} m", partial(_moved, 10.0**n), may_change=1e-3) for n in range(3, 8)]
    moved.insert(0, Case("moved by 0.4 m", partial(_moved, 0.4), may_change=1e-3))
    moved.append(Case("moved by 2^20 m", lambda: make_level().moved(np.full(3, 2.0**20)), may_change=1e-6))
    rounded = Case("moved by 1e6 m, rounded to float32", _rounded)
    scaled = [
        Case(f"scaled by 1e{n}", partial(_scaled, 10.0**n), unit=10.0**n, may_change=1e-3)
        for n in (-3, -2, -1, 1, 2, 3, 4)
    ]
    both = Case("scaled by 1e-3, moved by 1e4 m", _small_and_far, unit=1e-3, may_change=1e-3)
    return [*moved, rounded, *scaled, both]


def _moved(distance: float) -> Level:
    return make_level().moved(distance * FAR)


def _rounded() -> Level:
    return _moved(1e6).mapped(lambda points: points.astype(np.float32).astype(np.float64))


def _scaled(factor: float) -> Level:
    return make_level().scaled(factor)


def _small_and_far() -> Level:
    return _scaled(1e-3).moved(1e4 * FAR)


def _surfaces() -> list[Case]:
    slivers = [Case(f"slivers, 1e-{n} wide", partial(_slivers, 10.0**-n)) for n in (2, 4, 6)]
    return [
        *slivers,
        Case("fan of needles", _needles),
        Case("every face twice", _twice),
        Case("every object twice", _copied),
        Case("faces and opposed twins", _opposed),
        Case("all faces flipped", partial(_flipped, 1)),
        Case("every other face flipped", partial(_flipped, 2)),
        Case("faces without area", _without_area, may_change=1e-3),
        Case("fins, bow ties and a Möbius strip", _non_manifold),
        Case("grid of 1 cm squares", _fine_grid),
        Case("boxes flush in a grid", _flush_boxes),
    ]


def _with_ground(ground: Solid) -> Level:
    level = make_level()
    return Level((part("ground", ground), *level.parts[1:]), level.regions)


def _slivers(width: float) -> Level:
    """Columns of the ground, `width` wide beside squares of 1 m."""
    lines = np.unique(np.concatenate([np.linspace(-6.0, 6.0, 13), np.linspace(-5.0, 5.0, 11) + width]))
    x, z = np.meshgrid(lines, np.linspace(-6.0, 6.0, 13), indexing="xy")
    return _with_ground(sheet(np.stack([x, np.zeros_like(x), z], axis=-1)))


def _needles() -> Level:
    """The ground as 720 triangles that meet in one vertex, and as many that meet 1 µm apart."""
    angle = np.linspace(0.0, 2.0 * np.pi, 721)[:-1]
    rim = np.stack([np.cos(angle), np.zeros(720), np.sin(angle)], axis=1)
    points = np.concatenate([[[0.0, 0.0, 0.0]], 1e-6 * rim, 6.0 * rim])
    i, j = np.arange(720), (np.arange(720) + 1) % 720
    inner = np.stack([np.zeros(720, int), j + 1, i + 1], axis=1)
    outer = np.concatenate([np.stack([i + 1, j + 1, i + 721], 1), np.stack([j + 1, j + 721, i + 721], 1)])
    return _with_ground(Solid(points, np.concatenate([inner, outer]).astype(np.int32)))


def _more_faces(more: Callable[[Int32Array], Int32Array]) -> Level:
    return make_level().each(lambda item: replace(item, faces=np.concatenate([item.faces, more(item.faces)])))


def _twice() -> Level:
    return _more_faces(lambda faces: faces)


def _opposed() -> Level:
    return _more_faces(lambda faces: faces[:, ::-1])


def _copied() -> Level:
    level = make_level()
    return level.with_parts(*(replace(item, name=f"{item.name} again") for item in level.parts))


def _flipped(every: int) -> Level:
    def turned(item: Part) -> Part:
        faces = item.faces.copy()
        faces[::every] = faces[::every, ::-1]
        return replace(item, faces=faces)

    return make_level().each(turned)


def _without_area() -> Level:
    """Faces of one point, of two, and of three on a line, after the others."""

    def dirty(item: Part) -> Part:
        a, b, c = item.faces[:8].T
        count = len(item.positions)
        middle = 0.5 * (item.positions[a] + item.positions[b])
        new = np.arange(count, count + len(a))
        more = np.concatenate([np.stack(corners, axis=1) for corners in ((a, a, a), (a, b, a), (c, c, b), (a, b, new))])
        return replace(
            item,
            positions=np.concatenate([item.positions, middle]),
            normals=np.concatenate([item.normals, item.normals[a]]),
            faces=np.concatenate([item.faces, more]).astype(np.int32),
        )

    return make_level().each(dirty)


def _non_manifold() -> Level:
    """Three sheets through one edge, two that meet in one vertex, and a strip with one side."""
    fins = [(np.cos(turn), np.sin(turn)) for turn in (0.2, 1.5, 2.8)]
    edge = np.array([[0.0, 0.5, 3.0], [0.0, 0.5, 4.0]])
    corners = np.concatenate([edge, *([p + np.array([x, y, 0.0]) for p in edge] for x, y in fins)])
    faces = [f for n in range(3) for f in ([0, 1, 2 * n + 3], [0, 2 * n + 3, 2 * n + 2])]
    tie = np.array([[2.0, 0.2, 4.5], [2.4, 0.2, 4.3], [2.4, 0.2, 4.7], [1.6, 0.2, 4.3], [1.6, 0.2, 4.7]])
    turn = np.linspace(0.0, 2.0 * np.pi, 25)
    radius = 0.8 + np.array([[-0.2], [0.2]]) * np.cos(turn / 2.0)
    height = 1.0 + np.array([[-0.2], [0.2]]) * np.sin(turn / 2.0)
    strip = np.stack([radius * np.cos(turn) + 2.0, height, radius * np.sin(turn) - 5.0], axis=-1)
    return make_level().with_parts(
        part("fins", Solid(corners, np.array(faces, np.int32))),
        part("bow tie", Solid(tie, np.array([[0, 2, 1], [0, 3, 4]], np.int32))),
        part("strip", sheet(strip)),
    )


def _fine_grid() -> Level:
    return make_level().with_parts(part("fine", flat(4.6, 5.0, 4.6, 5.0, 0.5, 40)))


def _flush_boxes() -> Level:
    """Closed boxes side by side, as block levels have them: every inner wall is there twice, back to back."""
    boxes = [block((x, 0.0, z), (x + 0.5, 0.5, z + 0.5), 0.5) for x in (4.0, 4.5, 5.0) for z in (-2.0, -1.5, -1.0)]
    return make_level().with_parts(part("boxes", joined(*boxes)))


def _surroundings() -> list[Case]:
    """All beyond the longest ray, so that nothing may change."""
    spheres = [Case(f"in a sphere of 1e{n} m", partial(_in_sphere, 10.0**n), may_change=1e-3) for n in (4, 6)]
    sides = [Case(f"backdrop 1e{n} m away on one side", partial(_backdrop, 10.0**n), may_change=1e-3) for n in (4, 6)]
    baked = [
        Case(f"backdrop 1e{n} m away, baked as well", partial(_backdrop, 10.0**n, Role.STATIC), may_change=1e-3)
        for n in (4, 6)
    ]
    return [*spheres, *sides, *baked]


def _in_sphere(radius: float) -> Level:
    return make_level().with_parts(part("sky", ball(2, radius, radius, radius).flipped(), Role.BLOCKER))


def _backdrop(distance: float, role: Role = Role.BLOCKER) -> Level:
    far = flat(-0.1 * distance, 0.1 * distance, -0.1 * distance, 0.1 * distance, 0.0, 2)
    return make_level().with_parts(part("mountains", far.moved(distance, 0.0, 0.3 * distance), role))


def _settings() -> list[Case]:
    alphas = [Case(f"alpha {alpha:g}", make_level, settings={"alpha": alpha}) for alpha in (0.0, 1e-3, 1.0, 1e3, 1e6)]
    distances = [
        Case(f"distance {distance:g} m", make_level, settings={"distances": (distance,)})
        for distance in (1e-3, 1.0, 1e3, 1e6)
    ]
    many = tuple(10.0**n for n in range(-3, 5))
    occlusion = [
        Case(f"occlusion within {d:g} m", make_level, settings={"kernel": Kernel.OCCLUSION, "max_distance": d})
        for d in (1e-3, 1e6)
    ]
    return [
        *alphas,
        *distances,
        Case("eight distances, 1e-3 to 1e4 m", make_level, settings={"distances": many}),
        *occlusion,
        Case("one sample, one ray", make_level, settings={"samples_per_face": (1, 1), "rays": 1}),
        Case("back-face threshold 0", make_level, settings={"back_face_threshold": 0.0}),
        Case("welded across objects", make_level, settings={"weld_instances": True}),
    ]


def _starved() -> list[Case]:
    return [
        Case("one triangle", _one_triangle),
        Case("no valid sample", _inside_out),
        Case("nothing to see", _far_apart),
        *(Case(f"500 specks of 1e-{n} m", partial(_specks, 10.0**-n)) for n in (2, 4, 6)),
    ]


def _one_triangle() -> Level:
    points = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    return Level((part("triangle", Solid(points, np.array([[0, 1, 2]], np.int32))),))


def _inside_out() -> Level:
    """Boxes in a box that only blocks, turned so that every ray from them ends at a back."""
    inner = [block((x, 0.0, 0.0), (x + 0.5, 0.5, 0.5), 0.25) for x in (0.0, 1.0)]
    outer = part("outer", block((-1.0, -1.0, -1.0), (2.5, 2.0, 2.0), 0.5), Role.BLOCKER)
    return Level((part("inner", joined(*inner)), outer))


def _far_apart() -> Level:
    """Two triangles 1,000 km from each other."""
    near = _one_triangle().parts[0]
    return Level((near, replace(near, name="far", positions=near.positions + 1e6 * FAR)))


def _specks(size: float) -> Level:
    rng = np.random.default_rng(1)
    points = rng.uniform(-3.0, 3.0, (500, 1, 3)) + np.array([0.0, 3.5, 0.0]) + size * rng.normal(size=(500, 3, 3))
    return make_level().with_parts(part("specks", _loose(points)))


def _loose(points: Float64Array) -> Shaded:
    """Triangles that share no vertex, shape (n, 3, 3)."""
    cross = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    normals = np.repeat(cross / np.linalg.norm(cross, axis=1, keepdims=True), 3, axis=0)
    return Shaded(
        points.reshape(-1, 3), normals.astype(np.float32), np.arange(3 * len(points), dtype=np.int32).reshape(-1, 3)
    )


def _decorated() -> list[Case]:
    return [
        Case("fog of 1000 per metre", make_level, settings={"fog_density": 1000.0}),
        Case("30 shrubs in one place", partial(_repeated, "shrub", 30)),
        Case("30 trees in one place", partial(_repeated, "tree", 30)),
        Case("tree of one triangle", _thin_tree),
        Case("tree inside a wall", _buried_tree),
        Case("tree flush with the ground", _flush_tree),
        Case("regions flat, in walls, huge and tiny", _odd_regions),
    ]


def _repeated(name: str, times: int) -> Level:
    level = make_level()
    item = next(item for item in level.parts if item.name == name)
    return level.with_parts(*(replace(item, name=f"{name} {number}") for number in range(times)))


def _thin_tree() -> Level:
    item = next(item for item in make_level().parts if item.name == "tree")
    flat_one = replace(item, name="blade", positions=item.positions[:3], normals=item.normals[:3],
                       faces=np.array([[0, 1, 2]], np.int32))  # fmt: skip
    return make_level().with_parts(flat_one)


def _buried_tree() -> Level:
    level = make_level()
    tree = next(item for item in level.parts if item.name == "tree")
    low, high = tree.positions.min(axis=0) - 0.2, tree.positions.max(axis=0) + 0.2
    return level.with_parts(part("shell", block(low.tolist(), high.tolist(), 1.0)))


def _flush_tree() -> Level:
    """The bottom of the trunk in the plane of the ground: whether a ray that ends there crosses it is undecided."""
    lift = np.array([0.0, 0.1, 0.0])
    return make_level().each(
        lambda item: replace(item, positions=item.positions + lift) if item.role is Role.TREE else item
    )


def _odd_regions() -> Level:
    boxes: Sequence[tuple[Sequence[float], Sequence[float]]] = (
        ((-3.0, 0.1, -3.0), (0.5, 0.1001, 0.5)),
        ((-4.0, 0.0, -4.0), (-3.5, 2.0, 1.0)),
        ((-1e4, -1e4, -1e4), (1e4, 1e4, 1e4)),
        ((0.0, 0.5, 4.0), (0.001, 0.501, 4.001)),
        ((-5.0, 0.0, -5.0), (5.0, 2.0, 5.0)),
    )
    return Level(make_level().parts, tuple((np.array(low), np.array(high)) for low, high in boxes))
