"""Surface samples of an edited world, made from those of the world before: only those of changed objects are new."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.change_types import WorldChange
from bake.rebake.part_world import part_world
from bake.samples import place_samples
from bake.settings import BakeSettings
from bake.types import BoolArray, Int64Array, SampleSet, World


@dataclass(frozen=True, slots=True)
class RowMap:
    """Where each sample of the edited world was before.

    Attributes:
        count: Samples of the edited world.
        runs: Spans of the edited world's samples and the spans that they were: whole objects whose content is equal.
        rest: Shape (r,), int64, ascending: the other samples.
        rest_old: Shape (r,), int64: the same sample of the old world, at the same place and with the same rays; -1 if
            there is none.
        rest_former: Shape (r,), int64: the sample of the same number on the same face of the same object, wherever it
            lay; -1 if there is none.
    """

    count: int
    runs: tuple[tuple[slice, slice], ...]
    rest: Int64Array
    rest_old: Int64Array
    rest_former: Int64Array

    def carried(self, values: NDArray[Any], *, former: bool = False) -> NDArray[Any]:
        """Values of the old samples at the new ones; zeros where there is none.

        Args:
            values: Shape (old samples, …).
            former: Samples that moved take over theirs as well.
        """
        found = np.empty((self.count, *values.shape[1:]), values.dtype)
        for now, then in self.runs:
            found[now] = values[then]
        source = self.source(former=former)
        known = source >= 0
        found[self.rest] = 0
        found[self.rest[known]] = values[source[known]]
        return found

    def source(self, *, former: bool) -> Int64Array:
        """For the samples in `rest` what `carried` takes, shape (r,)."""
        return np.where(self.rest_old >= 0, self.rest_old, self.rest_former) if former else self.rest_old

    def lacking(self, *, former: bool = False) -> BoolArray:
        """Samples that have none, shape (n,)."""
        found = np.zeros(self.count, np.bool_)
        found[self.rest] = self.source(former=former) < 0
        return found


def samples_after(
    old: SampleSet, old_world: World, world: World, change: WorldChange, settings: BakeSettings, *, anew: bool
) -> tuple[SampleSet, RowMap]:
    """The samples that `place_samples` gives the edited world, and where they were.

    Args:
        old, old_world: Before the edit.
        world: Edited.
        change: How it follows from the old one.
        settings: As wanted now.
        anew: Settings differ that decide about samples, so that all are placed again.
    """
    same = _same_objects(old_world, world, change)
    old_first = np.searchsorted(old.face, old_world.first_face).astype(np.int64)
    if anew:
        samples = place_samples(world, settings)
        first = np.searchsorted(samples.face, world.first_face).astype(np.int64)
        same &= np.diff(first) == np.diff(old_first)[np.maximum(change.old_object, 0)]
        # As many samples on an object need not lie on the same faces.
        for number in np.flatnonzero(same).tolist():
            before = int(change.old_object[number])
            own, then = slice(*first[number : number + 2]), slice(*old_first[before : before + 2])
            shift = int(world.first_face[number] - old_world.first_face[before])
            same[number] = bool(np.array_equal(samples.face[own], old.face[then] + np.int32(shift)))
        runs = _runs(same, change.old_object, first, old_first)
    else:
        samples, first, runs = _spliced(old, old_first, old_world, world, same, change, settings)
    rest = _rest(runs, len(samples))
    rest_old, rest_former = _matched(old, samples, rest, change, old_world, world)
    return samples, RowMap(len(samples), tuple(runs), rest, rest_old, rest_former)


def _same_objects(old: World, new: World, change: WorldChange) -> BoolArray:
    """Objects whose content is equal, shape (o,)."""
    same = np.array(
        [
            before >= 0 and old.object_hash[before] == new.object_hash[number]
            for number, before in enumerate(change.old_object.tolist())
        ],
        np.bool_,
    )
    return same.reshape(-1)


def _runs(
    same: BoolArray, old_object: Int64Array, first: Int64Array, old_first: Int64Array
) -> list[tuple[slice, slice]]:
    """Equal objects that follow each other in both worlds, as spans of samples."""
    number = np.flatnonzero(same)
    if not len(number):
        return []
    before = old_object[number]
    breaks = np.flatnonzero((np.diff(number) != 1) | (np.diff(before) != 1)) + 1
    begins, ends = [0, *breaks.tolist()], [*breaks.tolist(), len(number)]
    return [
        (
            slice(int(first[number[a]]), int(first[number[b - 1] + 1])),
            slice(int(old_first[before[a]]), int(old_first[before[b - 1] + 1])),
        )
        for a, b in zip(begins, ends, strict=True)
    ]


def _spliced(
    old: SampleSet,
    old_first: Int64Array,
    old_world: World,
    world: World,
    same: BoolArray,
    change: WorldChange,
    settings: BakeSettings,
) -> tuple[SampleSet, Int64Array, list[tuple[slice, slice]]]:
    """The old samples with those of changed objects taken out and placed anew."""
    fresh_numbers = np.flatnonzero(~same)
    part = part_world(world, fresh_numbers)
    fresh = place_samples(part, settings)
    fresh_first = np.searchsorted(fresh.face, part.first_face).astype(np.int64)
    counts = np.zeros(world.object_count, np.int64)
    counts[same] = np.diff(old_first)[change.old_object[same]]
    counts[fresh_numbers] = np.diff(fresh_first)
    first = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    runs = _runs(same, change.old_object, first, old_first)

    def joined(name: str) -> NDArray[Any]:
        values, more = getattr(old, name), getattr(fresh, name)
        found = np.empty((int(first[-1]), *values.shape[1:]), values.dtype)
        for now, then in runs:
            found[now] = values[then]
        for row, number in enumerate(fresh_numbers.tolist()):
            found[first[number] : first[number + 1]] = more[fresh_first[row] : fresh_first[row + 1]]
        return found

    face, seed = joined("face"), np.empty(world.face_count, np.uint32)
    shifts = world.first_face[:-1] - old_world.first_face[:-1][np.maximum(change.old_object, 0)]
    for now, then in _runs(same, change.old_object, world.first_face, old_world.first_face):
        seed[now] = old.face_seed[then]
    for number in np.flatnonzero(same & (shifts != 0)).tolist():
        face[first[number] : first[number + 1]] += np.int32(shifts[number])
    for row, number in enumerate(fresh_numbers.tolist()):
        shift = int(world.first_face[number] - part.first_face[row])
        face[first[number] : first[number + 1]] += np.int32(shift)
        seed[world.first_face[number] : world.first_face[number + 1]] = fresh.face_seed[
            part.first_face[row] : part.first_face[row + 1]
        ]
    samples = SampleSet(face, joined("barycentric"), joined("area"), joined("index"), seed)
    return samples, first, runs


def _rest(runs: list[tuple[slice, slice]], count: int) -> Int64Array:
    inside = np.zeros(count, np.bool_)
    for now, _ in runs:
        inside[now] = True
    return np.flatnonzero(~inside)


def _matched(
    old: SampleSet, new: SampleSet, rest: Int64Array, change: WorldChange, old_world: World, world: World
) -> tuple[Int64Array, Int64Array]:
    """Rows of the old world for some of the new: the same sample, and that of the same face and number."""
    face, index = new.face[rest], new.index[rest]
    carried = change.old_face[face].astype(np.int64)
    owner = world.face_object[face]
    before = change.old_object[owner]
    known = np.maximum(before, 0)
    counts, old_counts = np.diff(world.first_face), np.diff(old_world.first_face)
    alike = (before >= 0) & (old_counts[known] == counts[owner]) if len(old_counts) else np.zeros(len(rest), np.bool_)
    former = np.where(alike, face - world.first_face[owner] + old_world.first_face[known], -1)
    return _rows(old, carried, index), _rows(old, former, index)


def _rows(old: SampleSet, face: Int64Array, index: NDArray[np.integer]) -> Int64Array:
    """Rows of samples by face and number, shape (r,); -1 where there is none."""
    if not len(face):
        return np.zeros(0, np.int64)
    begin = np.searchsorted(old.face, face.astype(old.face.dtype))
    end = np.searchsorted(old.face, face.astype(old.face.dtype), side="right")
    return np.where((face >= 0) & (index < end - begin), begin + index, -1).astype(np.int64)
