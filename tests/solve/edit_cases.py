"""Small levels, edits of them, and how one world follows from the other; made without tracing."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bake.change_types import WorldChange
from bake.settings import BakeSettings
from bake.types import ObjectKeys, Role, SampleSet, World
from tests.solve.solve_cases import grid, points, random_samples, soup
from tests.worlds import box, icosphere, make_world


@dataclass(frozen=True)
class Part:
    """One object of a level."""

    path: str
    positions: np.ndarray
    faces: np.ndarray
    role: Role = Role.STATIC
    keys: ObjectKeys = ObjectKeys()


@dataclass(frozen=True)
class Level:
    """A level with samples and values."""

    parts: tuple[Part, ...]
    world: World
    samples: SampleSet
    ao: np.ndarray
    valid: np.ndarray
    settings: BakeSettings


SHAPES = (
    lambda: grid(7, 6, size=3.0),
    lambda: soup(*grid(5, 5)),
    lambda: icosphere(1),
    lambda: icosphere(2, 0.4),
    box,
    lambda: (np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]])),
)


def some_part(path: str, rng: np.random.Generator, *, weld: bool | None = None) -> Part:
    """A shape at a random place."""
    positions, faces = SHAPES[int(rng.integers(len(SHAPES)))]()
    at = np.round(rng.uniform(-3, 3, 3))  # round, so that objects come to touch
    role = Role.STATIC if rng.random() < 0.85 else Role.BLOCKER
    alpha = float(rng.choice([0.0, 0.1, 1.0])) if rng.random() < 0.2 else None
    return Part(path, positions + at, faces, role, ObjectKeys(alpha=alpha, weld=weld if rng.random() < 0.5 else None))


def world_of(parts: tuple[Part, ...]) -> World:
    """The parts as a world."""
    receives = [part.role.receives_per_vertex for part in parts]
    return replace(
        make_world(
            *((part.positions, part.faces) for part in parts),
            roles=tuple(part.role for part in parts),
            keys=tuple(part.keys for part in parts),
            samples=np.repeat(receives, [len(part.faces) for part in parts]),
        ),
        object_paths=tuple(part.path for part in parts),
    )


def samples_of(parts: tuple[Part, ...], world: World) -> SampleSet:
    """The same samples on a face whatever else there is: as many as its object's key says, or four."""
    whole = random_samples(world, 6)
    wanted = np.array([part.keys.samples or 4 for part in parts])[world.face_object[whole.face]]
    rows = np.flatnonzero(whole.index < wanted)
    own = np.concatenate([[0], np.cumsum(np.diff(world.first_face))])
    number = whole.face - own[world.face_object[whole.face]]  # of the face within its object
    spread = np.modf(np.sin(number * 78.233 + whole.index * 37.719) * 43758.5453)[0] ** 2
    other = np.modf(np.sin(number * 12.9898 + whole.index * 4.1414) * 15731.743)[0] ** 2
    root = np.sqrt(spread)
    placed = replace(whole, barycentric=np.column_stack([1 - root, other * root]).astype(np.float32))
    return placed.only(rows)


def level_of(parts: tuple[Part, ...], settings: BakeSettings, seed: int, shadow: np.ndarray) -> Level:
    """Values that follow from the place, noise that follows from the sample, and a shadow that is darker and invalid.

    Args:
        parts: The objects.
        settings: For the mapping.
        seed: Of the noise.
        shadow: Shape (4,): a ball, centre and radius.
    """
    world = world_of(parts)
    samples = samples_of(parts, world)
    at = points(world, samples)
    noise = np.modf(np.sin(at @ [12.9, 78.2, 45.1] + samples.index * 7.3 + seed % 1000) * 43758.5)[0]
    away = np.linalg.norm(at - shadow[:3], axis=1) - shadow[3]
    smooth = 0.5 + 0.45 * np.sin(1.3 * at[:, 0] + 1) * np.cos(0.9 * at[:, 1] - at[:, 2])
    ao = np.clip(np.column_stack([smooth + 0.3 * noise, 0.7 * smooth - 0.2 * noise]), 0, 1)
    ao[away < 0] *= 0.4
    valid = (away > -0.5 * shadow[3]) & (noise < 0.85)
    return Level(parts, world, samples, ao.astype(np.float32), valid, settings)


def world_change(old: World, new: World) -> WorldChange:
    """How `new` follows from `old`, object by object, as an edit session would tell."""
    place = {path: number for number, path in enumerate(old.object_paths)}
    old_object = np.array([place.get(path, -1) for path in new.object_paths], np.int64)
    old_face, new_face = np.full(new.face_count, -1, np.int32), np.full(old.face_count, -1, np.int32)
    old_vertex = np.full(new.vertex_count, -1, np.int32)
    new_object = np.full(old.object_count, -1, np.int64)
    anew, cast_anew = np.ones(new.object_count, np.bool_), np.ones(new.object_count, np.bool_)
    cast_before = np.ones(old.object_count, np.bool_)
    for n, o in enumerate(old_object):
        if o < 0:
            continue
        new_object[o] = n
        a, b = slice(*old.first_vertex[o : o + 2]), slice(*new.first_vertex[n : n + 2])
        if a.stop - a.start != b.stop - b.start:
            continue
        old_vertex[b] = np.arange(a.start, a.stop)
        f, g = slice(*old.first_face[o : o + 2]), slice(*new.first_face[n : n + 2])
        same = np.array_equal(old.faces[f] - a.start, new.faces[g] - b.start)
        casts = np.array_equal(old.face_casts[f], new.face_casts[g])
        if not (same and casts and np.array_equal(old.positions[a], new.positions[b])):
            continue
        old_face[g], new_face[f] = np.arange(f.start, f.stop), np.arange(g.start, g.stop)
        cast_anew[n] = cast_before[o] = False
        anew[n] = (old.object_roles[o], old.object_keys[o]) != (new.object_roles[n], new.object_keys[n])
    return WorldChange(old_face, new_face, old_vertex, old_object, new_object, cast_anew, cast_before, anew)


def changed_rows(old: Level, new: Level, change: WorldChange) -> np.ndarray:
    """Rows of the new samples that differ from those before, or were not there."""
    known = {
        (int(face), int(index)): row
        for row, (face, index) in enumerate(zip(old.samples.face, old.samples.index, strict=True))
    }
    rows: list[int] = []
    for row, (face, index) in enumerate(zip(new.samples.face, new.samples.index, strict=True)):
        before = known.get((int(change.old_face[face]), int(index)))
        if before is None or (old.ao[before] != new.ao[row]).any() or old.valid[before] != new.valid[row]:
            rows.append(row)
    return np.array(rows, np.int64)
