"""Makes the pictures of README.md and docs/editing.md: the sample level in the real window, and an edit of it.

    .ci/with-display .venv/bin/python docs/window_pictures.py [FOLDER]

FOLDER takes the pictures; without it they go beside this script. A copy of the level is baked at preview quality.
"""

from __future__ import annotations

import logging
import sys
import tempfile
from pathlib import Path

import numpy as np
from dark_spot_pictures import Walk
from PyQt6.QtCore import QEvent, QPointF, Qt
from PyQt6.QtGui import QMouseEvent

from app.compare_panel import CompareMode
from app.parts.comparison import PANEL as COMPARISON
from app.parts.comparison import ComparisonPart
from app.parts.placing import PlacingPart
from app.parts.rebake import RebakePart
from app.region_flight import looking
from app.style import apply_scheme
from viewer.gizmo import Motion

PROP = "Level/Yard/Crate_04"
HOUSE, FROM_HOUSE = np.array((3.0, 1.0, 0.0)), np.array((17.0, 13.0, 21.0))
YARD, FROM_YARD = np.array((18.6, 0.2, 6.4)), np.array((-1.5, 3.2, 5.2))
MOTION = Motion((0.4, 0.0, 1.2))


def fly(walk: Walk, point: np.ndarray, offset: np.ndarray) -> None:
    """Looks at a place from beside it; metres of the scene."""
    document, main = walk.window.document, walk.window.area.main
    assert document.world is not None
    target = point - document.world.origin
    main.navigation.fly_to(looking(main.camera, target + offset, target))
    walk.rest(1.5)


def brush(walk: Walk, way: list[tuple[float, float]]) -> None:
    """Paints over triangles, along places given as shares of the picture."""
    view, left = walk.window.area.main.view, Qt.MouseButton.LeftButton
    points = [QPointF(x * view.width(), y * view.height()) for x, y in way]
    walk.act("faces-brush")
    for kind, point, signal in (
        (QEvent.Type.MouseButtonPress, points[0], view.mouse_pressed),
        *((QEvent.Type.MouseMove, point, view.mouse_moved) for point in points[1:]),
        (QEvent.Type.MouseButtonRelease, points[-1], view.mouse_released),
    ):
        signal.emit(QMouseEvent(kind, point, point, left, left, Qt.KeyboardModifier.NoModifier))
    walk.until(lambda: not walk.window.bench.jobs.is_busy)


def main(folder: Path) -> None:
    """Looks at the level, moves a crate, rebakes, compares."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="obscura-") as work:
        walk = Walk(folder, Path(work), "")
        window, document = walk.window, walk.window.document
        assert document.world is not None and document.result is not None
        apply_scheme("dark")
        fly(walk, HOUSE, FROM_HOUSE)
        walk.click()
        document.select(-1)
        walk.keep("window")
        apply_scheme("light")
        window.readouts.click(None)
        walk.act("layout-edit")
        fly(walk, YARD, FROM_YARD)
        document.select(document.world.object_paths.index(PROP))
        walk.until(lambda: document.current is not None and document.current.scene is not None)
        walk.act("move-tool")
        window.part(PlacingPart).place_by(MOTION)
        walk.until(lambda: document.current is not None and PROP in document.current.stale)
        walk.keep("editing-1-moved")
        walk.act("move-tool")
        window.panels.bake.form.set_settings(document.result.settings)
        window.bench.show_panel("Rebake")
        ended: list[object] = []
        window.controller.bake_ended.connect(ended.append)
        walk.act("rebake")
        walk.until(lambda: bool(ended) and window.controller.is_idle)
        document.select(-1)
        brush(walk, [(0.30 + 0.03 * step, 0.62 + 0.012 * step) for step in range(12)])
        walk.keep("editing-2-triangles")
        walk.act("faces-none")
        walk.act("cancel")
        walk.act("layer-compare")
        comparison = window.part(ComparisonPart)
        walk.until(lambda: comparison.compared is not None)
        window.bench.show_panel(COMPARISON)
        comparison.set_mode(CompareMode.DIFFERENCE)
        assert window.part(RebakePart).panel.layers.rows.rowCount()
        walk.keep("editing-3-compared")
        window.close()


if __name__ == "__main__":
    logging.basicConfig(level=logging.INFO)
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parent)
