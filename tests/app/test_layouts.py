"""Layouts of the panels: presets, the user's own, and what survives a session."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from PyQt6.QtCore import QByteArray, QSettings
from PyQt6.QtWidgets import QInputDialog
from pytestqt.qtbot import QtBot
from settling import settle

from app.layout_dialog import LayoutDialog
from app.layouts import LAYOUT_VERSION, PRESETS, SavedLayouts, preset_panels
from app.parts.layouts import LayoutsPart
from app.window import Window

gui = pytest.mark.gui


def _shown(window: Window) -> set[str]:
    return {title for title, dock in window.docks.items() if not dock.isHidden()}


@gui
@pytest.mark.parametrize("preset", PRESETS, ids=lambda preset: preset.name)
def test_presets_show_their_panels(window: Window, preset: object) -> None:
    """Each preset shows what it names and nothing else, with its first panels in front."""
    found = next(item for item in PRESETS if item is preset)
    window.actions_by_id[f"layout-{found.name.lower()}"].trigger()
    settle()
    assert _shown(window) == preset_panels(found, window.docks)
    assert _shown(window)
    leader = next(title for title in found.front if title in window.docks)
    assert window.docks[leader].isVisible()


@gui
def test_every_panel_has_a_preset(window: Window) -> None:
    """No panel is left out of all presets."""
    shown = set().union(*(preset_panels(preset, window.docks) for preset in PRESETS))
    assert shown == set(window.docks)


@gui
def test_own_layouts_are_saved_used_renamed_and_deleted(window: Window, qtbot: QtBot) -> None:
    """A saved layout is an action like any other, by whatever name it has at the time."""
    part = window.part(LayoutsPart)
    for title in ("Log", "Marks"):
        window.docks[title].hide()
    expected = _shown(window)
    window.actions_by_id["layout-save"].trigger()
    dialog = window.findChild(QInputDialog)
    assert dialog is not None
    dialog.setTextValue("Mine & yours")
    dialog.accept()
    assert part.saved.names() == ["Mine & yours"]
    window.actions_by_id["reset-layout"].trigger()
    assert _shown(window) != expected
    window.actions_by_id["layout:Mine & yours"].trigger()
    assert _shown(window) == expected
    window.actions_by_id["layout-manage"].trigger()
    manager = window.findChild(LayoutDialog)
    assert manager is not None
    item = manager.list.item(0)
    assert item is not None
    item.setText("Ours")
    assert part.saved.names() == ["Ours"]
    assert "layout:Ours" in window.actions_by_id
    assert "layout:Mine & yours" not in window.actions_by_id
    manager._delete.click()
    assert part.saved.names() == []
    assert "layout:Ours" not in window.actions_by_id
    manager.close()


@gui
def test_a_layout_of_another_version_is_left_alone(make_window: Callable[..., Window], store: QSettings) -> None:
    """What an older window stored does not disturb the panels of this one."""
    first = make_window()
    usual = _shown(first)
    first.docks["Log"].hide()
    state = first.saveState(LAYOUT_VERSION - 1)
    first.close()
    store.setValue("window/state", state)
    assert _shown(make_window()) == usual


def test_saved_layouts_survive_odd_names(store: QSettings) -> None:
    """Names with slashes and signs are names like any others; what is no layout is passed over."""
    layouts = SavedLayouts(store)
    for name in ("a/b", "ü & =", "100 %"):
        layouts.save(name, QByteArray(name.encode()))
    again = SavedLayouts(QSettings(store.fileName(), QSettings.Format.IniFormat))
    store.sync()
    assert again.names() == sorted(["a/b", "ü & =", "100 %"])
    assert layouts.state("a/b") == QByteArray(b"a/b")
    layouts.rename("a/b", "c")
    assert layouts.state("c") == QByteArray(b"a/b")
    store.setValue("layouts/saved", "nonsense")
    assert layouts.names() == []
