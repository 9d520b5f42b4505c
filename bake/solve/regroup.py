"""Which blocks of a scene an edit leaves in one piece, and how the rest is cut anew."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bake.change_types import WorldChange
from bake.solve.block import cut_into_blocks
from bake.solve.object_match import Match, joiners, match_objects, receivers
from bake.types import Int64Array, World


@dataclass(frozen=True, slots=True)
class Group:
    """The objects of a block in the new world.

    Attributes:
        objects: Shape (o,), int64, ascending.
        before: The block that they were; -1 if the block is a new one.
        moved: Whether some of them were moved as rigid bodies.
    """

    objects: Int64Array
    before: int
    moved: bool = False


def regroup(
    old: World, blocks: Sequence[Int64Array], new: World, change: WorldChange | None, *, weld_instances: bool
) -> tuple[list[Group], list[Match]]:
    """The blocks of the new world in the order of their first object, and what became of each of its objects.

    Args:
        old: The world before.
        blocks: The objects of its blocks.
        new: The world now.
        change: How it follows; None if it is the same.
        weld_instances: As in the settings.
    """
    if change is None:
        same = [Match.SAME] * new.object_count
        return [Group(objects, number) for number, objects in enumerate(blocks)], same
    matches = match_objects(old, new, change, weld_instances=weld_instances)
    wanted = receivers(new)
    receives = np.zeros(new.object_count, np.bool_)
    receives[wanted] = True
    sound = np.array([match is not Match.OTHER for match in matches], np.bool_)
    shifted = np.array([match is Match.MOVED for match in matches], np.bool_)
    whole: list[Group] = []
    for number, objects in enumerate(blocks):
        now = change.new_object[objects]
        if (now >= 0).all() and (receives & sound)[now].all() and (np.diff(now) > 0).all():
            whole.append(Group(now, number, bool(shifted[now].any())))
    joining = joiners(new, weld_instances)
    kept = {int(i) for group in whole for i in group.objects}
    if not joining <= kept:  # what may share vertices is one block
        whole = [group for group in whole if int(group.objects[0]) not in joining]
        kept = {int(i) for group in whole for i in group.objects}
    rest = np.array([i for i in wanted if int(i) not in kept], np.int64)
    fresh = [Group(objects, -1) for objects in cut_into_blocks(new, rest, weld_instances=weld_instances)]
    return sorted(whole + fresh, key=lambda group: int(group.objects[0])), matches
