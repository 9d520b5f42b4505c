"""The workflow of a dark spot in the window: table, click, explanation, without an occluder, remedy, undo."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from pytestqt.qtbot import QtBot
from settling import settle
from small_level import bake_level

from app.cause_cards import _RemedyRow
from app.parts.explain import PANEL, ExplainPart
from app.parts.spots import SpotsPart
from app.window import Window
from bake.explain.cause_types import Remedy
from viewer.picking import Pick

PATIENCE_MS = 120_000

pytestmark = pytest.mark.gui


@pytest.fixture
def explained(shown: Window, qtbot: QtBot) -> Window:
    """A window that explains the gravest spot of the small level."""
    spots = shown.bench.part(SpotsPart)
    shown.bench.registry["spots"].trigger()
    qtbot.waitUntil(lambda: spots.spots is not None, timeout=PATIENCE_MS)
    shown.bench.registry["spot-next"].trigger()
    part = shown.bench.part(ExplainPart)
    with qtbot.waitSignal(part.live.explained, timeout=PATIENCE_MS):
        shown.bench.registry["explain"].trigger()
    return shown


def test_spots_are_listed_and_flown_to(explained: Window) -> None:
    """A spot's object is selected, its vertex is the clicked point, and the camera looks at it."""
    spots = explained.bench.part(SpotsPart)
    assert spots.spots is not None
    assert len(spots.spots) > 0
    assert explained.document.selected == int(spots.spots.object[0])
    pinned = explained.readouts.pinned
    assert pinned is not None
    vertex = int(spots.spots.vertex[0])
    assert explained.document.world is not None
    assert np.allclose(pinned.position, explained.document.world.positions[vertex])


def test_table_is_filtered_by_cause(explained: Window) -> None:
    """Only spots of the chosen cause stay."""
    part = explained.bench.part(SpotsPart)
    assert part.spots is not None
    heading = part.spots.guess[0].heading
    part.table.cause.setCurrentText(heading)
    assert part.table.view.proxy.rowCount() == [kind.heading for kind in part.spots.guess].count(heading)
    part.table.cause.setCurrentIndex(0)
    assert part.table.view.proxy.rowCount() == len(part.spots)


def test_shares_add_up_in_the_panel(explained: Window) -> None:
    """What the table lists adds up to 1 - AO; rays and samples are drawn."""
    part = explained.bench.part(ExplainPart)
    assert part.explained is not None
    explanation = part.explained.explanation
    total = sum(float(share.share[0]) for share in explanation.shares)
    assert total == pytest.approx(1.0 - float(explanation.value[0]), abs=1e-4)
    main = explained.area.main
    assert main._points["explained samples"].actor.GetVisibility()
    assert main._shapes["explained rays"].actor.GetVisibility()
    part.panel.rays.setChecked(False)
    assert not main._shapes["explained rays"].actor.GetVisibility()


def test_value_and_surface_without_an_occluder(explained: Window, qtbot: QtBot) -> None:
    """A chosen occluder's counterfactual appears at the spot, then on the whole surface, and goes again."""
    part, document = explained.bench.part(ExplainPart), explained.document
    with qtbot.waitSignal(part.live.spot_without, timeout=PATIENCE_MS) as asked:
        part.panel.view.selectRow(0)
    assert np.all(asked.args[0].after >= asked.args[0].before - 0.05)
    assert part.panel.surface.isVisibleTo(part.panel)
    with qtbot.waitSignal(part.live.surface_without, timeout=PATIENCE_MS):
        part.panel.surface.click()
    assert document.is_preview
    assert "did not cast" in document.field_note
    part.panel.surface.click()
    assert not document.is_preview


def test_every_click_is_explained_while_the_panel_is_open(explained: Window, qtbot: QtBot) -> None:
    """Clicking another point explains that one; letting go of it empties the panel."""
    part = explained.bench.part(ExplainPart)
    assert explained.document.world is not None
    world = explained.document.world
    corners = world.positions[world.faces[0]]
    x, y, z = corners.mean(axis=0)
    with qtbot.waitSignal(part.live.explained, timeout=PATIENCE_MS):
        explained.readouts.click(Pick(0, (1 / 3, 1 / 3, 1 / 3), (float(x), float(y), float(z)), 1.0))
    assert part.explained is not None
    assert part.explained.explanation.spot.face == 0
    explained.readouts.click(None)
    assert part.explained is None
    assert not part.panel.view.isVisibleTo(part.panel)


def test_a_remedy_is_previewed_applied_and_undone(
    make_window: Callable[..., Window], level: Path, tmp_path: Path, qtbot: QtBot
) -> None:
    """A preview says what the rebake would give; Apply writes the side file, Undo takes it back."""
    scene = tmp_path / "small.obj"
    shutil.copy(level, scene)
    folder = bake_level(scene, tmp_path / "result")
    window = make_window()
    window.controller.open(folder)
    qtbot.waitUntil(lambda: window.document.result is not None, timeout=PATIENCE_MS)
    window.picker.finish()
    settle()
    part = window.bench.part(ExplainPart)
    world = window.document.world
    assert world is not None
    window.bench.show_panel(PANEL)
    owner = world.object_paths.index("Room")
    face = int(world.first_face[owner])
    x, y, z = world.positions[world.faces[face]].mean(axis=0)
    with qtbot.waitSignal(part.live.explained, timeout=PATIENCE_MS):
        window.readouts.click(Pick(face, (1 / 3, 1 / 3, 1 / 3), (float(x), float(y), float(z)), 1.0))
    remedy = Remedy("two-sided", "Let both sides count.", {"Room": {"two_sided": True}})
    with qtbot.waitSignal(part.live.previewed, timeout=PATIENCE_MS) as shown:
        part.panel.causes.preview_asked.emit(remedy)
    assert np.isfinite(shown.args[0].after).all()
    row = _RemedyRow(remedy, part.panel.causes)
    row.set_preview(shown.args[0])
    assert "→" in row._outcome.text()
    side_file = tmp_path / "small.obj.obscura.toml"
    part.panel.causes.apply_asked.emit(remedy)
    qtbot.waitUntil(side_file.exists, timeout=PATIENCE_MS)
    assert "two_sided" in side_file.read_text()
    window.bench.undo.undo()
    qtbot.waitUntil(lambda: not side_file.exists() or "two_sided" not in side_file.read_text(), timeout=PATIENCE_MS)
