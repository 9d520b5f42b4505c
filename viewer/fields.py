"""Values on a surface, ready to be coloured: which numbers, their unit, their range and their colour map."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bake.types import Float32Array, UInt8Array, VertexField, VertexState
from viewer.colormaps import BLUE_WHITE_ORANGE, GREY, NOT_BAKED_COLOR, ColorMap
from viewer.tone import RemapCurve, blend


class Quantity(enum.StrEnum):
    """What is shown on the surface."""

    GEOMETRY = "geometry"
    DISTANCE = "distance"
    BLEND = "blend"
    DIFFERENCE = "difference"
    INSPECTION = "inspection"


@dataclass(frozen=True, slots=True)
class SurfaceField:
    """One number a vertex.

    Attributes:
        title: Name for people, with its distance.
        values: Shape (n,), float32; NaN where there is none.
        not_baked: Shape (n,), bool: has no value because of its object's role.
        low, high: The range to start from.
        color_map: The map to start from.
        unit: Unit of the values, empty for AO.
        inspected: It is no AO: the map is its own, and so is its range.
        rgb: Shape (n, 3), uint8: colours instead of values, which are then empty.
        swatches: What those colours mean.
    """

    title: str
    values: Float32Array
    not_baked: np.ndarray
    low: float = 0.0
    high: float = 1.0
    color_map: ColorMap = GREY
    unit: str = ""
    inspected: bool = False
    rgb: UInt8Array | None = None
    swatches: tuple[tuple[tuple[int, int, int], str], ...] = ()

    def colors(self, color_map: ColorMap, low: float, high: float, relief: Float32Array | None = None) -> UInt8Array:
        """Vertex colours, shape (n, 3), uint8: magenta where a value is missing, slate where none is due.

        Args:
            color_map: For the values.
            low, high: Ends of the map.
            relief: Shape (n,), in [0, 1]: brightness of the slate, so that shapes without values can be read.
        """
        if self.rgb is not None:
            return self.rgb
        colors = color_map.colors(self.values, low, high)
        slate = np.array(NOT_BAKED_COLOR, np.float32)
        if relief is None:
            colors[self.not_baked] = NOT_BAKED_COLOR
        else:
            colors[self.not_baked] = (relief[self.not_baked, None] * slate).astype(np.uint8)
        return colors

    @property
    def missing_count(self) -> int:
        """Vertices without a value that should have one."""
        return 0 if self.rgb is not None else int(np.count_nonzero(np.isnan(self.values) & ~self.not_baked))


@dataclass(frozen=True, slots=True)
class Scale:
    """What the colours of marks mean.

    Attributes:
        title: Name for people.
        color_map: None where there are only swatches.
        low, high: Ends of the map.
        unit: Unit of the ends, empty for AO.
        note: A second line.
        swatches: Colours with a meaning of their own.
    """

    title: str
    color_map: ColorMap | None = None
    low: float = 0.0
    high: float = 1.0
    unit: str = ""
    note: str = ""
    swatches: tuple[tuple[tuple[int, int, int], str], ...] = ()


def relief_of(normals: Float32Array) -> Float32Array:
    """Brightness under a fixed light, shape (n,), in [0.5, 1], for surfaces that have nothing else to show."""
    x, y, z = np.asarray(normals, np.float32).T
    facing = np.float32(0.45) * x + np.float32(0.75) * y + np.float32(0.48) * z  # `@` would first start its threads
    np.clip(facing, -1.0, 1.0, out=facing)
    return np.float32(0.75) + np.float32(0.25) * facing


def distance_label(metres: float) -> str:
    """A distance for labels: `2 m`, `300 m`, `0.25 m`, `1.5 km`."""
    return f"{metres / 1000:g} km" if metres >= 1000 else f"{metres:g} m"


def distance_field(field: VertexField, distances: Sequence[float], column: int) -> SurfaceField:
    """AO at one of the baked distances."""
    return SurfaceField(
        title=f"AO at {distance_label(distances[column])}",
        values=np.ascontiguousarray(field.ao[:, column], np.float32),
        not_baked=_not_baked(field),
    )


def blended_field(
    field: VertexField, distances: Sequence[float], short_share: float, curve: RemapCurve
) -> SurfaceField:
    """AO as the level mixes its longest and shortest distance, after the artist's curve."""
    title = "AO, blended" if curve.is_identity else "AO, blended and remapped"
    return SurfaceField(title, curve(blend(field.ao, distances, short_share)), _not_baked(field))


def difference_field(
    minuend: VertexField, subtrahend: VertexField, distances: Sequence[float], column: int
) -> SurfaceField:
    """Signed difference of two fields over the same vertices at one distance; the range is symmetric."""
    values = (minuend.ao[:, column] - subtrahend.ao[:, column]).astype(np.float32)
    known = np.abs(values[np.isfinite(values)])
    reach = max(float(np.quantile(known, 0.999)), 1e-3) if len(known) else 1.0
    return SurfaceField(
        title=f"Difference at {distance_label(distances[column])}",
        values=values,
        not_baked=_not_baked(minuend) | _not_baked(subtrahend),
        low=-reach,
        high=reach,
        color_map=BLUE_WHITE_ORANGE,
    )


def _not_baked(field: VertexField) -> np.ndarray:
    return np.asarray(field.state) == VertexState.NOT_BAKED
