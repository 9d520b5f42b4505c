"""Keeps an eye on the scene's files: what has changed since the bake is marked, whoever changed it."""

from __future__ import annotations

import logging
from pathlib import Path

from PyQt6.QtCore import QFileSystemWatcher, QTimer

from app.scene_state import SceneState, read_scene_state
from app.window_parts import Part, Workbench
from bake.errors import ObscuraError
from bake.types import BakeResult

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

    def look(self, *, ours: bool = False) -> None:
        """Reads the scene's files again.

        Args:
            ours: Whether the window itself has changed them, so that nobody needs to be told.
        """
        self._foreign = self._foreign and not ours
        self._read()

    def _watch(self) -> None:
        watched = [*self._watcher.files(), *self._watcher.directories()]
        if watched:
            self._watcher.removePaths(watched)
        scene = self.bench.document.scene_path
        if scene is not None:
            from bake.scene.side_file import side_file_names

            names = {scene.name, *side_file_names(scene), *self.bench.document.files}
            paths = [scene.parent / name for name in sorted(names)]
            self._watcher.addPaths([str(path) for path in (scene.parent, *paths) if path.exists()])

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
        self._foreign = False
        if not state.complaint:
            document.side_file_settings = state.settings
        self._watch()
        if known is not None and known.files == state.files and known.summary() == state.summary():
            return
        document.set_current(state)
        self.bench.panels.bake.refresh()
        if foreign and state.complaint:
            self.bench.banner.show_message(logging.WARNING, state.complaint)
        elif foreign and not state.is_fresh:
            text = f"{scene.name} has changed on disk: {state.summary()}. Bake again to see it."
            self.bench.banner.show_message(logging.WARNING, text)


def _state_of(scene: Path, result: BakeResult | None) -> SceneState:
    try:
        return read_scene_state(scene, result)
    except ObscuraError as error:
        settings = None if result is None else result.settings
        from bake.settings import BakeSettings

        return SceneState({}, settings or BakeSettings(), {}, complaint=str(error))
