"""Surface samples from the numbering of one world to that of the next."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.change_types import WorldChange
from bake.types import BoolArray, Int64Array, SampleSet, Tally, World


@dataclass(frozen=True, slots=True)
class CarriedSamples:
    """Where each sample of the edited world was before.

    Attributes:
        old_row: Shape (n,), int64: the same sample of the old world, at the same place and with the same rays; -1 if
            there is none.
        former_row: Shape (n,), int64: the sample of the same number on the same face of the same object, wherever it
            lay; -1 if there is none.
    """

    old_row: Int64Array
    former_row: Int64Array


def carry_samples(
    old: SampleSet, new: SampleSet, change: WorldChange, old_world: World, world: World
) -> CarriedSamples:
    """Matches samples by face and number.

    Args:
        old, new: Of both worlds; equal seeds.
        change: How one world follows from the other.
        old_world, world: The worlds.
    """
    counts = np.bincount(old.face, minlength=old_world.face_count)
    first = np.cumsum(counts) - counts
    former_face = _former_faces(change, old_world, world)

    def rows(face_before: Int64Array) -> Int64Array:
        face = face_before[new.face]
        known = np.maximum(face, 0)
        there = (face >= 0) & (new.index < counts[known]) if len(counts) else np.zeros(len(new), np.bool_)
        return np.where(there, first[known] + new.index, -1) if len(counts) else np.full(len(new), -1, np.int64)

    return CarriedSamples(rows(change.old_face.astype(np.int64)), rows(former_face))


def _former_faces(change: WorldChange, old: World, new: World) -> Int64Array:
    """The old face of each new one by object and number, carried or not, shape (m,); -1 where there is none."""
    found = change.old_face.astype(np.int64)
    for number in np.flatnonzero(change.old_object >= 0).tolist():
        before = int(change.old_object[number])
        own = slice(int(new.first_face[number]), int(new.first_face[number + 1]))
        if own.stop - own.start == int(old.first_face[before + 1] - old.first_face[before]):
            found[own] = np.arange(own.stop - own.start) + int(old.first_face[before])
    return found


def carried_tally(old: Tally, rows: Int64Array) -> Tally:
    """The tally of samples by their old rows; zeros where there is none."""
    known = rows >= 0
    new = Tally.empty(len(rows), old.ao.shape[1])
    source = rows[known]
    new.ao[known], new.rays[known] = old.ao[source], old.rays[source]
    new.hits[known], new.back_faces[known] = old.hits[source], old.back_faces[source]
    return new


def marginal(tally: Tally, threshold: float, rays: int) -> BoolArray:
    """Samples that a few rays more or less would make valid or invalid, shape (n,).

    Those without any back face are not among them: only a newly seen back would turn them, which closed bodies never
    show, and a lonely hit in the open does not blacken a vertex.
    """
    hits, backs = tally.hits.astype(np.float32), tally.back_faces.astype(np.float32)
    slack = np.abs(np.float32(threshold) * hits - backs)
    return (backs > 0) & (slack <= np.float32(max(2.0, rays / 32.0)))
