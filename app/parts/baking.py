"""Baking, cancelling and what is said about it meanwhile."""

from __future__ import annotations

import logging
import time

from app.actions import Action, ActionSpec
from app.controller import OTHER_MAPPING, THRESHOLD
from app.undo_step import Step
from app.window_parts import Part, Workbench


class BakingPart(Part):
    """The Bake menu and the line of progress."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self._began: float | None = None

    @property
    def seconds(self) -> float:
        """How long the running bake has run; 0 without one."""
        return time.monotonic() - self._began if self._began is not None else 0.0

    def actions(self) -> list[Action]:
        """Bake, cancel, copy as command."""
        menu, panel = "Bake", self.bench.panels.bake
        return [
            (
                ActionSpec(
                    "bake", menu, "&Bake", "Bake with the settings of the panel", ("Ctrl+B", "F5"), needs=("scene",)
                ),
                panel.request_bake,
            ),
            (
                ActionSpec(
                    "cancel", menu, "&Cancel", "Stop the bake; without one, let go of the clicked point", ("Escape",)
                ),
                self._escape,
            ),
            (
                ActionSpec(
                    "copy-command",
                    "Bake/Copy as command",
                    "Copy &bake as command",
                    "The command line that bakes with the settings of the panel",
                    ("Ctrl+Shift+C",),
                    group=2,
                    needs=("scene",),
                ),
                panel.copy_command,
            ),
        ]

    def connect(self) -> None:
        """Joins the bake's panel, the controller and the line of progress."""
        bench, controller, panel = self.bench, self.bench.controller, self.bench.panels.bake
        controller.message.connect(bench.banner.show_message)
        controller.busy.connect(self._on_busy)
        controller.baking.connect(self._on_baking)
        controller.progressed.connect(bench.progress.set_progress)
        controller.cancelling.connect(bench.progress.set_cancelling)
        controller.solving.connect(self._on_solving)
        bench.progress.cancel_requested.connect(controller.cancel)
        panel.cancel_requested.connect(controller.cancel)
        panel.bake_requested.connect(controller.bake)
        panel.command_copied.connect(lambda text: bench.banner.show_message(logging.INFO, f"Copied: {text}"))
        bench.panels.overlays.threshold_settled.connect(controller.solve_threshold)
        bench.panels.overlays.threshold_kept.connect(self._keep_threshold)
        bench.document.opened.connect(bench.banner.hide)

    def _escape(self) -> None:
        if self.bench.engine.is_baking:
            self.bench.controller.cancel()
        elif not any(part.escape() for part in self.bench.parts):
            self.bench.readouts.click(None)

    def _keep_threshold(self, threshold: float) -> None:
        panel = self.bench.panels.bake
        settings = panel.settings()
        if settings is None:
            panel.set_threshold(threshold)
        elif settings.back_face_threshold != threshold:
            before = settings.back_face_threshold
            self.bench.undo.push(
                Step(
                    f"bake with threshold {threshold:.1%}",
                    redo=lambda: panel.set_threshold(threshold),
                    undo=lambda: panel.set_threshold(before),
                )
            )
        self.bench.show_panel("Bake")

    def _on_busy(self, what: str) -> None:
        if what:
            self.bench.progress.begin(what)
        elif self._began is None:
            self.bench.progress.end()

    def _on_baking(self, on: bool) -> None:
        self._began = time.monotonic() if on else None
        self.bench.panels.bake.set_baking(on)
        if not on:
            self.bench.progress.end()

    def _on_solving(self, purpose: str, on: bool) -> None:
        if purpose == THRESHOLD:
            self.bench.panels.overlays.set_solving(on)
        elif purpose == OTHER_MAPPING and not on:
            self.bench.panels.display.refresh()
