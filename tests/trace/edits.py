"""Small worlds that are edited at random: soup with partly open faces, trees and fog, and what an edit makes of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from hashlib import blake2b

import numpy as np

from bake.decorator_types import FogBoxes
from bake.types import Role, World
from tests.worlds import box, icosphere, make_world, quad


@dataclass(frozen=True)
class Thing:
    """An object to be placed: its shape about the origin, where it lies, how it treats rays."""

    path: str
    shape: tuple[np.ndarray, np.ndarray]
    place: tuple[float, float, float]
    role: Role = Role.STATIC
    openness: float = 0.0
    two_sided: bool = False
    textured: bool = False


_ROLES = (Role.STATIC, Role.STATIC, Role.STATIC, Role.TREE, Role.SHRUB, Role.BLOCKER, Role.IGNORE)
STRIPES = np.tile(np.array([0.0, 1.0, 0.4], np.float32), (3, 5))


def world_of(things: list[Thing], *, lookup: bool = False) -> World:
    """The world of some things, in their order."""
    objects = [(shape[0] + np.asarray(place), shape[1]) for shape, place in ((t.shape, t.place) for t in things)]
    counts = [len(t.shape[1]) for t in things]

    def spread(values: list) -> np.ndarray:
        return np.repeat(np.array(values), counts)

    world = make_world(
        *objects,
        two_sided=spread([t.two_sided for t in things]),
        openness=spread([t.openness for t in things]),
        casts=spread([t.role.casts_opaque for t in things]),
        samples=spread([t.role.receives_per_vertex for t in things]),
        roles=tuple(t.role for t in things),
    )
    said = [repr((t.shape[0].tolist(), t.place, t.role, t.openness, t.two_sided, t.textured)) for t in things]
    world = replace(
        world,
        object_paths=tuple(t.path for t in things),
        object_hash=tuple(blake2b(text.encode()).hexdigest() for text in said),
    )
    if not lookup:
        return world
    return replace(
        world,
        vertex_uv=(world.positions[:, [0, 2]] * 0.7).astype(np.float32),
        face_texture=np.where(spread([t.textured for t in things]), 0, -1).astype(np.int32),
        textures=(STRIPES,),
    )


def fog_of(world: World) -> FogBoxes | None:
    """A box of fog about every shrub."""
    shrubs = [number for number, role in enumerate(world.object_roles) if role is Role.SHRUB]
    if not shrubs:
        return None
    ends = [
        world.positions[world.first_vertex[number] : world.first_vertex[number + 1]].astype(np.float32)
        for number in shrubs
    ]
    density = np.full(len(shrubs), 0.4, np.float32)
    low, high = (np.array([getattr(own, side)(axis=0) for own in ends]) for side in ("min", "max"))
    return FogBoxes(np.array(shrubs, np.int32), low, high, density, density)


def start(seed: int, count: int = 10) -> list[Thing]:
    """A floor with things on it."""
    rng = np.random.default_rng(seed)
    things = [Thing("floor", quad(12.0), (0.0, 0.0, 0.0))]
    return things + [_thing(rng, f"thing {number}") for number in range(count)]


def _thing(rng: np.random.Generator, path: str) -> Thing:
    role = _ROLES[rng.integers(len(_ROLES))]
    shape = box(tuple(rng.uniform(0.5, 3, 3))) if rng.random() < 0.5 else icosphere(1, rng.uniform(0.4, 1.5))
    openness = rng.uniform(0.1, 0.9) if role is Role.TREE or rng.random() < 0.3 else 0.0
    return Thing(path, shape, _place(rng), role, float(openness), bool(rng.random() < 0.3), bool(rng.random() < 0.5))


def _place(rng: np.random.Generator) -> tuple[float, float, float]:
    return tuple((rng.uniform(-4, 4, 3) * [1, 0.3, 1] + [0, 0.5, 0]).tolist())


def edited(things: list[Thing], rng: np.random.Generator) -> list[Thing]:
    """After one edit: move, scale, delete, add, replace, role, openness, sides, another order."""
    things = list(things)
    number = int(rng.integers(1, len(things)))
    old = things[number]
    match int(rng.integers(9)):
        case 0 | 1:
            things[number] = replace(old, place=_place(rng))
        case 2:
            things[number] = replace(old, shape=(old.shape[0] * rng.uniform(0.5, 1.5), old.shape[1]))
        case 3 if len(things) > 3:
            del things[number]
        case 4:
            things.insert(number, _thing(rng, f"new {rng.integers(1 << 40)}"))
        case 5:
            things[number] = _thing(rng, old.path)
        case 6:
            things[number] = replace(old, role=_ROLES[rng.integers(len(_ROLES))])
        case 7:
            things[number] = replace(old, openness=float(rng.uniform(0, 0.9)), two_sided=not old.two_sided)
        case _:
            things[1:] = [things[1 + k] for k in rng.permutation(len(things) - 1)]
    return things
