"""What the user prefers, kept between sessions; every value is checked when it is read."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from PyQt6.QtCore import QSettings

from app.navigation_styles import STYLES

_KEY = "preferences"
SCHEMES = {"": "As the system", "light": "Light", "dark": "Dark"}
UP_AXES = {0: "As the file says", 1: "+Y", 2: "+Z"}


@dataclass(frozen=True, slots=True)
class Preferences:
    """All preferences, with those of a new user.

    Attributes:
        scheme: Colours of the window: "" as the system, "light" or "dark".
        navigation: What mouse buttons do in the view, see `STYLES`.
        up_axis: 1 or 2 for scenes that do not say which way is up; 0 to guess.
        device: What new scenes are baked on.
        threads: CPU threads of the bake; 0 for all.
        cache_mb: Results that were not saved elsewhere may take so much; 0 for no limit.
        undo_depth: Steps that can be undone; 0 for no limit.
        autosave_s: How often the session is put aside in case of a crash, in seconds; 0 for never.
    """

    scheme: str = ""
    navigation: str = "obscura"
    up_axis: int = 0
    device: str = "auto"
    threads: int = 0
    cache_mb: int = 20_000
    undo_depth: int = 200
    autosave_s: int = 30

    @staticmethod
    def read(store: QSettings) -> Preferences:
        """What is stored; defaults where nothing is, or nothing that makes sense."""
        preferences = Preferences()
        for field in dataclasses.fields(Preferences):
            value = store.value(f"{_KEY}/{field.name}")
            if value is None:
                continue
            default = getattr(preferences, field.name)
            try:
                preferences = dataclasses.replace(preferences, **{field.name: type(default)(value)})
            except (TypeError, ValueError):
                continue
        return preferences._checked()

    def write(self, store: QSettings) -> None:
        """Stores what differs from the defaults."""
        for field in dataclasses.fields(Preferences):
            value = getattr(self, field.name)
            if value == field.default:
                store.remove(f"{_KEY}/{field.name}")
            else:
                store.setValue(f"{_KEY}/{field.name}", value)

    def replaced(self, **changes: object) -> Preferences:
        """These with some changed."""
        return dataclasses.replace(self, **changes)._checked()  # type: ignore[arg-type]

    def _checked(self) -> Preferences:
        default = Preferences()
        return Preferences(
            scheme=self.scheme if self.scheme in SCHEMES else default.scheme,
            navigation=self.navigation if self.navigation in STYLES else default.navigation,
            up_axis=self.up_axis if self.up_axis in UP_AXES else default.up_axis,
            device=self.device or default.device,
            threads=min(max(self.threads, 0), 1024),
            cache_mb=max(self.cache_mb, 0),
            undo_depth=min(max(self.undo_depth, 0), 10_000),
            autosave_s=min(max(self.autosave_s, 0), 3600),
        )
