"""The registry of actions, the palette over it and the editor of its shortcuts."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st
from PyQt6.QtCore import QSettings, Qt
from PyQt6.QtGui import QKeySequence
from PyQt6.QtTest import QTest
from pytestqt.qtbot import QtBot

from app.actions import ActionSpec
from app.command_palette import CommandPalette
from app.fuzzy import fuzzy_score
from app.parts.edit import EditPart
from app.shortcut_editor import ShortcutEditor
from app.window import Window

gui = pytest.mark.gui


def _palette(window: Window) -> CommandPalette:
    window.actions_by_id["palette"].trigger()
    return window.part(EditPart).palette


@given(st.text(min_size=1, max_size=12), st.data())
def test_letters_in_order_are_found(text: str, data: st.DataObject) -> None:
    """Any letters of a text, in their order, find it; a letter that it lacks never does."""
    picked = sorted(data.draw(st.sets(st.integers(0, len(text) - 1), max_size=5)))
    query = "".join(text[place] for place in picked)
    if len(query.lower()) == len(query) and len(text.lower()) == len(text):
        assert fuzzy_score(query, text) is not None
    assert fuzzy_score("\0", text.replace("\0", "")) is None


def test_beginnings_of_words_come_first() -> None:
    """What people abbreviate beats letters strewn about."""
    texts = ["Unstrapped", "Hide back faces", "Save picture", "Spots"]
    ranked = sorted(texts, key=lambda text: -(fuzzy_score("sp", text) or -99.0))
    assert set(ranked[:2]) == {"Save picture", "Spots"}


@gui
def test_palette_finds_runs_and_remembers(window: Window, qtbot: QtBot) -> None:
    """A few letters and Enter do it; what was used last stands first next time."""
    palette = _palette(window)
    assert set(palette.names()) == set(window.actions_by_id) - {"palette"}
    QTest.keyClicks(palette.field, "edg")
    assert palette.names()[0] == "edges"
    QTest.keyClick(palette.field, Qt.Key.Key_Return)
    assert window.document.display.edges
    assert not palette.isVisible()
    assert _palette(window).names()[0] == "edges"
    palette.hide()


@gui
def test_what_cannot_be_used_is_grey_with_the_reason(window: Window) -> None:
    """Without a result nothing can be saved, and the palette says why and does nothing."""
    palette = _palette(window)
    palette.field.setText("save result")
    assert palette.names()[0] == "save-result"
    index = palette.list.currentIndex()
    assert not index.flags() & Qt.ItemFlag.ItemIsEnabled
    assert window.bench.registry.why_disabled("save-result") == "bake first"
    palette.run_current()
    assert palette.isVisible()
    QTest.keyClick(palette.field, Qt.Key.Key_Escape)
    assert not palette.isVisible()


@gui
def test_arrows_walk_the_list(window: Window) -> None:
    """Up and Down move in the list while the field keeps the cursor, and stop at its ends."""
    palette = _palette(window)
    QTest.keyClick(palette.field, Qt.Key.Key_Up)
    assert palette.list.currentIndex().row() == 0
    QTest.keyClick(palette.field, Qt.Key.Key_Down)
    assert palette.list.currentIndex().row() == 1
    palette.field.setText("nothing is called this")
    assert palette.names() == []
    QTest.keyClick(palette.field, Qt.Key.Key_Return)
    palette.hide()


@gui
def test_actions_are_greyed_with_what_is_open(shown: Window) -> None:
    """A result makes its actions usable; a scene without trees has no tree models to compare."""
    registry = shown.bench.registry
    assert registry["save-result"].isEnabled()
    assert registry["compare"].isEnabled()
    assert not registry["tree-models"].isEnabled()
    assert registry.why_disabled("tree-models")


@gui
def test_shortcuts_are_edited_and_come_back(make_window: Callable[..., Window], store: QSettings) -> None:
    """A key moves from one action to another, is remembered, and reset brings all back."""
    window = make_window()
    registry = window.bench.registry
    editor = ShortcutEditor(registry, window)
    editor.choose("edges")
    editor.edit.setKeySequence(QKeySequence("F"))
    assert "Frame" in editor.conflict()
    editor._set.click()
    assert registry["edges"].shortcut() == QKeySequence("F")
    assert registry["frame"].shortcuts() == []
    editor.close()
    second = make_window()
    assert second.bench.registry["edges"].shortcut() == QKeySequence("F")
    assert second.bench.registry["frame"].shortcuts() == []
    second.bench.registry.reset_keys()
    assert second.bench.registry["frame"].shortcut() == QKeySequence("F")
    assert not [key for key in store.allKeys() if key.startswith("shortcuts")]


@gui
def test_an_action_may_have_two_keys_or_none(window: Window) -> None:
    """Keys can be added to those there are, and taken away altogether."""
    editor = ShortcutEditor(window.bench.registry, window)
    editor.choose("geometry")
    editor.edit.setKeySequence(QKeySequence("Ctrl+G"))
    editor._also.click()
    assert window.bench.registry["geometry"].shortcuts() == [QKeySequence("T"), QKeySequence("Ctrl+G")]
    editor.edit.setKeySequence(QKeySequence())
    editor._set.click()
    assert window.bench.registry["geometry"].shortcuts() == []
    editor._reset.click()
    assert window.bench.registry["geometry"].shortcuts() == [QKeySequence("T")]
    editor.close()


@gui
def test_every_dock_is_an_action(window: Window) -> None:
    """Panels are shown and hidden by palette and keys like everything else."""
    action = window.actions_by_id["panel-log"]
    shown = not window.docks["Log"].isHidden()
    action.trigger()
    assert window.docks["Log"].isHidden() is shown


@gui
def test_two_actions_of_one_name_are_refused(window: Window) -> None:
    """A part that takes a name which is taken is a defect, said at once."""
    with pytest.raises(ValueError, match="frame"):
        window.bench.registry.add(ActionSpec("frame", "View", "Frame", "Twice"), print)
