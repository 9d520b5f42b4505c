"""The engine process's side of re-solves: what the first one builds up for a result serves those after it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bake.settings import BakeSettings
from bake.types import BakeResult, VertexField

if TYPE_CHECKING:
    from bake.solve.update import FieldKeeper

TOLERANCE = 1.0 / 1024.0
"""How far values may be from those of a whole solve, in AO: a quarter of what 8 bits tell apart."""


class SolveKeeper:
    """Solves for the vertices of one result after another; a change of threshold or smoothing starts from the last."""

    def __init__(self) -> None:
        self._result: BakeResult | None = None
        self._keeper: FieldKeeper | None = None
        self._settings: BakeSettings | None = None

    def solve(self, result: BakeResult, settings: BakeSettings, begin: FieldKeeper | None = None) -> VertexField:
        """The values of stored samples with other settings.

        Args:
            result: Whose samples; the same object as before where nothing was stored since.
            settings: As wanted; what they say of rays is passed over.
            begin: What follows the result's values, if it is at hand.
        """
        from bake.solve import map_to_vertices

        valid = result.tally.valid(settings.back_face_threshold)
        if settings.mapping is not result.settings.mapping or result.stale:
            return map_to_vertices(result.world, result.samples, result.tally.ao, valid, settings)
        keeper, before = self._keeper, self._settings
        if self._result is not result or keeper is None or before is None:
            before = result.settings
            keeper = begin or _keeper_of(result)
        changed = np.flatnonzero(valid != result.tally.valid(before.back_face_threshold))
        update = keeper.updated(
            result.world, result.samples, result.tally.ao, valid, None, changed, settings, tolerance=TOLERANCE
        )
        self._result, self._keeper, self._settings = result, update.keeper, settings
        return update.field


def _keeper_of(result: BakeResult) -> FieldKeeper:
    from bake.solve.update import FieldKeeper

    known = result.tally.valid(result.settings.back_face_threshold)
    surfaces = _surfaces_alone(result)
    return FieldKeeper(result.world, result.samples, result.tally.ao, known, result.settings, field=surfaces)


def _surfaces_alone(result: BakeResult) -> VertexField | None:
    """The stored values where they are those of a solve alone; None where levels of detail were resampled into them."""
    from bake.types import Role

    return None if Role.LOD in result.world.object_roles else result.field
