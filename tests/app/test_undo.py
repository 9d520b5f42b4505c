"""Undo and redo of selections, of the side file and of bakes; what has gone stale since."""

from __future__ import annotations

import os
import shutil
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PyQt6.QtGui import QUndoStack
from pytestqt.qtbot import QtBot

from app.kept_results import KeptResults
from app.undo_step import Step
from app.window import Window
from bake.errors import StorageError
from bake.settings import BakeSettings
from bake.types import Role

PATIENCE_MS = 180_000

pytestmark = pytest.mark.gui


def _wait(qtbot: QtBot, condition: Callable[[], bool]) -> None:
    qtbot.waitUntil(condition, timeout=PATIENCE_MS)


def _bake(window: Window, qtbot: QtBot, *, rays: int) -> None:
    with qtbot.waitSignal(window.controller.bake_ended, timeout=PATIENCE_MS) as ended:
        window.controller.bake(BakeSettings().replaced(rays=rays, samples_per_face=(1, 1), device="cpu"))
    assert ended.args == [True]


def _rays(window: Window) -> int:
    assert window.document.result is not None
    return window.document.result.settings.rays


def _trigger(window: Window, name: str) -> None:
    assert window.actions_by_id[name].isEnabled(), window.bench.registry.why_disabled(name)
    window.actions_by_id[name].trigger()


def _index(window: Window, path: str) -> int:
    assert window.document.world is not None
    return window.document.world.object_paths.index(path)


def _side_file(scene: Path) -> Path:
    return scene.with_name(scene.name + ".obscura.toml")


def test_selections_are_undone_one_by_one(shown: Window, qtbot: QtBot) -> None:
    """Each choice is a step with a name; choices that follow at once are one."""
    document, undo = shown.document, shown.bench.undo
    undo.clear()
    document.select(0)
    qtbot.wait(900)
    document.select_all((1, 2), 2)
    assert undo.count() == 2
    _trigger(shown, "undo")
    assert (document.selection, document.selected) == ((0,), 0)
    _trigger(shown, "undo")
    assert document.selection == ()
    assert not shown.actions_by_id["undo"].isEnabled()
    _trigger(shown, "redo")
    _trigger(shown, "redo")
    assert (document.selection, document.selected) == ((1, 2), 2)
    undo.clear()
    for index in range(3):
        document.select(index)
    assert undo.count() == 1


def test_hiding_is_undone(shown: Window) -> None:
    """Hidden objects come back, in the view and in the list."""
    document = shown.document
    document.select(_index(shown, "Crate"))
    before = document.visible.copy()
    _trigger(shown, "hide")
    assert not document.visible[document.selected]
    _trigger(shown, "show-only")
    assert document.visible.sum() == 1
    _trigger(shown, "undo")
    _trigger(shown, "undo") if not np.array_equal(document.visible, before) else None
    np.testing.assert_array_equal(document.visible, before)


def test_a_bake_is_one_step(window: Window, qtbot: QtBot, scene: Path) -> None:
    """Undo shows and stores the former result, redo the latter; before the first bake there is none."""
    opened = window
    opened.controller.open(scene)
    _wait(qtbot, lambda: opened.document.world is not None and opened.controller.is_idle)
    _bake(opened, qtbot, rays=4)
    _bake(opened, qtbot, rays=8)
    folder = opened.document.result_path
    assert folder is not None
    first_step = opened.bench.undo.count()
    _trigger(opened, "undo")
    assert not opened.actions_by_id["undo"].isEnabled()  # until the result is back
    _wait(qtbot, lambda: _rays(opened) == 4)
    _wait(qtbot, lambda: opened.actions_by_id["undo"].isEnabled())
    _trigger(opened, "undo")
    _wait(qtbot, lambda: opened.document.result is None)
    assert not (folder / "manifest.json").exists()
    _wait(qtbot, lambda: opened.actions_by_id["redo"].isEnabled())
    _trigger(opened, "redo")
    _wait(qtbot, lambda: opened.document.result is not None and _rays(opened) == 4)
    _wait(qtbot, lambda: opened.actions_by_id["redo"].isEnabled())
    _trigger(opened, "redo")
    _wait(qtbot, lambda: _rays(opened) == 8)
    assert opened.bench.undo.count() == first_step


