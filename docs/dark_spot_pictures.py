"""Makes the pictures of docs/dark-spot.md: walks through one dark spot in the real window, and keeps what it shows.

    .ci/with-display .venv/bin/python docs/dark_spot_pictures.py SCENE FOLDER [NUMBER] [quality]

SCENE is copied first, so that nothing is written beside it; FOLDER takes the pictures; NUMBER is the row of the spot in
the table, counted from 1 (without: the first that a remedy mends).
"""

from __future__ import annotations

import logging
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import pyvistaqt  # noqa: F401 - sets the OpenGL format before any window
from PyQt6.QtCore import QSettings
from PyQt6.QtGui import QGuiApplication
from PyQt6.QtWidgets import QApplication, QPushButton

from app.document import default_result_folder
from app.parts.comparison import PANEL as COMPARISON
from app.parts.comparison import ComparisonPart
from app.parts.explain import ExplainPart
from app.parts.spots import SpotsPart
from app.style import application
from app.window import Window
from bake.explain.preview import Preview
from bake.pipeline import BakeRequest, run_bake

SIZE = (1400, 900)
logger = logging.getLogger(__name__)
PATIENCE = 240.0
LIGHTER = 0.25
"""By how much a preview must be lighter to be worth a picture."""


class Walk:
    """A window over a copy of a scene, and its pictures."""

    def __init__(self, scene: Path, folder: Path, work: Path, quality: str) -> None:
        self.app, self.folder = application(), folder
        self.scene = work / scene.name
        for other in scene.parent.iterdir():
            if other.is_file():
                shutil.copy(other, work / other.name)
        for _ in run_bake(BakeRequest(self.scene, default_result_folder(self.scene, work), {"quality": quality})):
            pass
        habits = QSettings(str(work / "habits.ini"), QSettings.Format.IniFormat)
        habits.setValue("hints/dismissed", True)
        self.window = Window(work, habits)
        self.window.resize(*SIZE)
        self.window.show()
        self.window.controller.open(self.scene)
        self.until(lambda: self.window.document.result is not None and self.window.controller.is_idle)
        self.window.picker.finish()

    def rest(self, seconds: float) -> None:
        """Lets the window live for a while."""
        end = time.perf_counter() + seconds
        while time.perf_counter() < end:
            QApplication.processEvents()
            time.sleep(0.01)

    def until(self, done: Callable[[], bool]) -> None:
        """Lets the window live until something is so."""
        end = time.perf_counter() + PATIENCE
        while not done():
            self.rest(0.05)
            if time.perf_counter() > end:
                raise SystemExit("the window does not get there")

    def act(self, name: str) -> None:
        """Triggers an action."""
        self.window.bench.registry[name].trigger()
        self.rest(0.3)

    def keep(self, name: str) -> None:
        """Stores what is on the screen, in few colours."""
        from PIL import Image

        self.rest(2.0)
        screen = QGuiApplication.primaryScreen()
        assert screen is not None
        path = self.folder / f"dark-spot-{name}.png"
        screen.grabWindow(self.window.winId()).save(str(path))
        Image.open(path).convert("RGB").quantize(96, dither=Image.Dither.NONE).save(path, optimize=True)

    def explain(self) -> None:
        """Explains the next spot."""
        part = self.window.part(ExplainPart)
        former = part.explained
        self.act("spot-next")
        self.act("explain")
        self.until(lambda: part.explained is not None and part.explained is not former)
        assert part.explained is not None
        spot, world = part.explained.explanation.spot, self.window.document.world
        assert world is not None
        causes = ", ".join(f"{cause.kind.heading} {cause.confidence:.2f}" for cause in part.explained.causes[:3])
        value = part.explained.explanation.value.round(3).tolist()
        logger.info("%s at %s: AO %s; %s", world.object_paths[spot.object], spot.position.round(2), value, causes)

    def mending(self) -> tuple[QPushButton, QPushButton] | None:
        """The buttons of the first remedy shown whose preview is much lighter."""
        part = self.window.part(ExplainPart)
        seen: list[Preview] = []
        part.live.previewed.connect(seen.append)
        try:
            for card in part.panel.causes._cards:
                for row in card._rows:
                    if row._remedy.writes and row._remedy.objects:
                        count = len(seen)
                        row._preview.click()
                        self.until(lambda count=count: len(seen) > count)
                        gain = float(seen[-1].after[0] - seen[-1].before[0])
                        logger.info("%s: %+.3f", row._remedy.text, gain)
                        if gain > LIGHTER:
                            return row._preview, row._apply
            return None
        finally:
            part.live.previewed.disconnect(seen.append)


def main(scene: Path, folder: Path, number: int, quality: str) -> None:
    """Walks through the spot."""
    with tempfile.TemporaryDirectory() as work:
        walk = Walk(scene, folder, Path(work), quality)
        window, explain, spots = walk.window, walk.window.part(ExplainPart), walk.window.part(SpotsPart)
        walk.act("spots")
        walk.until(lambda: spots.spots is not None)
        walk.explain()
        buttons, row = None, 1
        while row < number or (number == 0 and (buttons := walk.mending()) is None):
            walk.explain()
            row += 1
        explain.panel.view.clearSelection()
        window.bench.registry["explain"].trigger()  # anew, without the preview
        walk.rest(1.0)
        explain.panel.rays.setChecked(False)
        explain.panel.samples.setChecked(False)
        window.bench.show_panel("Display")
        walk.keep("1-found")
        explain.panel.rays.setChecked(True)
        explain.panel.samples.setChecked(True)
        window.bench.show_panel("Explain")
        walk.keep("2-explained")
        explain.panel.view.entered.emit(explain.panel.view.proxy.index(0, 0))
        walk.until(lambda: "→" in explain.panel._without.text())
        walk.keep("3-without")
        buttons = walk.mending()
        if buttons is None:
            raise SystemExit("no remedy that can be written helps here")
        window.docks["Explain"].widget().ensureWidgetVisible(buttons[0])  # type: ignore[union-attr]
        walk.keep("4-preview")
        buttons[1].click()
        walk.until(walk.scene.with_name(walk.scene.name + ".obscura.toml").exists)
        baked: list[object] = []
        window.controller.bake_ended.connect(baked.append)
        walk.act("bake")
        walk.until(lambda: bool(baked) and window.controller.is_idle)
        walk.act("compare-before")
        walk.until(lambda: window.part(ComparisonPart).compared is not None)
        window.bench.show_panel(COMPARISON)
        walk.keep("5-compared")
        window.close()


if __name__ == "__main__":
    logging.basicConfig(level=logging.INFO)
    arguments = sys.argv[1:]
    main(
        Path(arguments[0]).resolve(),
        Path(arguments[1]),
        int(arguments[2]) if len(arguments) > 2 else 0,
        arguments[3] if len(arguments) > 3 else "preview",
    )
