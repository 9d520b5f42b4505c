"""Runtime preview: the surface in the ambient light of a time of day, dimmed by AO as the game does it."""

from __future__ import annotations

from collections.abc import Sequence

from app.actions import Action, ActionSpec
from app.runtime_panel import RuntimePanel
from app.window_parts import DockSpec, Part, Side, Workbench
from viewer.fields import Quantity

PANEL = "Runtime"


class RuntimePart(Part):
    """The panel, the key, and the display that both change."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self.panel = RuntimePanel()

    def docks(self) -> Sequence[DockSpec]:
        """The panel, at the right."""
        return [DockSpec(PANEL, self.panel, Side.RIGHT, scrolled=True, shown=False)]

    def actions(self) -> Sequence[Action]:
        """Switching the preview on and off."""
        spec = ActionSpec(
            "runtime",
            "View",
            "In ambient l&ight",
            "Show what AO does in the running game: ambient light of a time of day × AO",
            ("U",),
            True,
            1,
            needs=("result",),
        )
        return [(spec, self.set_on)]

    def connect(self) -> None:
        """Follows the document."""
        document = self.bench.document
        self.panel.changed.connect(self._change)
        document.display_changed.connect(self._follow)
        document.result_changed.connect(self._follow)
        self._follow()

    def close(self) -> None:
        """Lets no more time pass."""
        self.panel.stop()

    def set_on(self, on: bool) -> None:
        """Switches the preview on at the time of the slider, or off."""
        self._change({"hour": self.panel.chosen_hour if on else None})

    def _change(self, changes: dict[str, object]) -> None:
        document = self.bench.document
        display = document.display.replaced(**changes)
        if changes.get("hour") is not None and display.quantity not in (Quantity.BLEND, Quantity.DISTANCE):
            display = display.replaced(quantity=Quantity.BLEND)
        document.set_display(display)

    def _follow(self) -> None:
        document = self.bench.document
        self.panel.fill(document.display, available=document.result is not None)
        self.bench.registry["runtime"].setChecked(document.display.hour is not None)
