"""The user's preferences at work: colours, mouse, up axis, device, threads, room for results, undo."""

from __future__ import annotations

import os

from app.actions import Action, ActionSpec
from app.dialogs import show_dialog
from app.navigation_styles import STYLES
from app.parts.history import HistoryPart
from app.preferences import Preferences
from app.preferences_dialog import PreferencesDialog
from app.result_cache import cached_results, note_use, size_of, trim
from app.style import apply_scheme
from app.window_parts import Part, Workbench
from bake.errors import ObscuraError

_DEVICES = {"auto": "The fastest there is", "cpu": "CPU", "cuda": "First CUDA device"}
_THREADS = "OBSCURA_THREADS"


class HabitsPart(Part):
    """Applies preferences when they are changed, and what they say about scenes when those are opened."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self.preferences = Preferences.read(bench.store)
        self._dialog: PreferencesDialog | None = None
        self._threads = 0

    def actions(self) -> list[Action]:
        """Colours of the window, and everything else in a dialog."""
        return [
            (
                ActionSpec("light-palette", "View", "Bright window", "Light colours for the panels", (), True, 5),
                lambda on: self.change(scheme="light" if on else ""),
            ),
            (
                ActionSpec("dark-palette", "View", "Dark window", "Dark colours for the panels", (), True, 5),
                lambda on: self.change(scheme="dark" if on else ""),
            ),
            (
                ActionSpec(
                    "preferences", "Edit", "Pre&ferences …", "Colours, mouse, device, room", ("Ctrl+,",), group=8
                ),
                self.show,
            ),
        ]

    def connect(self) -> None:
        """Applies what was stored."""
        document = self.bench.document
        document.opened.connect(self._on_opened)
        document.result_changed.connect(self._on_result)
        self._apply(self.preferences)

    def close(self) -> None:
        """Lets go of the dialog."""
        if self._dialog is not None:
            self._dialog.close()

    def change(self, **changes: object) -> None:
        """Changes some preferences, for good."""
        self.set(self.preferences.replaced(**changes))

    def set(self, preferences: Preferences) -> None:
        """Takes over preferences and remembers them."""
        former, self.preferences = self.preferences, preferences
        preferences.write(self.bench.store)
        self._apply(preferences, former)

    def show(self) -> None:
        """Opens the dialog."""
        dialog = PreferencesDialog(self.preferences, _DEVICES, os.cpu_count() or 1, self.bench.window)
        dialog.changed.connect(self.set)
        dialog.clear_asked.connect(lambda: self._trim(0))
        dialog.hints_asked.connect(lambda: self.bench.registry["hints"].trigger())
        dialog.finished.connect(self._on_finished)
        self._dialog = dialog
        show_dialog(dialog)
        self._measure()

    def _on_finished(self) -> None:
        self._dialog = None

    def _apply(self, preferences: Preferences, former: Preferences | None = None) -> None:
        bench = self.bench
        if former is None or former.scheme != preferences.scheme:
            apply_scheme(preferences.scheme)
        bench.registry["light-palette"].setChecked(preferences.scheme == "light")
        bench.registry["dark-palette"].setChecked(preferences.scheme == "dark")
        bench.area.set_style(STYLES[preferences.navigation])
        bench.controller.up_axis = preferences.up_axis
        bench.part(HistoryPart).set_depth(preferences.undo_depth)
        self._set_threads(preferences.threads)
        if former is not None and former.cache_mb != preferences.cache_mb and preferences.cache_mb:
            self._trim(preferences.cache_mb)

    def _set_threads(self, threads: int) -> None:
        """The engine process reads the number from its environment; one that was set outside is left alone."""
        if threads == self._threads:
            return
        self._threads = threads
        if threads:
            os.environ[_THREADS] = str(threads)
        else:
            os.environ.pop(_THREADS, None)
        self.bench.engine.start_anew()

    def _on_opened(self) -> None:
        editor = self.bench.panels.bake.form.editor("device")
        if self.preferences.device != "auto" and editor.value() == "auto":
            editor.set_value(self.preferences.device)
            self.bench.panels.bake.refresh()

    def _on_result(self) -> None:
        path = self.bench.document.result_path
        if self.bench.document.result is not None and path is not None:
            note_use(path)
            if self.preferences.cache_mb:
                self._trim(self.preferences.cache_mb)

    def _trim(self, most_mb: int) -> None:
        cache, path = self.bench.cache, self.bench.document.result_path
        keep = () if path is None else (path,)
        self.bench.jobs.run(
            "trim results",
            lambda: trim(cache, most_mb * 1_000_000, keep),
            lambda _removed: self._measure(),
            self._ignore,
        )

    def _measure(self) -> None:
        if self._dialog is None:
            return
        cache = self.bench.cache

        def measure() -> str:
            results = cached_results(cache)
            return f"{sum(map(size_of, results)) / 1e6:,.0f} MB in {len(results):,} results"

        def say(text: str) -> None:
            if self._dialog is not None:
                self._dialog.set_used(text)

        self.bench.jobs.run("measure results", measure, say, self._ignore)

    @staticmethod
    def _ignore(_error: ObscuraError) -> None:
        """Housekeeping that fails is in the log."""
