"""The values of a bake after a small change, without solving for all of them again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.change_types import WorldChange
from bake.settings import BakeSettings
from bake.solve.mapper import VertexMapper
from bake.types import BoolArray, Float32Array, Int64Array, SampleSet, VertexField, World

TOLERANCE = 1e-4
"""How far values may be from those of a whole solve, in AO, unless told otherwise."""


@dataclass(frozen=True, slots=True)
class FieldUpdate:
    """What became of the values.

    Attributes:
        keeper: Of the changed bake; the one before it stays as it was.
        field: The changed bake's values.
        vertices: Shape (n,), int64, sorted: vertices of the changed world whose value or state is another one, and
            those that it did not have before.
        bound: Estimate of how far any value may be from that of a whole solve, in AO.
        solved: Unknowns that were solved for.
    """

    keeper: FieldKeeper
    field: VertexField
    vertices: Int64Array
    bound: float
    solved: int


class FieldKeeper:
    """The values of one bake and what they hang on, kept to follow small changes.

    Args:
        world: The flattened scene.
        samples: Where AO was estimated.
        ao: Shape (n, k), float32, in [0, 1]: AO of the samples.
        valid: Shape (n,), bool: samples to use.
        settings: Mapping, alpha, welding.
        field: What `map_to_vertices` makes of these; solved for if None.

    Attributes:
        field: The values.
    """

    def __init__(
        self,
        world: World,
        samples: SampleSet,
        ao: Float32Array,
        valid: BoolArray,
        settings: BakeSettings,
        *,
        field: VertexField | None = None,
    ) -> None:
        self.field = field or VertexMapper(world, samples, settings).solve(ao, valid)

    def updated(
        self,
        world: World,
        samples: SampleSet,
        ao: Float32Array,
        valid: BoolArray,
        change: WorldChange | None,
        changed_rows: Int64Array,
        settings: BakeSettings,
        *,
        tolerance: float = TOLERANCE,
    ) -> FieldUpdate:
        """The values after a change; this keeper stays as it is.

        Args:
            world, samples, ao, valid, settings: The changed bake's.
            change: How its world follows from this keeper's; None if it is the same.
            changed_rows: Shape (r,), int64: rows of `samples` whose AO or validity is another one than before. Those
                on faces of objects that receive anew need not be named.
            settings: The changed bake's.
            tolerance: How far values may be from those of a whole solve, in AO; 0 for a whole solve.

        Raises:
            SolveError: a value that should be used is not finite.
        """
        before = np.full((world.vertex_count, ao.shape[1]), np.nan, np.float32)
        state = np.full(world.vertex_count, -1, np.int16)
        if change is None:
            before[:], state[:] = self.field.ao, self.field.state
        else:
            told = np.flatnonzero(change.old_vertex >= 0)
            before[told], state[told] = (
                values[change.old_vertex[told]] for values in (self.field.ao, self.field.state)
            )
        field = VertexMapper(world, samples, settings).solve(ao, valid, start=before)
        same = ((field.ao == before) | (np.isnan(field.ao) & np.isnan(before))).all(axis=1) & (state == field.state)
        keeper = FieldKeeper(world, samples, ao, valid, settings, field=field)
        return FieldUpdate(keeper, field, np.flatnonzero(~same), 0.0, field.report.unknowns)
