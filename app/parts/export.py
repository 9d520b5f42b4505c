"""File → Export: the result for other tools."""

from __future__ import annotations

import logging
from pathlib import Path

from app import dialogs
from app.actions import Action, ActionSpec
from app.command import result_command
from app.parts.command_lines import CommandLinesPart
from app.parts.files import FilesPart
from app.window_parts import Part
from bake.errors import ObscuraError
from bake.types import Finding


class ExportPart(Part):
    """Writes results in the formats of other tools, off the window's thread."""

    def actions(self) -> list[Action]:
        """Export."""
        return [
            (
                ActionSpec(
                    "export",
                    "File",
                    "&Export …",
                    "Write the result for other tools: glTF, NumPy, PLY, OBJ, raw",
                    ("Ctrl+E",),
                    group=2,
                    needs=("result",),
                ),
                self.ask,
            )
        ]

    def ask(self) -> None:
        """Asks for a file and exports."""
        result = self.bench.document.result
        if result is not None:
            suggestion = self.bench.part(FilesPart).last_folder() / f"{result.scene_path.stem}-ao.glb"
            target = dialogs.ask_for_export(self.bench.window, suggestion)
            if target is not None:
                self.export(target)

    def export(self, target: Path) -> None:
        """Exports to a file whose suffix decides the format."""
        result, folder = self.bench.document.result, self.bench.document.result_path
        if result is None or folder is None:
            return

        def work() -> tuple[Finding, ...]:
            from app.commands.export import export_result

            return export_result(result, target)

        self.bench.controller.busy.emit(f"Exporting to {target.name}")
        self.bench.jobs.run(
            "export",
            work,
            lambda findings: self._on_done(target, result_command("export", folder, target), findings),
            self._on_error,
        )

    def _on_done(self, target: Path, command: str, findings: tuple[Finding, ...]) -> None:
        self.bench.controller.busy.emit("")
        for finding in findings:
            self.bench.panels.log.add(logging.WARNING, "export", f"{finding.object}: {finding.detail}")
        level = logging.WARNING if findings else logging.INFO
        more = f"; {len(findings):,} things it could not express are in the log" if findings else ""
        self.bench.part(CommandLinesPart).say_done(f"Exported to {target}{more}", command, level=level)

    def _on_error(self, error: ObscuraError) -> None:
        self.bench.controller.busy.emit("")
        self.bench.banner.show_message(logging.ERROR, str(error))