def test_kept_results_go_with_their_steps(opened: Window, qtbot: QtBot) -> None:
    """What no step needs any more is removed from the cache, and all of it with the window."""
    folder = opened.bench.cache / "undo"
    _bake(opened, qtbot, rays=8)
    assert len(list(folder.glob("*/*/manifest.json"))) == 2
    opened.bench.undo.clear()
    _wait(qtbot, lambda: not list(folder.glob("*/*/manifest.json")))
    _bake(opened, qtbot, rays=4)
    opened.close()
    assert not list(folder.glob("*/*"))


def test_a_role_is_written_marked_and_taken_back(opened: Window, qtbot: QtBot, scene: Path) -> None:
    """A role goes to the side file as one step; the object is stale until the file is as it was."""
    document, outliner = opened.document, opened.panels.outliner
    side_file = _side_file(scene)
    side_file.write_text("# mine\n")
    crate, ground = _index(opened, "Crate"), _index(opened, "Ground")
    document.select_all((crate, ground), crate)
    _trigger(opened, "role-blocker")
    _wait(qtbot, lambda: document.current is not None and len(document.current.stale) == 2)
    assert tomllib.loads(side_file.read_text())["object"] == [
        {"match": "Ground", "role": "blocker"},
        {"match": "Crate", "role": "blocker"},
    ]
    assert side_file.read_text().startswith("# mine\n")
    assert document.current is not None
    assert document.current.role_of("Crate", Role.STATIC) is Role.BLOCKER
    assert outliner.model.index_of(crate, 1).data() == "blocker"
    assert "2 changed" in outliner._count.text()
    outliner.filter.setText("is:stale")
    assert outliner.model.shown_count == 2
    _trigger(opened, "undo")
    assert side_file.read_text() == "# mine\n"
    _wait(qtbot, lambda: document.current is not None and document.current.is_fresh)
    assert outliner.model.index_of(crate, 1).data() is None  # filtered out: it is fresh again
    outliner.filter.clear()
    assert outliner.model.index_of(crate, 1).data() == "static"
    _trigger(opened, "redo")
    _bake(opened, qtbot, rays=4)
    _wait(qtbot, lambda: document.current is not None and document.current.is_fresh)
    assert document.world is not None
    assert document.world.object_roles[crate] is Role.BLOCKER


def test_several_edits_at_once_all_arrive(opened: Window, qtbot: QtBot, scene: Path) -> None:
    """Edits asked for before the first is written are written in order, a step each."""
    opened.document.select(_index(opened, "Crate"))
    steps = opened.bench.undo.count()
    for name in ("role-tree", "role-small", "role-blocker"):
        _trigger(opened, name)
    _wait(qtbot, lambda: opened.bench.undo.count() == steps + 3)
    assert tomllib.loads(_side_file(scene).read_text())["object"] == [{"match": "Crate", "role": "blocker"}]
    for _ in range(3):
        _trigger(opened, "undo")
    assert not _side_file(scene).exists()


def test_a_foreign_change_makes_the_step_void(opened: Window, qtbot: QtBot, scene: Path) -> None:
    """If somebody else wrote the side file since, undo says so and leaves it alone."""
    opened.document.select(_index(opened, "Crate"))
    _trigger(opened, "role-small")
    _wait(qtbot, lambda: _side_file(scene).exists())
    text = _side_file(scene).read_text() + "# theirs\n"
    _side_file(scene).write_text(text)
    steps = opened.bench.undo.count()
    _trigger(opened, "undo")
    assert "another program" in opened.banner.text()
    assert _side_file(scene).read_text() == text
    assert opened.bench.undo.count() == steps - 1


