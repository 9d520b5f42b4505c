"""Which points in space are traced anew after an edit: those with a ray that it can have changed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bake.rebake.reach import Reached
from bake.types import BoolArray, Float32Array, Int64Array


def wanted_points(
    former: Int64Array,
    found: Reached,
    before: Float32Array,
    *,
    bound: float,
    scale: float,
    ray: float,
    look: Callable[[Int64Array], BoolArray] | None,
) -> tuple[BoolArray, Float32Array]:
    """Decides point by point.

    With `look` nothing is skipped: where no ray can have changed, nothing has. Where something was skipped before, what
    is known is not what the rays found, and a point is traced once the sum is above the bound.

    Args:
        former: Shape (n,): where what is known of each point stands, -1 if it is new.
        found: What the edit may do to each.
        before: Shape (n,), in AO: what was skipped for each before; means nothing for new ones.
        bound: Most that may be skipped in all; at 0 nothing is.
        scale: Most that a coefficient changes where the open share of a view changes by one.
        ray: Most that one ray changes of a coefficient.
        look: Tells which of some points, by their numbers, have a ray that can have changed; None if nobody can.

    Returns:
        Which are to be traced, shape (n,), and what is skipped of each after this edit, shape (n,), float32.
    """
    owed = np.where(former >= 0, before, np.float32(0.0))
    skipped = (owed + np.float32(scale) * found.bound).astype(np.float32)
    counts = found.single * np.float32(ray) > 2.0 * bound
    wanted = (former < 0) | (found.touched if bound <= 0.0 else counts | (skipped > bound))
    if look is not None:
        asked = np.flatnonzero((former >= 0) & found.touched & (owed <= 0.0))
        wanted[asked] = look(asked)
        skipped[asked] = 0.0
    skipped[wanted] = 0.0
    return wanted, skipped
