"""How a result is shown: one frozen value that the panels edit and the viewports draw."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from bake.types import BakeResult, VertexField
from viewer.colormaps import ColorMap, color_map_named
from viewer.fields import Quantity, SurfaceField, blended_field, difference_field, distance_field
from viewer.inspections import Inspection
from viewer.runtime_light import ambient_map
from viewer.tone import SHORT_SHARE, RemapCurve


@dataclass(frozen=True, slots=True)
class Display:
    """What the user chose to see.

    Attributes:
        quantity: What is shown on the surface.
        inspection: What is looked at besides AO, for `Quantity.INSPECTION`.
        inspected_range: Range of the map for it; None: its own.
        column: Which distance, for `Quantity.DISTANCE` and `Quantity.DIFFERENCE`.
        short_share: Weight of the shortest distance in the blend, in [0, 1].
        curve: Remap curve of the blend.
        game: Draw it as the game stores it: 5 bits with dither.
        hour: Time of day for which AO dims the ambient light of a neutral surface; None: values by the map.
        color_map: Name of the map for values; differences have their own.
        low, high: Range of the map for AO; None: the quantity's own, which is [0, 1].
        difference_range: Reach of the map for differences, to both sides; None: the field's own.
        shading: Whether a headlight shapes the surface; without it colours are exact.
        edges: Whether edges are drawn.
        back_faces: Whether faces seen from behind are drawn.
    """

    quantity: Quantity = Quantity.BLEND
    inspection: Inspection = Inspection.RESIDUAL
    inspected_range: tuple[float, float] | None = None
    column: int = 0
    short_share: float = SHORT_SHARE
    curve: RemapCurve = RemapCurve()
    game: bool = False
    hour: float | None = None
    color_map: str = "grey"
    low: float | None = None
    high: float | None = None
    difference_range: float | None = None
    shading: bool = False
    edges: bool = False
    back_faces: bool = True

    def replaced(self, **changes: object) -> Display:
        """A copy with some choices changed."""
        return dataclasses.replace(self, **changes)  # type: ignore[arg-type]

    def map_for(self, field: SurfaceField) -> ColorMap:
        """The colour map to draw a field with."""
        if field.color_map.diverging or field.inspected:
            return field.color_map
        return color_map_named(self.color_map) if self.hour is None else ambient_map(self.hour)

    def range_for(self, field: SurfaceField) -> tuple[float, float]:
        """The ends of the map for a field."""
        if field.inspected:
            return (field.low, field.high) if self.inspected_range is None else self.inspected_range
        if field.color_map.diverging:
            reach = field.high if self.difference_range is None else self.difference_range
            return -reach, reach
        if self.hour is not None:
            return 0.0, 1.0
        low = field.low if self.low is None else self.low
        high = field.high if self.high is None else self.high
        return low, high

    def with_range(self, field: SurfaceField, low: float | None, high: float | None) -> Display:
        """A copy with another range for this kind of field; None goes back to the field's own."""
        if field.inspected:
            return self.replaced(inspected_range=None if low is None or high is None else (low, high))
        if field.color_map.diverging:
            reach = None if low is None or high is None else max(abs(low), abs(high), 1e-4)
            return self.replaced(difference_range=reach)
        return self.replaced(low=low, high=high)


def shown_field(
    display: Display, result: BakeResult, field: VertexField, other: VertexField | None = None
) -> SurfaceField | None:
    """The numbers that a display asks for.

    Args:
        display: What is asked for.
        result: The bake, for its distances.
        field: The vertex values in view: the bake's, or those of a changed threshold.
        other: Values of the other mapping, for differences (least squares minus average).

    Returns:
        None for plain geometry, where a difference has nothing to compare with, and for inspections, which
        `viewer.inspections` makes.
    """
    distances = result.settings.column_distances
    column = min(display.column, len(distances) - 1)
    if display.quantity is Quantity.DISTANCE:
        return distance_field(field, distances, column)
    if display.quantity is Quantity.BLEND:
        return blended_field(field, distances, display.short_share, display.curve)
    if display.quantity is Quantity.DIFFERENCE and other is not None:
        return difference_field(field, other, distances, column)
    return None
