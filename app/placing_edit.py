"""What dragging, typing and duplicating mean for the keys of objects in the side file."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from bake.types import Float64Array, Placing, Role, SceneObject
from viewer.gizmo import Motion

_DECIMALS = 6
"""Of metres, degrees and factors: a thousandth of a millimetre, and what float32 can tell apart in a level."""


def keys_of(placing: Placing) -> dict[str, Any]:
    """Keys that put an object there; None takes away what says nothing."""
    translate, rotate, scale = (
        [round(value, _DECIMALS) + 0.0 for value in values]
        for values in (placing.translate, placing.rotate, placing.scale)
    )
    return {
        "translate": translate if any(translate) else None,
        "rotate": rotate if any(rotate) else None,
        "scale": None if scale == [1.0] * 3 else scale[0] if len(set(scale)) == 1 else scale,
    }


def keys_after(items: Iterable[SceneObject], motion: Motion, centre: Float64Array) -> dict[str, dict[str, Any]]:
    """Keys of objects after a motion, by path.

    Args:
        items: As they are now.
        motion: What is done to them.
        centre: What it is about, shape (3,), world metres.
    """
    return {item.path: keys_of(placing_after(item, motion, centre)) for item in items}


def placing_after(item: SceneObject, motion: Motion, centre: Float64Array) -> Placing:
    """Where a motion about a point, shape (3,), world metres, puts an object."""
    from bake.scene.placing import rotation, rotation_degrees

    placing = item.placing or Placing()
    origin = np.array(placing.origin)
    shift = motion.moved(origin[None], centre)[0] - origin
    turned = not np.array_equal(motion.turn, np.eye(3))
    return dataclasses.replace(
        placing,
        translate=_triple(np.asarray(placing.translate) + shift),
        rotate=rotation_degrees(motion.turn @ rotation(placing.rotate)) if turned else placing.rotate,
        scale=_triple(motion.factor * np.asarray(placing.scale)),
    )


def copy_tables(items: Sequence[SceneObject], taken: Collection[str], shift: Sequence[float]) -> list[dict[str, Any]]:
    """The `[[copy]]` tables that duplicate objects as they are now, moved by a shift in metres.

    Args:
        items: What to duplicate; levels of detail are left out, since they need a finest level of their own.
        taken: All paths of the scene.
        shift: Three numbers.
    """
    taken = set(taken)
    tables: list[dict[str, Any]] = []
    for item in items:
        if item.role is Role.LOD:
            continue
        folder, slash, name = item.path.rpartition("/")
        stem = re.sub(r"(#\d+|_copy\d*)$", "", name)
        number, chosen = 1, f"{stem}_copy"
        while folder + slash + chosen in taken:
            number += 1
            chosen = f"{stem}_copy{number}"
        taken.add(folder + slash + chosen)
        placing = item.placing or Placing()
        moved = dataclasses.replace(placing, translate=_triple(np.asarray(placing.translate) + np.asarray(shift)))
        said: Mapping[str, Any] = {"role": item.role.value, **dataclasses.asdict(item.keys), **keys_of(moved)}
        given = {key: value for key, value in said.items() if value is not None and key != "of"}
        tables.append({"of": item.copy_of or item.path, "name": chosen, **given})
    return tables


def _triple(values: Float64Array) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z
