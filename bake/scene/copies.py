"""Copies of objects that a side file adds to a scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from bake.errors import SceneError
from bake.scene.object_keys import nearest
from bake.scene.parsed import Placement
from bake.scene.side_file import CopyRule


def with_copies(placements: Sequence[Placement], copies: Sequence[CopyRule], where: str) -> list[Placement]:
    """The placements of a file, and behind them the copies that its side file asks for, in its order.

    A copy begins where the file has the original, whatever the side file says of that, and with what the file itself
    declares of it; its own keys overrule all that `[[object]]` rules say. It may be a copy of an earlier copy.

    Raises:
        SceneError: the original does not exist, or the copy's path is taken.
    """
    known = {item.path: item for item in placements}
    result = list(placements)
    for number, copy in enumerate(copies, start=1):
        here = f"{where}: [[copy]] number {number} ({copy.path})"
        original = known.get(copy.of)
        if original is None:
            remedy = nearest(copy.of, sorted(known)[:10_000]) if len(known) < 10_000 else "check the path"
            raise SceneError(f"it is a copy of {copy.of!r}, which does not exist", where=here, remedy=remedy)
        if copy.path in known:
            raise SceneError("the scene has an object of that path already", where=here, remedy="give it another name")
        made = replace(
            original, path=copy.path, name_path=copy.path, node=-1, node_instance=-1, own=copy.keys, copy_of=copy.of
        )
        known[copy.path] = made
        result.append(made)
    return result
