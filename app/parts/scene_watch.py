"""Keeps an eye on the scene's files: what has changed since the bake is marked, whoever changed it."""

from __future__ import annotations

import hashlib
import logging
from pathlib import Path
from typing import TYPE_CHECKING

from PyQt6.QtCore import QFileSystemWatcher, QTimer

from app.events import Event
from app.scene_preview import padded_result
from app.scene_state import SceneState, SceneStates
from app.window_parts import Part, Workbench
from bake.errors import ObscuraError
from bake.types import BakeResult, World

if TYPE_CHECKING:
    from bake.scene.side_file_writer import SideFileEdit

SETTLE_MS = 400
"""Programs write a file in several goes: it is read when it has rested so long."""

WAIT_MS = 1500
"""While a rebake is about to show an edit, its state is read then, or after this time."""

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
        self.edited: Event[[str, str]] = Event()
        """A new edit of the window's own was written: name and SHA-256 of the side file. Its state follows."""
        self._states: SceneStates | None = None
        self._result: BakeResult | None = None  # as stored; that in view may have a place for new objects
        self._view: World | None = None  # its geometry, or that of the scene as it was opened
        self._extending = False
        self.waits = False
        """Whether the state after an edit of the window's own is read a moment later."""
        self._whole = False

    def connect(self) -> None:
        """Follows document and files."""
        self._watcher.fileChanged.connect(self._on_file)
        self._watcher.directoryChanged.connect(self._on_file)
        self._settle.timeout.connect(self._read)
        self.bench.document.opened.connect(self._on_opened)
        self.bench.document.result_changed.connect(self._on_result)

    def close(self) -> None:
        """Looks no more."""
        self._settle.stop()
        watched = [*self._watcher.files(), *self._watcher.directories()]
        if watched:
            self._watcher.removePaths(watched)

    @property
    def result(self) -> BakeResult | None:
        """The result in view as it is stored."""
        return self._result

    def want_scene(self) -> None:
        """From now on the state has the scene itself, also while nothing has changed."""
        if not self._whole:
            self._whole = True
            current = self.bench.document.current
            if current is None or current.scene is None:
                self._read()

    def look(self) -> None:
        """Reads the scene's files again."""
        self._read()

    def note_own(self, edit: SideFileEdit, *, new: bool = True) -> None:
        """Remembers what the window itself has written, so that nobody needs to be told, and looks at it.

        Args:
            edit: What was written.
            new: It was not undone or done again.
        """
        digest = "" if edit.after is None else hashlib.sha256(edit.after).hexdigest()
        self._own[edit.path.name] = digest
        if new:
            self.edited.emit(edit.path.name, digest)
        if new and self.waits:
            self._settle.start(WAIT_MS)
        else:
            self._read()

    def catch_up(self) -> None:
        """Reads an edit of the window's own whose state is to be read later."""
        if self._settle.isActive():
            self._settle.start(0)

    def _on_opened(self) -> None:
        self._states = self._result = self._view = None
        self._watch()

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
        self._settle.start(max(SETTLE_MS, self._settle.remainingTime()))

    def _on_result(self) -> None:
        document = self.bench.document
        if self._extending:
            return
        if document.result is None:
            self._result = None
            self._view = document.world
        else:
            self._result, self._view = document.result, document.result.world
            self._settle.start(0)

    def _read(self) -> None:
        document = self.bench.document
        scene, result, view = document.scene_path, self._result, self._view
        if scene is None or document.world is None:
            return
        if self._states is None or self._states.path != scene:
            self._states = SceneStates(scene, document.reader)
        states, whole = self._states, self._whole
        self.bench.jobs.run(
            "read scene state",
            lambda: _state_of(states, result, view, whole),
            lambda state: self._on_state(state, scene, result),
            lambda error: logger.debug("%s", error),
        )

    def _on_state(self, state: SceneState, scene: Path, result: BakeResult | None) -> None:
        document = self.bench.document
        if document.scene_path != scene or self._result is not result:
            return
        known, foreign = document.current, self._foreign
        before = document.files if known is None else known.files
        changed = {name for name, digest in state.files.items() if before.get(name, "") != digest}
        theirs = any(self._own.get(name) != state.files[name] for name in changed)
        self._foreign = False
        if not state.complaint:
            document.side_file_settings = state.settings
        self._watch()
        same = known is not None and known.files == state.files and known.summary() == state.summary()
        if known is None or not same or (known.scene is None) != (state.scene is None):
            document.set_current(state)
            self.bench.panels.bake.refresh()
        self._show(state.world)
        if not same and foreign and (theirs or state.complaint):
            self._tell(state, scene)

    def _show(self, world: World | None) -> None:
        """Puts every object in view where it is now."""
        document = self.bench.document
        shown = document.world
        if world is None or shown is None or world is shown:
            return
        if world.object_paths != shown.object_paths or world.positions.shape != shown.positions.shape:
            self._extending = True
            document.extend_world(world, None if self._result is None else padded_result(self._result, world))
            self._extending = False
        elif world.object_hash != shown.object_hash:
            document.move_world(world)

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


def _state_of(states: SceneStates, result: BakeResult | None, view: World | None, whole: bool) -> SceneState:
    try:
        return states.read(result, view, whole=whole)
    except ObscuraError as error:
        from bake.settings import BakeSettings

        return SceneState({}, BakeSettings() if result is None else result.settings, {}, complaint=str(error))
