"""The workflow of a dark spot in the window: from a scene file to the fixed level, and the panel on the way."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PyQt6.QtCore import QEvent
from PyQt6.QtWidgets import QApplication, QPushButton
from pytestqt.qtbot import QtBot
from settling import settle

from app.compare_panel import CompareMode
from app.explain_panel import ExplainPanel
from app.parts.comparison import ComparisonPart
from app.parts.explain import ExplainPart
from app.parts.export import ExportPart
from app.parts.spots import SpotsPart
from app.window import Window
from bake.explain.cause_types import Remedy
from bake.explain.types import ShareKind
from viewer.picking import Pick

PATIENCE_MS = 180_000

pytestmark = pytest.mark.gui


def explain_next_spot(window: Window, qtbot: QtBot) -> None:
    """Steps to the next spot of the table and explains it, by the actions that have keys."""
    part = window.bench.part(ExplainPart)
    window.bench.registry["spot-next"].trigger()
    with qtbot.waitSignal(part.live.explained, timeout=PATIENCE_MS):
        window.bench.registry["explain"].trigger()
    settle()


def find_spots(window: Window, qtbot: QtBot) -> SpotsPart:
    """Opens the table of spots."""
    spots = window.bench.part(SpotsPart)
    window.bench.registry["spots"].trigger()
    qtbot.waitUntil(lambda: spots.spots is not None, timeout=PATIENCE_MS)
    return spots


def written_remedy(panel: ExplainPanel) -> tuple[Remedy, QPushButton, QPushButton] | None:
    """The first remedy in the panel that can be written, with its buttons."""
    for card in panel.causes._cards:
        for row in card._rows:
            if row._remedy.writes and row._remedy.objects:
                return row._remedy, row._preview, row._apply
    return None


def bake_again(window: Window, qtbot: QtBot) -> None:
    """Bakes by the action."""
    with qtbot.waitSignal(window.controller.bake_ended, timeout=PATIENCE_MS):
        window.bench.registry["bake"].trigger()
    qtbot.waitUntil(lambda: window.controller.is_idle and window.document.result is not None, timeout=PATIENCE_MS)
    settle()


def test_a_dark_spot_from_the_scene_to_the_fixed_level(
    make_window: Callable[..., Window], scene: Path, tmp_path: Path, qtbot: QtBot
) -> None:
    """Open, bake, table, click, explain, preview of a remedy, apply, bake, compare, undo, export."""
    window = make_window()
    window.controller.open(scene)
    qtbot.waitUntil(lambda: window.document.world is not None, timeout=PATIENCE_MS)
    bake_again(window, qtbot)
    window.picker.finish()
    spots, part = find_spots(window, qtbot), window.bench.part(ExplainPart)
    assert spots.spots is not None
    for _ in range(len(spots.spots)):
        explain_next_spot(window, qtbot)
        if (found := written_remedy(part.panel)) is not None:
            break
    else:
        pytest.fail("no spot of the small level has a remedy that can be written")
    remedy, preview, apply = found
    assert part.explained is not None
    spot = part.explained.explanation.spot
    before = part.explained.explanation.value

    with qtbot.waitSignal(part.live.previewed, timeout=PATIENCE_MS) as shown:
        preview.click()
    after = shown.args[0].after
    side_file = scene.with_name(scene.name + ".obscura.toml")
    assert not side_file.exists()
    apply.click()
    qtbot.waitUntil(side_file.exists, timeout=PATIENCE_MS)
    written = side_file.read_text()
    assert all(key in written for keys in remedy.objects.values() for key in keys)

    bake_again(window, qtbot)
    assert window.document.result is not None
    rebaked = window.document.result.field.ao
    known = np.isfinite(after)
    np.testing.assert_allclose((spot.weights @ rebaked[spot.vertices])[known], after[known], atol=1e-3)

    comparison = window.bench.part(ComparisonPart)
    window.bench.registry["compare-before"].trigger()
    qtbot.waitUntil(lambda: comparison.compared is not None, timeout=PATIENCE_MS)
    settle()
    assert window.document.other is not None
    np.testing.assert_allclose(spot.weights @ window.document.other.ao[spot.vertices], before, atol=1e-6)
    window.bench.registry["compare-difference"].trigger()
    assert comparison.mode is CompareMode.DIFFERENCE

    window.bench.undo.undo()
    qtbot.waitUntil(
        lambda: window.document.result is not None and window.document.result.field.ao is not rebaked,
        timeout=PATIENCE_MS,
    )
    np.testing.assert_allclose(spot.weights @ window.document.result.field.ao[spot.vertices], before, atol=1e-6)
    window.bench.undo.undo()
    qtbot.waitUntil(lambda: not side_file.exists() or side_file.read_text() != written, timeout=PATIENCE_MS)

    target = tmp_path / "level.npz"
    window.bench.part(ExportPart).export(target)
    qtbot.waitUntil(lambda: target.exists() and not window.bench.jobs.is_busy, timeout=PATIENCE_MS)
    with np.load(target, allow_pickle=False) as exported:
        assert any(exported[name].size == before.size * len(rebaked) for name in exported.files)


def test_the_panel_of_an_explanation(shown: Window, qtbot: QtBot) -> None:
    """Spots, shares, dome, values without an occluder here and on the whole surface, and clicks that follow."""
    spots, part, document = find_spots(shown, qtbot), shown.bench.part(ExplainPart), shown.document
    explain_next_spot(shown, qtbot)
    check_flight(shown, spots)
    check_filter(spots)
    check_shares(shown, part)
    check_dome(part.panel)

    panel = part.panel
    with qtbot.waitSignal(part.live.spot_without, timeout=PATIENCE_MS) as asked:
        hover_row(panel, 0)  # the real cursor may be elsewhere, and say so at any time
    assert np.all(asked.args[0].after >= asked.args[0].before - 0.05)
    panel.hover.rested.emit(-1)
    qtbot.waitUntil(lambda: not part.live.is_asked("without"), timeout=PATIENCE_MS)  # of the dome, and of the row
    panel.hover.rested.emit(panel.view.proxy.mapToSource(panel.view.proxy.index(0, 0)).row())
    qtbot.waitUntil(lambda: "→" in panel._without.text(), timeout=PATIENCE_MS)
    assert panel.occluder() == -1
    leave(panel)
    panel.hover.rested.emit(-1)
    assert "→" not in panel._without.text()

    panel.choose(asked.args[0].object)
    assert "→" in panel._without.text()
    with qtbot.waitSignal(part.live.surface_without, timeout=PATIENCE_MS):
        panel.surface.click()
    assert document.is_preview
    assert "did not cast" in document.field_note
    panel.surface.click()
    assert not document.is_preview

    assert document.world is not None
    x, y, z = document.world.positions[document.world.faces[0]].mean(axis=0)
    with qtbot.waitSignal(part.live.explained, timeout=PATIENCE_MS):
        shown.readouts.click(Pick(0, (1 / 3, 1 / 3, 1 / 3), (float(x), float(y), float(z)), 1.0))
    assert part.explained is not None
    assert part.explained.explanation.spot.face == 0
    shown.readouts.click(None)
    assert part.explained is None
    assert not panel.view.isVisibleTo(panel)
    assert not panel.dome.isVisibleTo(panel)


def check_flight(window: Window, part: SpotsPart) -> None:
    """A spot's object is selected, its vertex is the clicked point."""
    spots, world, pinned = part.spots, window.document.world, window.readouts.pinned
    assert spots is not None
    assert world is not None
    assert pinned is not None
    assert window.document.selected == int(spots.object[0])
    assert np.allclose(pinned.position, world.positions[int(spots.vertex[0])])


