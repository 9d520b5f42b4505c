"""The parts of the window, in the order in which their panels and actions stand."""

from __future__ import annotations

from app.parts.availability import AvailabilityPart
from app.parts.baking import BakingPart
from app.parts.command_lines import CommandLinesPart
from app.parts.comparison import ComparisonPart
from app.parts.decorators import DecoratorsPart
from app.parts.edit import EditPart
from app.parts.explain import ExplainPart
from app.parts.export import ExportPart
from app.parts.faces import FacesPart
from app.parts.files import FilesPart
from app.parts.habits import HabitsPart
from app.parts.help import HelpPart
from app.parts.hints import HintsPart
from app.parts.history import HistoryPart
from app.parts.inspections import InspectionsPart
from app.parts.layers import LayersPart
from app.parts.layouts import LayoutsPart
from app.parts.panels import PanelsPart
from app.parts.placing import PlacingPart
from app.parts.rebake import RebakePart
from app.parts.results_history import ResultsHistoryPart
from app.parts.review import ReviewPart
from app.parts.runtime import RuntimePart
from app.parts.scene_edits import SceneEditsPart
from app.parts.scene_watch import SceneWatchPart
from app.parts.selections import SelectionsPart
from app.parts.session import SessionPart
from app.parts.spots import SpotsPart
from app.parts.views import ViewsPart
from app.region_part import RegionsPart
from app.walk_part import WalkPart
from app.window_parts import Part

PARTS: tuple[type[Part], ...] = (
    FilesPart,
    ExportPart,
    ReviewPart,
    EditPart,
    PanelsPart,
    HistoryPart,
    SelectionsPart,
    SceneEditsPart,
    SceneWatchPart,
    PlacingPart,
    ResultsHistoryPart,
    ViewsPart,
    DecoratorsPart,
    InspectionsPart,
    RuntimePart,
    SpotsPart,
    ComparisonPart,
    ExplainPart,
    BakingPart,
    CommandLinesPart,
    RegionsPart,
    WalkPart,
    RebakePart,
    LayersPart,
    FacesPart,
    LayoutsPart,
    HabitsPart,
    HelpPart,
    HintsPart,
    SessionPart,
    AvailabilityPart,
)
