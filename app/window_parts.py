"""What a window is made of: parts, each one concern in a file of its own, and the services that they share."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from PyQt6.QtCore import QSettings
from PyQt6.QtGui import QUndoStack
from PyQt6.QtWidgets import QDockWidget, QMainWindow, QMenu, QWidget

from app.action_registry import ActionRegistry
from app.actions import Action
from app.banner import Banner
from app.controller import Controller
from app.document import Document
from app.engine import Engine
from app.jobs import Jobs
from app.lazy_picker import LazyPicker
from app.panels import Panels
from app.progress_panel import ProgressPanel
from app.readouts import Readouts
from app.view_area import ViewArea
from app.view_presenter import ViewPresenter

AnyPart = TypeVar("AnyPart", bound="Part")


class Side(enum.Enum):
    """Where a dock stands at first."""

    LEFT = "left"
    RIGHT = "right"
    BOTTOM = "bottom"


@dataclass(frozen=True, slots=True)
class DockSpec:
    """A panel of a part.

    Attributes:
        title: What its tab says; also its stable name.
        widget: The panel.
        side: Where it stands at first, as a tab behind those that came before.
        scrolled: Whether it scrolls as a whole where there is no room for it.
        shown: Whether it is there before the user asks for it.
        seldom: Whether its tab stands behind those of its side that are used more.
    """

    title: str
    widget: QWidget
    side: Side
    scrolled: bool = False
    shown: bool = True
    seldom: bool = False


@dataclass(slots=True)
class Workbench:
    """What every part of a window may use.

    Attributes:
        window: Parent of dialogs and of whatever needs one.
        store: Habits that are kept between sessions.
        document: What is open.
        engine: Where bakes run.
        controller: Opens, bakes, cancels, solves again.
        jobs: Work off the window's thread that is no bake.
        picker: What a ray hits.
        area: The viewports.
        presenter: Draws the document into them.
        readouts: The hovered and the clicked point.
        panels: The panels that were always there.
        banner: Messages.
        progress: What runs.
        registry: All actions.
        undo: What can be undone.
        docks: Docks by title, once they are built.
        menus: Menus by name, once they are built.
        cache: Folder for the window's own files.
        parts: All parts, once they are made; see `part`.
    """

    window: QMainWindow
    store: QSettings
    document: Document
    engine: Engine
    controller: Controller
    jobs: Jobs
    picker: LazyPicker
    area: ViewArea
    presenter: ViewPresenter
    readouts: Readouts
    panels: Panels
    banner: Banner
    progress: ProgressPanel
    registry: ActionRegistry
    undo: QUndoStack
    docks: dict[str, QDockWidget]
    menus: dict[str, QMenu]
    cache: Path
    parts: list[Part]

    def part(self, kind: type[AnyPart]) -> AnyPart:
        """The window's part of a kind, for parts that use each other."""
        return next(part for part in self.parts if isinstance(part, kind))

    def show_panel(self, title: str) -> None:
        """Brings a panel to the front."""
        self.docks[title].show()
        self.docks[title].raise_()


class Part:
    """One concern of a window.

    The window makes its parts, then asks each for `docks` and `actions`, and when docks and menus stand calls `connect`
    of each; `close` before anything of the window is freed. A part that needs none of these leaves it as it is.
    """

    def __init__(self, bench: Workbench) -> None:
        self.bench = bench

    def docks(self) -> Sequence[DockSpec]:
        """The panels that it brings."""
        return ()

    def actions(self) -> Sequence[Action]:
        """What the user can do with it."""
        return ()

    def connect(self) -> None:
        """Starts to listen and to talk; docks, menus and the actions of all parts exist."""

    def escape(self) -> bool:
        """Stops what the Escape key stops, if there is anything; then nobody else hears of the key."""
        return False

    def close(self) -> None:
        """Ends what it has running; views and document are still there."""
