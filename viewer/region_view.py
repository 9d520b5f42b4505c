"""What of a result's regions is shown: one frozen value that the panel edits and the presenter draws."""

from __future__ import annotations

import dataclasses
import enum
import math
from dataclasses import dataclass


class RegionColor(enum.StrEnum):
    """What colours the boxes of regions."""

    ERROR = "error"
    MISMATCH = "mismatch"
    VALID = "valid"
    MEMORY = "memory"
    TERMS = "terms"
    CENTRE = "centre"


class PointSet(enum.StrEnum):
    """Whose grid points are drawn."""

    NONE = "none"
    SELECTED = "selected"
    ALL = "all"


@dataclass(frozen=True, slots=True)
class RegionView:
    """What the user chose to see.

    Attributes:
        boxes: What colours the boxes; None: they are not drawn.
        links: Whether links are drawn, coloured by their mismatch.
        points: Whose grid points are drawn.
        centres: Whether the centres of the models are drawn.
        models: Whether a small sphere, lit by its model, is drawn at the centre of each.
        deformed: Spheres have the AO as radius and a colour map, rather than being lit as a surface would be.
        through_walls: Whether boxes, links, points and centres are drawn in front of the surface.
        as_fitted: Models and mismatch before regularisation rather than after it.
        column: Distance at which models are evaluated.
        region: The selected region; -1 for none.
        link: The selected boundary; -1 for none.
        probe: Where a model is evaluated, metres from the world's origin; None for no probe.
        probe_region: The region whose model the probe evaluates; -1 for the one that it lies in.
        azimuth, elevation: The normal that the probe's needle shows, degrees; azimuth 0 is the axis after the up axis.
        probe_size: Radius of the probe's sphere where AO is 1, in metres.
    """

    boxes: RegionColor | None = None
    links: bool = False
    points: PointSet = PointSet.NONE
    centres: bool = False
    models: bool = False
    deformed: bool = False
    through_walls: bool = False
    as_fitted: bool = False
    column: int = 0
    region: int = -1
    link: int = -1
    probe: tuple[float, float, float] | None = None
    probe_region: int = -1
    azimuth: float = 0.0
    elevation: float = 90.0
    probe_size: float = 0.5

    def normal(self, up_axis: int) -> tuple[float, float, float]:
        """The normal of the probe's needle, unit."""
        azimuth, elevation = math.radians(self.azimuth), math.radians(self.elevation)
        vector = [0.0, 0.0, 0.0]
        vector[up_axis] = math.sin(elevation)
        vector[(up_axis + 1) % 3] = math.cos(elevation) * math.cos(azimuth)
        vector[(up_axis + 2) % 3] = math.cos(elevation) * math.sin(azimuth)
        return vector[0], vector[1], vector[2]

    @property
    def draws_nothing(self) -> bool:
        """Whether no mark at all is asked for."""
        return (
            self.boxes is None
            and not self.links
            and self.points is PointSet.NONE
            and not self.centres
            and not self.models
            and self.region < 0
            and self.link < 0
            and self.probe is None
        )

    def replaced(self, **changes: object) -> RegionView:
        """A copy with some choices changed."""
        return dataclasses.replace(self, **changes)  # type: ignore[arg-type]
