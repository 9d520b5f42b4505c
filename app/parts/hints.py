"""Hints for new users."""

from __future__ import annotations

from PyQt6.QtCore import QTimer

from app.actions import Action, ActionSpec
from app.hints import HintCard
from app.window_parts import Part, Workbench

_DISMISSED = "hints/dismissed"


class HintsPart(Part):
    """Shows the card of hints until it is dismissed for good."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self.card = HintCard(bench.area.main.view)
        self.card.dismissed.connect(self.dismiss)
        self._soon = QTimer(bench.window)  # actions change by the dozen
        self._soon.setSingleShot(True)
        self._soon.setInterval(0)
        self._soon.timeout.connect(self._refresh)

    def actions(self) -> list[Action]:
        """Brings the hints back."""
        return [(ActionSpec("hints", "Help", "&First steps", "The hints that a new user sees"), self.show)]

    def connect(self) -> None:
        """Shows the hints to those who have not dismissed them."""
        self.bench.registry.changed.connect(self._soon.start)
        if str(self.bench.store.value(_DISMISSED, "")).lower() != "true":
            self.show()

    def show(self) -> None:
        """Shows the hints."""
        self._fill()
        self.card.show()
        self.card.raise_()

    def dismiss(self) -> None:
        """Hides the hints for good."""
        self.bench.store.setValue(_DISMISSED, True)
        self.card.hide()

    def _refresh(self) -> None:
        if self.card.isVisible():
            self._fill()

    def _fill(self) -> None:
        registry = self.bench.registry

        def key(name: str) -> str:
            keys = registry.keys(name)
            return keys[0].toString() if keys else registry[name].text().replace("&", "")

        orbit = self.bench.area.main.navigation.style.gestures()[0][0]
        self.card.set_hints(
            (
                (key("open-scene"), "open a scene; files can also be dropped here"),
                (key("bake"), "bake it"),
                (orbit, "turn the view"),
                ("Click", "keep a point, with its values in the Probe"),
                (key("palette"), "find any command by its name"),
                (key("keys"), "all keys and what the mouse does"),
            )
        )
