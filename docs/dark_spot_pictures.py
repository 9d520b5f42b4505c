"""Makes the pictures of docs/dark-spot.md: mends one planted dark spot of the sample level in the real window.

    .ci/with-display .venv/bin/python docs/dark_spot_pictures.py [FOLDER]

FOLDER takes the pictures; without it they go beside this script. The level is copied first, so that nothing is written
beside it, and baked at preview quality, twice.
"""

from __future__ import annotations

import json
import logging
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
import pyvistaqt  # noqa: F401 - sets the OpenGL format before any window
from PyQt6.QtCore import QEvent, QPointF, QSettings, Qt
from PyQt6.QtGui import QGuiApplication, QMouseEvent
from PyQt6.QtWidgets import QApplication, QPushButton

from app.compare_panel import CompareMode
from app.document import default_result_folder
from app.parts.comparison import PANEL as COMPARISON
from app.parts.comparison import ComparisonPart
from app.parts.explain import ExplainPart
from app.region_flight import looking
from app.style import application
from app.window import Window
from bake.explain.preview import Preview
from bake.pipeline import BakeRequest, run_bake
from viewer.fields import Quantity

LEVEL = Path(__file__).resolve().parents[1] / "assets" / "sample_level"
PLANTED = "8_enclosing_shell"
CULPRIT = "Shell"
FROM = np.array([1.0, 1.0, 3.2])
"""Where the camera stands, in metres from the spot."""
QUALITY = {"quality": "preview", "region-directions": "64"}
SIZE = (1280, 800)
PATIENCE_S = 600.0
COLOURS = 256

logger = logging.getLogger(__name__)


class Walk:
    """A window over a copy of the sample level, and its pictures."""

    def __init__(self, folder: Path, work: Path, prefix: str = "dark-spot-") -> None:
        self.app, self.folder, self.prefix = application(), folder, prefix
        self.scene = work / "level.glb"
        for name in ("level.glb", "level.glb.obscura.toml"):
            shutil.copy(LEVEL / name, work / name)
        for _ in run_bake(BakeRequest(self.scene, default_result_folder(self.scene, work), QUALITY)):
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
        end = time.perf_counter() + PATIENCE_S
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
        path = self.folder / f"{self.prefix}{name}.png"
        screen.grabWindow(self.window.winId()).save(str(path))
        few = Image.open(path).convert("RGB").quantize(COLOURS, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
        few.save(path, optimize=True)

    def show_distance(self, column: int) -> None:
        """Shows AO at one of the distances."""
        document = self.window.document
        document.set_display(document.display.replaced(quantity=Quantity.DISTANCE, column=column))

    def look_at_spot(self) -> None:
        """Selects the object with the planted spot and flies to it."""
        spots = json.loads((LEVEL / "planted.json").read_text())["spots"]
        spot = next(item for item in spots if item["label"] == PLANTED)
        document, main = self.window.document, self.window.area.main
        assert document.world is not None
        document.select(document.world.object_paths.index(spot["object"]))
        point = np.array(spot["position"]) - document.world.origin
        main.navigation.fly_to(looking(main.camera, point + FROM, point))
        self.rest(1.5)

    def click(self) -> None:
        """Clicks in the middle of the view."""
        view = self.window.area.main.view
        place = QPointF(view.width() / 2.0, view.height() / 2.0)
        for kind, held in (
            (QEvent.Type.MouseButtonPress, Qt.MouseButton.LeftButton),
            (QEvent.Type.MouseButtonRelease, Qt.MouseButton.NoButton),
        ):
            left, none = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
            QApplication.sendEvent(view, QMouseEvent(kind, place, view.mapToGlobal(place), left, held, none))
        self.rest(0.3)

    def explain(self) -> None:
        """Explains the clicked point."""
        part, world = self.window.part(ExplainPart), self.window.document.world
        self.act("explain")
        self.until(lambda: part.explained is not None)
        assert part.explained is not None and world is not None
        explanation = part.explained.explanation
        causes = ", ".join(f"{cause.kind.heading} {cause.confidence:.2f}" for cause in part.explained.causes)
        path = world.object_paths[explanation.spot.object]
        place = (explanation.spot.position + world.origin).round(2)
        logger.info("%s at %s: AO %s; %s", path, place, explanation.value.round(3), causes)

    def point_at_culprit(self) -> None:
        """Asks for the value without the occluder that the level's author forgot."""
        panel = self.window.part(ExplainPart).panel
        proxy = panel.view.proxy
        texts = [str(proxy.index(row, 0).data()) for row in range(proxy.rowCount())]
        panel.view.entered.emit(proxy.index(texts.index(CULPRIT), 0))
        self.until(lambda: "→" in panel._without.text())
        logger.info("%s", panel._without.text())

    def preview(self) -> tuple[QPushButton, QPushButton]:
        """Previews the first remedy of the likeliest cause; its two buttons."""
        part = self.window.part(ExplainPart)
        row, seen = part.panel.causes._cards[0]._rows[0], list[Preview]()
        part.live.previewed.connect(seen.append)
        row._preview.click()
        self.until(lambda: bool(seen))
        part.live.previewed.disconnect(seen.append)
        logger.info("%s: %s -> %s", row._remedy.text, seen[0].before.round(3), seen[0].after.round(3))
        return row._preview, row._apply

    def bake(self) -> None:
        """Bakes again and waits for the result."""
        ended: list[object] = []
        self.window.controller.bake_ended.connect(ended.append)
        self.act("bake")
        self.until(lambda: bool(ended) and self.window.controller.is_idle)


def main(folder: Path) -> None:
    """Walks through the spot."""
    with tempfile.TemporaryDirectory(prefix="obscura-") as work:
        walk = Walk(folder, Path(work))
        window = walk.window
        walk.act("back-faces")  # as the game draws them: not at all
        walk.show_distance(0)
        walk.look_at_spot()
        walk.click()
        walk.keep("1-found")
        walk.explain()
        walk.keep("2-explained")
        walk.point_at_culprit()
        walk.keep("3-without")
        preview, apply = walk.preview()
        window.docks["Explain"].widget().ensureWidgetVisible(preview)  # type: ignore[union-attr]
        walk.keep("4-preview")
        side_file = walk.scene.with_name(walk.scene.name + ".obscura.toml")
        before = side_file.read_text()
        apply.click()
        walk.until(lambda: side_file.read_text() != before and window.controller.is_idle)
        walk.bake()
        comparison = window.part(ComparisonPart)
        walk.act("compare-before")
        walk.until(lambda: comparison.compared is not None)
        window.bench.show_panel(COMPARISON)
        comparison.set_mode(CompareMode.SIDE)
        panel = window.part(ExplainPart).panel
        panel.rays.setChecked(False)
        panel.samples.setChecked(False)
        window.document.select(-1)
        walk.rest(1.0)
        walk.keep("5-compared")
        window.close()


if __name__ == "__main__":
    logging.basicConfig(level=logging.INFO)
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parent)
