"""Puts the session aside every so often, and offers it again if it did not end properly."""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PyQt6.QtCore import QByteArray, QTimer

from app.parts.habits import HabitsPart
from app.parts.layouts import LayoutsPart
from app.session import Session, SessionFile
from app.window_parts import Part, Workbench
from bake.errors import InputError
from bake.settings import BakeSettings

logger = logging.getLogger(__name__)

_POLL_MS = 1000


class SessionPart(Part):
    """Autosave and recovery."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self._file = SessionFile(bench.cache, id(bench) % 100_000)
        self._saved: Session | None = None
        self._when = time.monotonic()
        self._returning: Session | None = None
        self._showing = Session()
        self._later = QTimer(bench.window)
        self._later.setSingleShot(True)
        self._later.timeout.connect(lambda: self._show(self._showing))
        self._timer = QTimer(bench.window)
        self._timer.setInterval(_POLL_MS)
        self._timer.timeout.connect(self._on_tick)

    def connect(self) -> None:
        """Starts to put the session aside."""
        document = self.bench.document
        document.world_changed.connect(self._on_shown)
        document.result_changed.connect(self._on_shown)
        self._timer.start()

    def close(self) -> None:
        """Ends the session properly."""
        self._timer.stop()
        self._later.stop()
        self._file.remove()

    def offer(self, otherwise: Callable[[], object]) -> bool:
        """Offers a session that did not end properly.

        Args:
            otherwise: Called if the user does not want it.

        Returns:
            Whether there is one.
        """
        left = self._file.take_left()
        if left is None or not Path(left.scene).exists():
            return False
        when = time.strftime("%d %b, %H:%M", time.localtime(left.when))
        self.bench.banner.ask(
            f"The last session ended unexpectedly. Go on with {Path(left.scene).name} as it was at {when}?",
            {"Restore": lambda: self.restore(left), "Start afresh": otherwise},
        )
        return True

    def restore(self, session: Session) -> None:
        """Opens what was open, and shows it as it was shown."""
        self._returning = session
        result = Path(session.result) if session.result else None
        if result is not None and (result / "manifest.json").exists():
            self.bench.controller.open_result(result)
        else:
            self.bench.controller.open_scene(Path(session.scene))

    def snapshot(self) -> Session:
        """The session as it is now."""
        bench, document = self.bench, self.bench.document
        world = document.world
        paths = world.object_paths if world is not None else ()
        last = [document.selected] if document.selected >= 0 else []
        chosen = [index for index in document.selection if index != document.selected] + last
        visible = document.visible if len(document.visible) == len(paths) else np.ones(len(paths), bool)
        settings = bench.panels.bake.settings()
        return Session(
            scene=str(document.scene_path or ""),
            result=str(document.result_path) if document.result is not None else "",
            up_axis=document.up_axis,
            camera=bench.area.main.camera,
            display=document.display,
            threshold=document.threshold,
            selected=tuple(paths[index] for index in chosen),
            hidden=tuple(paths[index] for index in np.flatnonzero(~visible)),
            options=json.dumps(settings.to_json()) if settings is not None else "",
            layout=bytes(bench.part(LayoutsPart).state().data()).hex(),
        )

    def save(self) -> None:
        """Puts the session aside, if anything has changed."""
        session = self.snapshot()
        self._when = time.monotonic()
        if session != self._saved:
            self._saved = session
            file = self._file
            self.bench.jobs.run("put session aside", lambda: _write(file, session), lambda _none: None, _ignore)

    def _on_tick(self) -> None:
        every = self.bench.part(HabitsPart).preferences.autosave_s
        if every and time.monotonic() - self._when >= every and self.bench.document.scene_path is not None:
            self.save()

    def _on_shown(self) -> None:
        """Once what was open is back, shows it as it was."""
        session, document = self._returning, self.bench.document
        if session is None or document.world is None or (session.result and document.result is None):
            return
        self._returning = None
        self._showing = session
        self._later.start()

    def _show(self, session: Session) -> None:
        bench, document = self.bench, self.bench.document
        world = document.world
        if world is None:
            return
        if session.up_axis in (1, 2):
            document.set_up_axis(session.up_axis)
        document.set_display(session.display)
        index_of = {path: index for index, path in enumerate(world.object_paths)}
        visible = np.ones(world.object_count, bool)
        visible[[index_of[path] for path in session.hidden if path in index_of]] = False
        document.set_visible(visible)
        chosen = [index_of[path] for path in session.selected if path in index_of]
        document.select_all(chosen, chosen[-1] if chosen else None)
        if document.result is not None and session.threshold != document.threshold:
            document.set_threshold(session.threshold)
            bench.controller.solve_threshold()
        if session.options:
            try:
                bench.panels.bake.form.set_settings(BakeSettings.from_options(json.loads(session.options)))
                bench.panels.bake.refresh()
            except (InputError, ValueError) as error:
                logger.info("settings of the former session are left out: %s", error)
        bench.part(LayoutsPart).restore(QByteArray(bytes.fromhex(session.layout)))
        bench.area.main.navigation.set_camera(session.camera)
        bench.undo.clear()


def _write(file: SessionFile, session: Session) -> None:
    try:
        file.write(session)
    except OSError as error:
        logger.warning("the session could not be put aside: %s", error)


def _ignore(_error: object) -> None:
    """What went wrong is in the log."""
