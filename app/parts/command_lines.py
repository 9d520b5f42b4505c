"""Copy as command: the command line that does what the window does, for scripts and other machines."""

from __future__ import annotations

import logging
from collections.abc import Callable

from PyQt6.QtWidgets import QApplication

from app.actions import Action, ActionSpec
from app.command import result_command
from app.window_parts import Part

_MENU = "Bake/Copy as command"


class CommandLinesPart(Part):
    """Puts command lines on the clipboard."""

    def actions(self) -> list[Action]:
        """One for each job on a stored result; that of the bake is the bake's own."""
        jobs: tuple[tuple[str, str, str, tuple[str, ...], Callable[[], str]], ...] = (
            ("explain", "Copy e&xplain as command", "Explains the clicked point", ("result", "point"), self.explain),
            ("export", "Copy e&xport as command", "Exports the result as glTF", ("result",), self.export),
            ("report", "Copy &report as command", "Writes the report of the result", ("result",), self.report),
            ("regions", "Copy re&gions as command", "Lists the regions of the result", ("regions",), self.regions),
            ("walk", "Copy &walk as command", "Walks a tour of the regions", ("regions",), self.walk),
        )
        return [
            (
                ActionSpec(f"copy-{name}", _MENU, text, f"{tip}, on the command line", group=2, needs=needs),
                lambda line=line: self.copy(line()),
            )
            for name, text, tip, needs, line in jobs
        ]

    def copy(self, text: str) -> None:
        """Puts a command line on the clipboard and says so."""
        clipboard = QApplication.clipboard()
        if text and clipboard is not None:
            clipboard.setText(text)
            self.bench.banner.show_message(logging.INFO, f"Copied: {text}")

    def say_done(self, text: str, command: str, *, level: int = logging.INFO) -> None:
        """Says that a job is done, and offers its command line."""
        self.bench.banner.show_message(level, text, {"Copy as command": lambda: self.copy(command)})

    def explain(self) -> str:
        """Explains the clicked point."""
        pinned = self.bench.document.pinned
        if pinned is None:
            return ""
        point = ",".join(f"{value:.6g}" for value in pinned.position)
        return self._line("explain", f"--point={point}")

    def export(self) -> str:
        """Exports the result."""
        return self._line("export", f"{self._stem()}-ao.glb")

    def report(self) -> str:
        """Writes the report."""
        return self._line("report", "-o", f"{self._stem()}.html")

    def regions(self) -> str:
        """Lists the regions."""
        return self._line("regions")

    def walk(self) -> str:
        """Walks a tour."""
        return self._line("walk")

    def _stem(self) -> str:
        result = self.bench.document.result
        return result.scene_path.stem if result is not None else "result"

    def _line(self, command: str, *words: str) -> str:
        folder = self.bench.document.result_path
        return "" if folder is None else result_command(command, folder, *words)
