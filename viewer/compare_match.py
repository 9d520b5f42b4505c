"""Two bakes of one scene: which object is which, and the values of one carried to the vertices of the other."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bake.errors import ResultError
from bake.types import Int32Array, Int64Array, UInt8Array, VertexField, VertexState, World
from viewer.fields import distance_label

_MOVED = 1e-4


class Pairing(enum.IntEnum):
    """How an object of one world stands to the object of its path in the other."""

    SAME = 0
    MOVED = 1
    RESIZED = 2
    ALONE = 3

    @property
    def words(self) -> str:
        """For people."""
        return ("in both", "moved or reshaped", "other number of vertices", "not in the other")[self]


@dataclass(frozen=True, slots=True)
class Match:
    """What of another world belongs to what of this one.

    Attributes:
        object: Shape (o,), int32: the other world's object, -1 where none fits.
        pairing: Shape (o,), uint8, a `Pairing`.
        vertex: Shape (n,), int64: the other world's vertex, -1 where none fits.
        missing: Paths that only the other world has.
    """

    object: Int32Array
    pairing: UInt8Array
    vertex: Int64Array
    missing: tuple[str, ...]

    def count(self, pairing: Pairing) -> int:
        """Objects that stand so."""
        return int(np.count_nonzero(self.pairing == pairing))

    @property
    def summary(self) -> str:
        """What fits and what does not, in one line."""
        fitting = self.count(Pairing.SAME) + self.count(Pairing.MOVED)
        parts = [f"{fitting:,} of {len(self.object):,} objects match"]
        for number, words in (
            (self.count(Pairing.MOVED), "moved"),
            (self.count(Pairing.RESIZED), "with another number of vertices"),
            (self.count(Pairing.ALONE), "only here"),
            (len(self.missing), "only there"),
        ):
            if number:
                parts.append(f"{number:,} {words}")
        return ", ".join(parts)


def match_worlds(world: World, other: World) -> Match:
    """Pairs objects by path; those with equal numbers of vertices match, vertex by vertex.

    Args:
        world: What is in view.
        other: Another state of the same scene.
    """
    there = {path: index for index, path in enumerate(other.object_paths)}
    found = np.array([there.get(path, -1) for path in world.object_paths], np.int32).reshape(-1)
    counts, other_counts = np.diff(world.first_vertex), np.diff(other.first_vertex)
    pairing = np.where(found < 0, Pairing.ALONE, Pairing.SAME).astype(np.uint8)
    if len(other_counts):
        pairing[(found >= 0) & (counts != other_counts[np.maximum(found, 0)])] = Pairing.RESIZED
    fits = pairing == Pairing.SAME
    shift = np.zeros(len(found), np.int64)
    shift[fits] = np.asarray(other.first_vertex)[found[fits]] - np.asarray(world.first_vertex)[:-1][fits]
    owner = np.repeat(np.arange(len(found)), counts)
    vertex = np.where(fits[owner], np.arange(len(owner)) + shift[owner], -1)
    known = np.flatnonzero(vertex >= 0)
    offset = np.asarray(world.origin) - np.asarray(other.origin)
    away = np.abs(np.asarray(world.positions)[known] + offset - np.asarray(other.positions)[vertex[known]])
    pairing[np.unique(owner[known[away.max(axis=1, initial=0.0) > _MOVED]])] = Pairing.MOVED
    here = set(world.object_paths)
    missing = tuple(path for path in other.object_paths if path not in here)
    return Match(np.where(fits, found, -1).astype(np.int32), pairing, vertex, missing)


def carried(
    match: Match, field: VertexField, field_distances: Sequence[float], distances: Sequence[float]
) -> VertexField:
    """The other bake's values at this world's vertices.

    Args:
        match: Which vertex is which.
        field: Of the other bake.
        field_distances: Its distances, metres.
        distances: This bake's k distances, metres.

    Returns:
        AO of shape (n, k); `NOT_BAKED` and NaN where nothing matches, NaN at distances the other bake has not.

    Raises:
        ResultError: the bakes have no distance in common.
    """
    known = np.flatnonzero(match.vertex >= 0)
    source = match.vertex[known]
    ao = np.full((len(match.vertex), len(distances)), np.nan, np.float32)
    state = np.full(len(match.vertex), VertexState.NOT_BAKED, np.uint8)
    state[known] = np.asarray(field.state)[source]
    given = np.asarray(field_distances, np.float64)
    common = 0
    for column, metres in enumerate(distances):
        same = np.flatnonzero(np.isclose(given, metres, rtol=1e-6))
        if len(same):
            ao[known, column] = np.asarray(field.ao[:, same[0]])[source]
            common += 1
    if not common:
        raise ResultError(
            f"the other result has no distance in common: {', '.join(map(distance_label, field_distances))}",
            remedy=f"bake it at {' or '.join(map(distance_label, distances))} too",
        )
    return VertexField(ao, state, field.report)
