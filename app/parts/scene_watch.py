"""Keeps an eye on the scene's files: what has changed since the bake is marked, whoever changed it."""

from __future__ import annotations

import hashlib
import logging
from pathlib import Path
from typing import TYPE_CHECKING

from PyQt6.QtCore import QFileSystemWatcher, QTimer

from app.scene_state import SceneState, read_scene_state
from app.window_parts import Part, Workbench
from bake.errors import ObscuraError
from bake.types import BakeResult

if TYPE_CHECKING:
    from bake.scene.side_file_writer import SideFileEdit

SETTLE_MS = 400
"""Programs write a file in several goes: it is read when it has rested so long."""

logger = logging.getLogger(__name__)


class SceneWatchPart(Part):
    """Reads the scene's files again when they or the result change, and tells the document what differs."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self._watcher = QFileSystemWatcher(bench.window)
        self._settle = QTimer(bench.window)
        self._settle.setSingleShot(True)
        self._settle.setInterval(SETTLE_MS)
        self._foreign = False
        self._own: dict[str, str] = {}

    def connect(self) -> None:
        """Follows document and files."""
        self._watcher.fileChanged.connect(self._on_file)
        self._watcher.directoryChanged.connect(self._on_file)
        self._settle.timeout.connect(self._read)
        self.bench.document.opened.connect(self._watch)
        self.bench.document.result_changed.connect(self._on_result)

    def close(self) -> None:
        """Looks no more."""
        self._settle.stop()
        watched = [*self._watcher.files(), *self._watcher.directories()]
        if watched:
            self._watcher.removePaths(watched)

    def look(self) -> None:
        """Reads the scene's files again."""
        self._read()

    def note_own(self, edit: SideFileEdit) -> None:
        """Remembers what the window itself has written, so that nobody needs to be told, and looks at it."""
        self._own[edit.path.name] = "" if edit.after is None else hashlib.sha256(edit.after).hexdigest()
        self._read()

    def _watch(self) -> None:
        watched = {*self._watcher.files(), *self._watcher.directories()}
        scene = self.bench.document.scene_path
        wanted: set[str] = set()
        if scene is not None:
            from bake.scene.side_file import side_file_names

            names = {scene.name, *side_file_names(scene), *self.bench.document.files}
            paths = (scene.parent, *(scene.parent / name for name in names))
            wanted = {str(path) for path in paths if path.exists()}
        # What is watched already stays so: taking it out and in again would lose the changes that are on their way.
        for paths, act in ((watched - wanted, self._watcher.removePaths), (wanted - watched, self._watcher.addPaths)):
            if paths:
                act(sorted(paths))

    def _on_file(self, _path: str) -> None:
        self._foreign = True
        self._settle.start()

    def _on_result(self) -> None:
        if self.bench.document.result is not None:
            self._settle.start(0)

    def _read(self) -> None:
        document = self.bench.document
        scene, result = document.scene_path, document.result
        if scene is not None and document.world is not None:
            self.bench.jobs.run(
                "read scene state",
                lambda: _state_of(scene, result),
                lambda state: self._on_state(state, scene, result),
                lambda error: logger.debug("%s", error),
            )

    def _on_state(self, state: SceneState, scene: Path, result: BakeResult | None) -> None:
        document = self.bench.document
        if document.scene_path != scene or document.result is not result:
            return
        known, foreign = document.current, self._foreign
        before = document.files if known is None else known.files
        changed = {name for name, digest in state.files.items() if before.get(name, "") != digest}
        theirs = any(self._own.get(name) != state.files[name] for name in changed)
        self._foreign = False
        if not state.complaint:
            document.side_file_settings = state.settings
        self._watch()
        if known is not None and known.files == state.files and known.summary() == state.summary():
            return
        document.set_current(state)
        self.bench.panels.bake.refresh()
        if foreign and (theirs or state.complaint):
            self._tell(state, scene)

    def _tell(self, state: SceneState, scene: Path) -> None:
        bench = self.bench
        if state.complaint:
            bench.banner.show_message(logging.WARNING, state.complaint)
        elif bench.document.result is None:
            text = f"{scene.name} has changed on disk."
            bench.banner.show_message(logging.WARNING, text, {"Load again": lambda: bench.controller.open_scene(scene)})
        elif not state.is_fresh:
            text = f"{scene.name} has changed on disk: {state.summary()}."
            bench.banner.show_message(logging.WARNING, text, {"Bake again": bench.panels.bake.request_bake})


def _state_of(scene: Path, result: BakeResult | None) -> SceneState:
    try:
        return read_scene_state(scene, result)
    except ObscuraError as error:
        settings = None if result is None else result.settings
        from bake.settings import BakeSettings

        return SceneState({}, settings or BakeSettings(), {}, complaint=str(error))
