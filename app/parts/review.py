"""File → Save review page: the report of the result with the picture in view."""

from __future__ import annotations

import logging
from pathlib import Path

from PyQt6.QtCore import QBuffer, QIODevice

from app import dialogs
from app.actions import Action, ActionSpec
from app.command import result_command
from app.parts.command_lines import CommandLinesPart
from app.parts.files import FilesPart
from app.review_page import Review, write_review
from app.window_parts import Part
from bake.errors import ObscuraError
from viewer.fields import Quantity, distance_label

_QUALITY = 92


class ReviewPart(Part):
    """Writes pages for reviews."""

    def actions(self) -> list[Action]:
        """Save review page."""
        return [
            (
                ActionSpec(
                    "save-review",
                    "File",
                    "Save re&view page …",
                    "One HTML page with the picture in view and the report of the result",
                    ("Ctrl+Shift+S",),
                    group=2,
                    needs=("result",),
                ),
                self.ask,
            )
        ]

    def ask(self) -> None:
        """Asks for a file and writes the page."""
        document = self.bench.document
        if document.result is None:
            return
        name = f"{document.result.scene_path.stem}-review.html"
        target = dialogs.ask_for_page(self.bench.window, self.bench.part(FilesPart).last_folder() / name)
        if target is not None:
            self.save(target)

    def save(self, target: Path, *, with_pictures: bool = True) -> None:
        """Writes the page, off the window's thread."""
        folder = self.bench.document.result_path
        if folder is None or self.bench.document.result is None:
            return
        review = self.review()
        self.bench.controller.busy.emit(f"Writing {target.name}")
        self.bench.jobs.run(
            "review page",
            lambda: write_review(folder, target, review, with_pictures=with_pictures),
            self._on_saved,
            self._on_error,
        )

    def review(self) -> Review:
        """What is in view now."""
        document = self.bench.document
        buffer = QBuffer()
        buffer.open(QIODevice.OpenModeFlag.WriteOnly)
        self.bench.area.picture().save(buffer, "JPEG", _QUALITY)
        notes = [] if document.pinned is None else list(document.pinned.rows())
        world = document.world
        if world is not None and document.selection:
            paths = [world.object_paths[index] for index in document.selection]
            more = f" and {len(paths) - 5:,} more" if len(paths) > 5 else ""
            notes.append(("Selected", ", ".join(paths[:5]) + more))
        stale = document.current.summary() if document.current is not None else ""
        return Review(bytes(buffer.data().data()), self._caption(), notes, stale)

    def _caption(self) -> str:
        document = self.bench.document
        display, result = document.display, document.result
        if result is None:
            return ""
        words = {
            Quantity.BLEND: "AO, blended",
            Quantity.DISTANCE: f"AO at {distance_label(result.settings.column_distances[display.column])}",
            Quantity.GEOMETRY: "geometry",
        }
        preview = f", threshold {document.threshold:.1%}, not stored" if document.is_preview else ""
        return words.get(display.quantity, display.quantity.name.lower()) + preview

    def _on_saved(self, target: Path) -> None:
        self.bench.controller.busy.emit("")
        folder = self.bench.document.result_path
        command = "" if folder is None else result_command("report", folder, "-o", target)
        self.bench.part(CommandLinesPart).say_done(f"Review page saved to {target}", command)

    def _on_error(self, error: ObscuraError) -> None:
        self.bench.controller.busy.emit("")
        self.bench.banner.show_message(logging.ERROR, str(error))
