"""Reads another result and carries its values to the vertices in view; runs in a worker thread."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from app.opening import read_result
from bake.types import BakeResult, Float32Array, VertexField
from viewer.compare_changes import Changes, changes_of
from viewer.compare_match import Match, carried, match_worlds
from viewer.decorated import DecoratedValues
from viewer.decorator_view import DecoratorView
from viewer.tone import blend


@dataclass(frozen=True, slots=True)
class OtherResult:
    """Another result, matched to the one in view.

    Attributes:
        path: Its folder.
        result: What it says.
        values: Those of its decorators.
        of: The result that it was matched to.
        match: What of it belongs where.
    """

    path: Path
    result: BakeResult
    values: DecoratedValues
    of: BakeResult
    match: Match


@dataclass(frozen=True, slots=True)
class Wanted:
    """What a comparison is made of.

    Attributes:
        path: Folder of the other result.
        result: The result in view.
        field: Its values in view, those of decorators apart.
        values: Values of its decorators.
        coloring: What decorators show.
        column: Distance of the table, -1 for the blend.
        short_share: Weight of the shortest distance in the blend.
    """

    path: Path
    result: BakeResult
    field: VertexField
    values: DecoratedValues
    coloring: DecoratorView
    column: int
    short_share: float

    def same_as(self, other: Wanted | None) -> bool:
        """Whether the outcome would be the same; results count by identity."""
        return (
            other is not None
            and self.result is other.result
            and self.field is other.field
            and (self.path, self.coloring, self.column, self.short_share)
            == (other.path, other.coloring, other.column, other.short_share)
        )


@dataclass(frozen=True, slots=True)
class Compared:
    """A comparison, ready to be shown.

    Attributes:
        wanted: What was asked for.
        other: The other result.
        field: Its values at the vertices in view, with those of its decorators.
        changes: By object, at the distance asked for.
    """

    wanted: Wanted
    other: OtherResult
    field: VertexField
    changes: Changes


def compare(wanted: Wanted, known: OtherResult | None, kept: VertexField | None) -> Compared:
    """Compares two results.

    Args:
        wanted: What with what.
        known: The other result, if it has been read before.
        kept: Its values as carried before, if they still hold.

    Raises:
        ResultError: the other is no result, is damaged, or shares no distance with the one in view.
    """
    result = wanted.result
    if known is None or known.path != wanted.path:
        opened = read_result(wanted.path, verify=False).result
        known = OtherResult(
            wanted.path, opened, DecoratedValues(opened), result, match_worlds(result.world, opened.world)
        )
        kept = None
    elif known.of is not result:
        match = match_worlds(result.world, known.result.world)
        known, kept = OtherResult(known.path, known.result, known.values, result, match), None
    distances = result.settings.column_distances
    if kept is None:
        there = known.values.decorate(known.result.field, wanted.coloring)
        kept = carried(known.match, there, known.result.settings.column_distances, distances)
    here = wanted.values.decorate(wanted.field, wanted.coloring)
    changes = changes_of(result.world, _column(wanted, here), _column(wanted, kept))
    return Compared(wanted, known, kept, changes)


def _column(wanted: Wanted, field: VertexField) -> Float32Array:
    if wanted.column < 0:
        return blend(field.ao, wanted.result.settings.column_distances, wanted.short_share)
    return np.asarray(field.ao[:, wanted.column])
