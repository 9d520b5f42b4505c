"""Opening and saving: scenes, results, pictures, and the files opened last."""

from __future__ import annotations

import logging
from pathlib import Path

from PyQt6.QtWidgets import QMenu

from app import dialogs
from app.actions import Action, ActionSpec
from app.recent_files import add_recent_file, clear_recent_files, recent_files
from app.window_parts import Part, Workbench


class FilesPart(Part):
    """The File menu."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self._recent = QMenu("Open &recent", bench.window)
        self._recent.aboutToShow.connect(self._fill_recent)

    def actions(self) -> list[Action]:
        """Open, save, quit."""
        menu, bench = "File", self.bench
        return [
            (
                ActionSpec("open-scene", menu, "&Open scene …", "Open a glTF, GLB, OBJ or PLY file", ("Ctrl+O",)),
                lambda: self._open_if_given(dialogs.ask_for_scene(bench.window, self.last_folder())),
            ),
            (
                ActionSpec("open-result", menu, "Open &result …", "Open a result folder", ("Ctrl+Shift+O",)),
                lambda: self._open_if_given(dialogs.ask_for_result(bench.window, self.last_folder())),
            ),
            (
                ActionSpec("open-sample", menu, "Open sample &level", "Open the level that comes with Obscura"),
                lambda: bench.controller.open(None),
            ),
            (
                ActionSpec(
                    "save-result",
                    menu,
                    "&Save result as …",
                    "Copy the result to a folder of your own",
                    ("Ctrl+S",),
                    group=2,
                    needs=("result",),
                ),
                self._ask_where_to_save,
            ),
            (
                ActionSpec(
                    "save-picture",
                    menu,
                    "Save &picture …",
                    "Save the view with its legend as PNG",
                    ("Ctrl+P",),
                    group=2,
                    needs=("scene",),
                ),
                self._ask_for_picture,
            ),
            (ActionSpec("quit", menu, "&Quit", "Close the window", ("Q", "Ctrl+Q"), group=9), bench.window.close),
        ]

    def connect(self) -> None:
        """Keeps the list of recent files."""
        bench = self.bench
        bench.menus["File"].insertMenu(bench.registry["open-sample"], self._recent)
        bench.controller.scene_opened.connect(lambda path: add_recent_file(bench.store, path))
        bench.controller.result_saved.connect(
            lambda path: bench.banner.show_message(logging.INFO, f"Result saved to {path}")
        )

    def save_picture(self, target: Path) -> None:
        """Saves the view, with its legend, as a picture file."""
        if self.bench.area.picture().save(str(target)):
            self.bench.banner.show_message(logging.INFO, f"Picture saved to {target}")
        else:
            text = f"{target}: could not be written; choose another folder"
            self.bench.banner.show_message(logging.ERROR, text)

    def last_folder(self) -> Path:
        """Where the user opened something last."""
        recent = recent_files(self.bench.store)
        return recent[0].parent if recent else Path.home()

    def _open_if_given(self, path: Path | None) -> None:
        if path is not None:
            self.bench.controller.open(path)

    def _ask_where_to_save(self) -> None:
        result = self.bench.document.result
        if result is None:
            self.bench.banner.show_message(logging.WARNING, "There is no result to save yet; bake first.")
            return
        name = f"{result.scene_path.stem}-result"
        target = dialogs.ask_where_to_save(self.bench.window, self.last_folder() / name)
        if target is not None:
            self.bench.controller.save_result_as(target)

    def _ask_for_picture(self) -> None:
        stem = Path(self.bench.document.scene_name or "view").stem
        target = dialogs.ask_for_picture(self.bench.window, self.last_folder() / f"{stem}.png")
        if target is not None:
            self.save_picture(target)

    def _fill_recent(self) -> None:
        bench = self.bench
        self._recent.clear()
        for path in recent_files(bench.store):
            action = self._recent.addAction(str(path))
            assert action is not None
            action.triggered.connect(lambda _checked=False, path=path: bench.controller.open(path))
        self._recent.addSeparator()
        clear = self._recent.addAction("Clear the list")
        assert clear is not None
        clear.triggered.connect(lambda: clear_recent_files(bench.store))