def check_filter(part: SpotsPart) -> None:
    """Only spots of the chosen cause stay."""
    assert part.spots is not None
    heading = part.spots.guess[0].heading
    part.table.cause.setCurrentText(heading)
    assert part.table.view.proxy.rowCount() == [kind.heading for kind in part.spots.guess].count(heading)
    part.table.cause.setCurrentIndex(0)
    assert part.table.view.proxy.rowCount() == len(part.spots)


def check_shares(window: Window, part: ExplainPart) -> None:
    """What the table lists adds up to 1 - AO; rays and samples are drawn."""
    assert part.explained is not None
    explanation = part.explained.explanation
    total = sum(float(share.share[0]) for share in explanation.shares)
    assert total == pytest.approx(1.0 - float(explanation.value[0]), abs=1e-4)
    main = window.area.main
    assert main._points["explained samples"].actor.GetVisibility()
    assert main._shapes["explained rays"].actor.GetVisibility()
    part.panel.rays.setChecked(False)
    assert not main._shapes["explained rays"].actor.GetVisibility()


def check_dome(panel: ExplainPanel) -> None:
    """The dome knows the ray under the cursor; a click chooses its occluder."""
    dome = panel.dome.dome
    assert dome is not None
    assert panel._explanation is not None
    named = {share.object for share in panel._explanation.shares if share.kind is ShareKind.OBJECT}
    assert {int(owner) for owner in dome.object} - {-1} <= named
    ray = int(np.flatnonzero(dome.object >= 0)[0])
    panel.dome._point_at(panel.dome.position_of(ray))
    assert panel.dome.owner_under_cursor >= 0
    panel.dome.occluder_clicked.emit(int(dome.object[ray]))
    assert panel.occluder() == int(dome.object[ray])
    panel.dome.occluder_clicked.emit(-1)
    assert panel.occluder() == -1


def hover_row(panel: ExplainPanel, row: int) -> None:
    """Rests the cursor on a row of the table."""
    panel.view.entered.emit(panel.view.proxy.index(row, 0))


def leave(panel: ExplainPanel) -> None:
    """Takes the cursor off the table."""
    viewport = panel.view.viewport()
    assert viewport is not None
    QApplication.sendEvent(viewport, QEvent(QEvent.Type.Leave))
