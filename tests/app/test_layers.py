"""Layers in the window: turned down by object, region and triangle, each a step; and rebakes with other settings."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from pytestqt.qtbot import QtBot
from region_bakes import OPTIONS, write_regions
from settling import settle

from app.document import default_result_folder
from app.parts.faces import FacesPart
from app.parts.placing import PlacingPart
from app.parts.rebake import RebakePart
from app.region_part import RegionsPart
from app.window import Window
from bake.pipeline import BakeRequest, run_bake
from bake.results import load_result
from viewer.gizmo import Motion

PATIENCE_MS = 180_000

pytestmark = pytest.mark.gui


@pytest.fixture
def layered(window: Window, qtbot: QtBot, scene: Path) -> tuple[Window, np.ndarray, np.ndarray]:
    """A window whose crate was moved and rebaked, with regions; the values before and after."""
    folder = default_result_folder(scene, window.bench.cache)
    folder.parent.mkdir(parents=True)
    write_regions(scene.parent)
    options = {**OPTIONS, "regions": str(scene.parent / "regions.json")}
    for _ in run_bake(BakeRequest(scene, folder, options)):
        pass
    window.controller.open(scene)
    document = window.document
    _wait(qtbot, lambda: document.result is not None)
    _settle(window, qtbot)
    assert document.result is not None
    before = np.array(document.result.field.ao)
    _select(window, "Crate")
    window.bench.show_panel("Object")
    _wait(qtbot, lambda: document.current is not None and document.current.scene is not None)
    window.part(PlacingPart).place_by(Motion((1.0, 0.0, 0.0)))
    _wait(qtbot, lambda: _stale(window) == {"Crate"})
    window.panels.bake.form.set_settings(document.result.settings)
    _do(window, qtbot, "rebake")
    return window, before, np.array(document.result.field.ao)


def _wait(qtbot: QtBot, condition: Callable[[], bool]) -> None:
    qtbot.waitUntil(condition, timeout=PATIENCE_MS)


def _settle(window: Window, qtbot: QtBot) -> None:
    for _ in range(2):
        _wait(qtbot, lambda: window.controller.is_idle and not window.bench.jobs.is_busy)
        settle()


def _select(window: Window, path: str) -> None:
    assert window.document.world is not None
    window.document.select(window.document.world.object_paths.index(path))


def _stale(window: Window) -> frozenset[str]:
    return frozenset() if window.document.current is None else window.document.current.stale


def _do(window: Window, qtbot: QtBot, name: str) -> None:
    qtbot.waitUntil(window.actions_by_id[name].isEnabled, timeout=PATIENCE_MS)
    with qtbot.waitSignal(window.controller.bake_ended, timeout=PATIENCE_MS) as ended:
        window.actions_by_id[name].trigger()
    assert ended.args == [True]
    _settle(window, qtbot)


def _values(window: Window) -> np.ndarray:
    """What is in view, after a look whether it is what is stored."""
    result, path = window.document.result, window.document.result_path
    assert result is not None
    assert path is not None
    np.testing.assert_array_equal(load_result(path, verify=True).field.ao, result.field.ao)
    return np.array(result.field.ao)


def _inside(window: Window, region: int) -> np.ndarray:
    """Vertices of the triangles whose middle lies in a region."""
    state, world = window.part(RegionsPart).state, window.document.world
    assert state.regions is not None
    assert world is not None
    middle = world.positions[world.faces].mean(axis=1)
    low, high = state.regions.graph.minimum[region], state.regions.graph.maximum[region]
    found = np.zeros(world.vertex_count, bool)
    found[world.faces[((middle >= low) & (middle <= high)).all(axis=1)]] = True
    return found


def test_a_layer_is_rejected_in_a_region(layered: tuple[Window, np.ndarray, np.ndarray], qtbot: QtBot) -> None:
    """What lies in it is as before and stale, the rest as it was; one step undoes it, and a rebake mends it."""
    window, before, after = layered
    state = window.part(RegionsPart).state
    assert state.regions is not None
    assert not window.actions_by_id["layer-reject-region"].isEnabled(), "no region is selected"
    changed = (np.abs(after - before) > 1.0 / 512.0).any(axis=1)
    counts = [int((changed & _inside(window, number)).sum()) for number in range(len(state.regions.graph))]
    region = int(np.argmax(counts))
    inside = _inside(window, region)
    assert counts[region] > 0
    state.set_view(state.view.replaced(region=region))
    _do(window, qtbot, "layer-reject-region")
    mixed = _values(window)
    np.testing.assert_array_equal(mixed[inside], before[inside])
    same_object = ~inside
    np.testing.assert_array_equal(mixed[same_object], after[same_object])
    assert _stale(window)
    assert window.bench.undo.undoText().endswith(f"in {state.regions.graph.names[region]}")
    window.actions_by_id["undo"].trigger()
    _settle(window, qtbot)
    np.testing.assert_array_equal(_values(window), after)
    window.actions_by_id["redo"].trigger()
    _settle(window, qtbot)
    np.testing.assert_array_equal(_values(window), mixed)
    _do(window, qtbot, "rebake")
    np.testing.assert_allclose(_values(window), after, atol=2.0 / 255.0)
    _wait(qtbot, lambda: not _stale(window))


def test_a_layer_is_kept_in_a_region_only(layered: tuple[Window, np.ndarray, np.ndarray], qtbot: QtBot) -> None:
    """Everything outside of it goes back to what it was."""
    window, before, after = layered
    state = window.part(RegionsPart).state
    assert state.regions is not None
    state.set_view(state.view.replaced(region=0))
    outside = np.zeros(len(after), bool)
    assert window.document.world is not None
    world = window.document.world
    middle = world.positions[world.faces].mean(axis=1)
    low, high = state.regions.graph.minimum[0], state.regions.graph.maximum[0]
    outside[world.faces[~((middle >= low) & (middle <= high)).all(axis=1)]] = True
    _do(window, qtbot, "layer-accept-region")
    mixed = _values(window)
    np.testing.assert_array_equal(mixed[outside], before[outside])
    np.testing.assert_array_equal(mixed[~outside], after[~outside])


def test_a_layer_is_rejected_for_chosen_triangles(layered: tuple[Window, np.ndarray, np.ndarray], qtbot: QtBot) -> None:
    """Some triangles of the ground get back what they had; the layer below is still there to compare with."""
    window, before, after = layered
    part, world = window.part(FacesPart), window.document.world
    assert world is not None
    ground = np.flatnonzero(world.face_object == world.object_paths.index("Ground"))
    changed = np.asarray((np.abs(after - before) > 1.0 / 512.0).any(axis=1))
    touched = changed[world.faces[ground]].any(axis=1)
    assert touched.any()
    chosen = np.zeros(world.face_count, bool)
    chosen[ground[touched]] = True
    part._set(chosen)
    _settle(window, qtbot)
    _do(window, qtbot, "layer-reject-triangles")
    corners = np.unique(world.faces[chosen])
    mixed = _values(window)
    np.testing.assert_array_equal(mixed[corners], before[corners])
    assert _stale(window) == {"Ground"}
    assert window.part(RebakePart).panel.layers.rows.rowCount() == 2
    window.actions_by_id["select-stale"].trigger()
    assert window.document.selection == (world.object_paths.index("Ground"),)


def test_nothing_to_reject_changes_nothing(layered: tuple[Window, np.ndarray, np.ndarray], qtbot: QtBot) -> None:
    """Where both have the same values the result stays, no step is made, and the window says so."""
    window, _, after = layered
    world = window.document.world
    assert world is not None
    part = window.part(FacesPart)
    part._set(np.zeros(world.face_count, bool))
    steps = window.bench.undo.count()
    window.part(FacesPart).bench.registry["faces-none"].trigger()
    from app.parts.layers import LayersPart, Some

    with qtbot.waitSignal(window.controller.bake_ended, timeout=PATIENCE_MS) as ended:
        window.part(LayersPart).reject(Some.FACES)
    assert ended.args == [False]
    _settle(window, qtbot)
    assert window.banner.isVisible()
    assert window.bench.undo.count() == steps
    np.testing.assert_array_equal(_values(window), after)


@pytest.mark.parametrize(
    ("option", "value"), [("rays", 32), ("samples_per_face", (6, 6)), ("alpha", 0.5), ("back_face_threshold", 0.0)]
)
def test_a_selection_is_rebaked_with_other_settings(opened: Window, qtbot: QtBot, option: str, value: object) -> None:
    """Only the selected object's values may change; all that keeps the former settings is stale; a step undoes it."""
    document = opened.document
    assert document.result is not None
    before, world = np.array(document.result.field.ao), document.result.world
    form = opened.panels.bake.form
    form.set_settings(document.result.settings)
    form.changed.emit()
    panel = opened.part(RebakePart).panel
    assert panel._settings.isHidden()
    form.set_settings(document.result.settings.replaced(**{option: value}))
    form.changed.emit()
    assert "Other settings" in panel._settings.text()
    _select(opened, "Crate")
    _do(opened, qtbot, "rebake-selection")
    after = _values(opened)
    assert document.result is not None
    assert getattr(document.result.settings, option) == value
    own = slice(*world.first_vertex[world.object_paths.index("Crate") : world.object_paths.index("Crate") + 2])
    rest = np.ones(len(after), bool)
    rest[own] = False
    np.testing.assert_array_equal(after[rest], before[rest])
    if option in ("rays", "samples_per_face", "alpha"):
        assert not np.array_equal(after[own], before[own])
    _wait(qtbot, lambda: "Ground" in _stale(opened))
    assert "Crate" not in _stale(opened)
    opened.actions_by_id["undo"].trigger()
    _settle(opened, qtbot)
    np.testing.assert_array_equal(_values(opened), before)
    _wait(qtbot, lambda: not _stale(opened))
