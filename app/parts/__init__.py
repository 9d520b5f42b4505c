"""The parts of the window, in the order in which their panels and actions stand."""

from __future__ import annotations

from app.parts.availability import AvailabilityPart
from app.parts.baking import BakingPart
from app.parts.edit import EditPart
from app.parts.files import FilesPart
from app.parts.habits import HabitsPart
from app.parts.help import HelpPart
from app.parts.panels import PanelsPart
from app.parts.views import ViewsPart
from app.region_part import RegionsPart
from app.window_parts import Part

PARTS: tuple[type[Part], ...] = (
    FilesPart,
    EditPart,
    PanelsPart,
    ViewsPart,
    BakingPart,
    RegionsPart,
    HabitsPart,
    HelpPart,
    AvailabilityPart,
)