def test_changes_on_disk_are_seen(opened: Window, qtbot: QtBot, scene: Path) -> None:
    """Whoever edits the scene's files, the window marks what is stale, new and gone, and says so once."""
    text = scene.read_text()
    scene.write_text(text.replace("o Crate", "o Box", 1) if "o Crate" in text else text.replace("g Crate", "g Box", 1))
    _wait(qtbot, lambda: opened.document.current is not None and not opened.document.current.is_fresh)
    assert opened.document.current is not None
    assert opened.document.current.gone == {"Crate"}
    assert opened.document.current.new == {"Box"}
    assert "changed on disk" in opened.banner.text()
    scene.write_text(text)
    _wait(qtbot, lambda: opened.document.current is not None and opened.document.current.is_fresh)


def test_settings_are_kept_with_the_scene(opened: Window, qtbot: QtBot, scene: Path) -> None:
    """Settings that differ go to the side file's table; device and tracer stay a matter of the machine."""
    opened.panels.bake.form.editor("rays").set_value(16)
    _trigger(opened, "keep-settings")
    _wait(qtbot, lambda: _side_file(scene).exists())
    bake = tomllib.loads(_side_file(scene).read_text())["bake"]
    assert bake["rays"] == 16
    assert "device" not in bake
    _trigger(opened, "undo")
    assert not _side_file(scene).exists()


def test_threshold_for_the_bake_is_undone(shown: Window) -> None:
    """Taking the threshold in view over into the settings is a step."""
    shown.document.set_threshold(0.6)
    shown.panels.overlays._keep.click()
    settings = shown.panels.bake.settings()
    assert settings is not None
    assert settings.back_face_threshold == 0.6
    _trigger(shown, "undo")
    settings = shown.panels.bake.settings()
    assert settings is not None
    assert settings.back_face_threshold == 0.25


def test_a_step_that_fails_is_void(qapp: object) -> None:
    """An error while undoing removes the step and is told."""
    told: list[str] = []

    def fail() -> None:
        raise StorageError("no space left")

    undo = QUndoStack()
    undo.push(Step("x", redo=lambda: None, undo=fail, failed=lambda error: told.append(str(error))))
    undo.undo()
    assert told == ["no space left"]
    assert undo.count() == 0


def test_opening_another_scene_forgets_the_steps(opened: Window, qtbot: QtBot, result_folder: Path) -> None:
    """Steps belong to what was open."""
    opened.document.select(0)
    assert opened.bench.undo.count()
    opened.controller.open(result_folder)
    _wait(qtbot, lambda: opened.document.result_path == result_folder.resolve())
    assert opened.bench.undo.count() == 0


def test_results_on_other_disks_are_kept_beside_themselves(
    tmp_path: Path, result_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What cannot share its files with the cache stays on its own disk; nothing is left of it afterwards."""
    kept, result = KeptResults(tmp_path / "cache"), tmp_path / "elsewhere" / "result"
    shutil.copytree(result_folder, result)
    monkeypatch.setattr(KeptResults, "_folder_for", lambda _self, path: path.parent / ".obscura-undo" / "1")
    where = kept.keep(result)
    assert where is not None
    assert where.parent.parent == result.parent / ".obscura-undo"
    assert next(where.glob("field_ao-*")).stat().st_nlink == 2
    kept.drop_others((where,), kept.count)
    assert where.exists()
    again = kept.keep(result)  # nothing has changed since
    assert again is not None
    assert {file.name for file in again.iterdir()} == {file.name for file in where.iterdir()}
    kept.drop_others((again,), kept.count)
    assert again.exists()
    assert not where.exists()
    kept.drop_others((), kept.count)
    assert sorted(path.name for path in result.parent.iterdir()) == ["result"]
    assert kept.keep(tmp_path) is None


def test_kept_results_of_dead_processes_go(tmp_path: Path) -> None:
    """What a crashed window kept is removed by the next one; what a living one keeps stays."""
    kept = KeptResults(tmp_path)
    for pid in (os.getpid(), 2**22 + 7):  # the second is above what Linux gives out
        (tmp_path / "undo" / str(pid) / "1").mkdir(parents=True)
    kept.drop_orphans()
    assert [path.name for path in (tmp_path / "undo").iterdir()] == [str(os.getpid())]
