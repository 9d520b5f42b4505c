"""The part of a mapping that only depends on the world: it can be made while other stages run."""

from __future__ import annotations

from dataclasses import dataclass

from bake.settings import BakeSettings, MappingKind
from bake.solve.receivers import Receivers, find_receivers
from bake.solve.surface import Surface, build_surface
from bake.types import World


@dataclass(frozen=True, slots=True)
class MappingAhead:
    """One of the two, whichever the mapping needs.

    Attributes:
        receivers: For the weighted average.
        surface: For least squares.
    """

    receivers: Receivers | None = None
    surface: Surface | None = None


def map_ahead(world: World, settings: BakeSettings) -> MappingAhead:
    """Welds the vertices of a world, and finds what else its mapping needs.

    Args:
        world: The flattened scene.
        settings: `mapping`, `weld_instances` and `crease_angle` matter.
    """
    if settings.mapping is MappingKind.AVERAGE:
        return MappingAhead(receivers=find_receivers(world, settings))
    surface = build_surface(world, crease_angle=settings.crease_angle, weld_instances=settings.weld_instances)
    return MappingAhead(surface=surface)
