"""Values for components without any valid sample: those of the nearest vertices in space, wherever in the scene.

Only they look beyond their own block, so that they are kept apart: where each takes its value from, and how far that
is. An edit then asks only whether something nearer came up, and looks again for those whose source is gone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from bake.solve.average import OPEN, TIED, nearest_in
from bake.solve.system import Equations
from bake.types import BoolArray, Float64Array, Int64Array

MANY = 2000
"""More points than these are looked up in one tree over all blocks; fewer in the trees of blocks near them."""

NONE = np.zeros(0, np.int64)


class Places:
    """Where the unknowns of a block are, and which of them have samples.

    Args:
        position: Shape (u, 3), float64, metres.
        starved: Shape (u,), bool: unknowns without a valid sample.
        first: Shape (c + 1,), int64: component i owns unknowns `first[i]:first[i + 1]`.
    """

    def __init__(self, position: Float64Array, starved: BoolArray, first: Int64Array) -> None:
        self.position, self.starved = position, starved
        whole = np.repeat(np.logical_and.reduceat(starved, first[:-1]), np.diff(first)) if starved.any() else starved
        self.lost: Int64Array = np.flatnonzero(whole)
        self._known: tuple[cKDTree, Int64Array] | None = None

    def known(self) -> tuple[cKDTree, Int64Array]:
        """A tree of the unknowns that have samples, and their numbers."""
        if self._known is None:
            rows = np.flatnonzero(~self.starved)
            self._known = (cKDTree(self.position[rows]), rows)
        return self._known

    def same(self, position: Float64Array, starved: BoolArray) -> bool:
        """Whether they are still right."""
        return (position is self.position or np.array_equal(position, self.position)) and (
            starved is self.starved or np.array_equal(starved, self.starved)
        )


@dataclass(frozen=True, slots=True)
class Sources:
    """Where unknowns of components without samples take their average from; shape (l,) each.

    Attributes:
        block, unknown: They.
        from_block, from_unknown: Their sources; -1 where the scene has no sample at all.
        distance: In metres.
    """

    block: Int64Array
    unknown: Int64Array
    from_block: Int64Array
    from_unknown: Int64Array
    distance: Float64Array

    @staticmethod
    def none() -> Sources:
        """Of no unknowns."""
        return Sources(NONE, NONE, NONE, NONE, np.zeros(0))


def find_sources(
    places: Sequence[Places], before: Sequence[Places | None], came_from: Sequence[int], old: Sources
) -> Sources:
    """The sources of all unknowns that need one.

    Args:
        places: Of all blocks, in order.
        before: The same block's before; None where it is a new one.
        came_from: The number of each block before, -1 for new ones.
        old: The sources before.
    """
    counts = np.array([len(place.lost) for place in places], np.int64)
    if not counts.any():
        return Sources.none()
    block = np.repeat(np.arange(len(places)), counts)
    unknown = np.concatenate([place.lost for place in places])
    from_block, from_unknown = np.full(len(block), -1, np.int64), np.full(len(block), -1, np.int64)
    distance = np.full(len(block), np.inf)
    _carry_over(places, before, came_from, old, block, unknown, (from_block, from_unknown, distance))
    at = np.concatenate([place.position[place.lost] for place in places])
    carried = np.flatnonzero(from_block >= 0)
    anew_block, anew_unknown = _newly_known(places, before)
    points = np.zeros((0, 3))
    if len(carried) and len(anew_block):
        points = np.concatenate([places[b].position[anew_unknown[anew_block == b]] for b in _each(anew_block)])
        low, high = points.min(axis=0), points.max(axis=0)
        least = np.linalg.norm(at[carried] - np.clip(at[carried], low, high), axis=1)
        carried = carried[least <= distance[carried] * (1.0 + TIED)]
    if len(carried) and len(anew_block):
        found, apart = nearest_in(cKDTree(points), at[carried])
        number, held = (anew_block[found], anew_unknown[found]), (from_block[carried], from_unknown[carried])
        earlier = (number[0] < held[0]) | ((number[0] == held[0]) & (number[1] < held[1]))
        nearer = apart < distance[carried] * (1.0 - TIED)
        better = nearer | ((apart <= distance[carried] * (1.0 + TIED)) & earlier)
        from_block[carried[better]], from_unknown[carried[better]] = number[0][better], number[1][better]
        distance[carried[better]] = apart[better]
    wanting = np.flatnonzero(from_block < 0)
    if len(wanting):
        from_block[wanting], from_unknown[wanting], distance[wanting] = _look_up(places, at[wanting])
    return Sources(block, unknown, from_block, from_unknown, distance)


def filled_from_afar(equations: Sequence[Equations], sources: Sources) -> list[Equations]:
    """The equations of all blocks with the averages that the sources give."""
    filled = list(equations)
    for number in _each(sources.block):
        here = np.flatnonzero(sources.block == number)
        lost, whence = sources.unknown[here], sources.from_block[here]
        average = equations[number].average.copy()
        average[lost] = OPEN
        for other in _each(whence[whence >= 0]):
            own = whence == other
            average[lost[own]] = equations[other].average[sources.from_unknown[here[own]]]
        if not np.array_equal(average, equations[number].average):
            filled[number] = replace(equations[number], average=average)
    return filled


def _carry_over(
    places: Sequence[Places],
    before: Sequence[Places | None],
    came_from: Sequence[int],
    old: Sources,
    block: Int64Array,
    unknown: Int64Array,
    into: tuple[Int64Array, Int64Array, Float64Array],
) -> None:
    """Takes over the sources that are still there, for unknowns that are where they were."""
    now = np.full(max(came_from, default=-1) + 2, -1, np.int64)
    for number, past_number in enumerate(came_from):
        if past_number >= 0:
            now[past_number] = number

    def number_of(numbers: Int64Array) -> Int64Array:
        return np.where((numbers >= 0) & (numbers < len(now) - 1), now[np.clip(numbers, -1, len(now) - 1)], -1)

    own, source = number_of(old.block), number_of(old.from_block)
    kept = np.flatnonzero((own >= 0) & (source >= 0))
    own, source = own[kept], source[kept]
    who, whence = old.unknown[kept], old.from_unknown[kept]
    sound = np.ones(len(kept), np.bool_)
    for number, place in enumerate(places):
        past = before[number]
        if past is None or past is place:
            continue
        stays = (past.position == place.position).all(axis=1) if past.position is not place.position else None
        for blocks, rows, still in ((own, who, place.starved), (source, whence, ~place.starved)):
            here = np.flatnonzero(blocks == number)
            sound[here] &= still[rows[here]]
            if stays is not None:
                sound[here] &= stays[rows[here]]
    own, who, kept = own[sound], who[sound], kept[sound]
    stride = int(max((len(place.starved) for place in places), default=0)) + 1
    keys = block * stride + unknown
    at = np.minimum(np.searchsorted(keys, own * stride + who), max(len(keys) - 1, 0))
    match = keys[at] == own * stride + who
    at = at[match]
    into[0][at], into[1][at] = source[sound][match], whence[sound][match]
    into[2][at] = old.distance[kept[match]]


def _newly_known(places: Sequence[Places], before: Sequence[Places | None]) -> tuple[Int64Array, Int64Array]:
    """Blocks and numbers of unknowns that have samples and had none before, or were not there, in order."""
    blocks: list[Int64Array] = [NONE]
    rows: list[Int64Array] = [NONE]
    for number, (place, past) in enumerate(zip(places, before, strict=True)):
        if past is place:
            continue
        anew = ~place.starved
        if past is not None:
            other = past.starved
            if past.position is not place.position:
                other = other | (past.position != place.position).any(axis=1)
            anew = anew & other
        rows.append(np.flatnonzero(anew))
        blocks.append(np.full(len(rows[-1]), number, np.int64))
    return np.concatenate(blocks), np.concatenate(rows)


def _look_up(places: Sequence[Places], points: Float64Array) -> tuple[Int64Array, Int64Array, Float64Array]:
    """The nearest unknowns of all blocks that have samples: block, number and distance; -1 if there are none."""
    block, unknown = np.full(len(points), -1, np.int64), np.full(len(points), -1, np.int64)
    best = np.full(len(points), np.inf)
    if len(points) > MANY:
        rows = [np.flatnonzero(~place.starved) for place in places]
        every = np.concatenate([place.position[known] for place, known in zip(places, rows, strict=True)])
        if len(every):
            found, best = nearest_in(cKDTree(every), points)
            block = np.repeat(np.arange(len(places)), [len(known) for known in rows])[found]
            unknown = np.concatenate(rows)[found]
        return block, unknown, best
    boxes = [(place.position.min(axis=0), place.position.max(axis=0)) for place in places]
    least = np.stack([np.linalg.norm(points - np.clip(points, low, high), axis=1) for low, high in boxes])
    for number in map(int, np.argsort(least.sum(axis=1), kind="stable")):
        near = np.flatnonzero(least[number] <= best * (1.0 + TIED))
        if not len(near) or places[number].starved.all():
            continue
        tree, rows = places[number].known()
        found, apart = nearest_in(tree, points[near])
        tied = (apart <= best[near] * (1.0 + TIED)) & (number < block[near])
        better = (apart < best[near] * (1.0 - TIED)) | tied
        block[near[better]], unknown[near[better]] = number, rows[found[better]]
        best[near[better]] = apart[better]
    return block, unknown, best


def _each(numbers: Int64Array) -> list[int]:
    """The distinct ones, sorted."""
    return [int(number) for number in np.unique(numbers)]
