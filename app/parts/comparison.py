"""Two results at once: another folder, or the bake before, against the result in view."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

from app import dialogs
from app.actions import Action, ActionSpec
from app.compare_flight import fly_to_vertex
from app.compare_job import Compared, Wanted, compare
from app.compare_panel import MODES, CompareMode, ComparePanel
from app.compare_wipe import WipeLayer
from app.latest_job import LatestJob, Work
from app.parts.files import FilesPart
from app.parts.results_history import ResultsHistoryPart
from app.parts.views import ViewsPart
from app.window_parts import DockSpec, Part, Side, Workbench
from bake.errors import ObscuraError
from viewer.decorator_view import DecoratorView
from viewer.display import shown_field
from viewer.fields import Quantity, distance_label

PANEL = "Comparison"
BEFORE = "the bake before"
_MENU = "View/Compare results"


class ComparisonPart(Part):
    """Owns the other result and the way in which both are shown.

    Attributes:
        compared: The comparison in view; None while there is none.
        mode: How it is shown.
        flipped: Whether the other result stands in for this one.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self.panel = ComparePanel()
        self.compared: Compared | None = None
        self.mode = CompareMode.ONE
        self.flipped = False
        self.layer: WipeLayer | None = None
        self._path: Path | None = None
        self._name = ""
        self._column: int | None = None
        self._sent: Wanted | None = None
        self._stale = True
        self._setting = False
        self._former_look = (Quantity.BLEND, 0)
        self._job = LatestJob(bench.jobs, "comparison", self._prepare, self._on_compared, self._on_failed)

    def docks(self) -> Sequence[DockSpec]:
        """The table, below."""
        return [DockSpec(PANEL, self.panel, Side.BOTTOM, shown=False)]

    def actions(self) -> Sequence[Action]:
        """Beginning, showing and ending a comparison."""
        return [
            (
                ActionSpec(
                    "compare-result", _MENU, "With &result …", "Choose another result of this scene", group=3,
                    needs=("result",),
                ),
                self._ask,
            ),
            (
                ActionSpec("compare-before", _MENU, "With the &bake before", "See what the last bake changed", group=3),
                self.open_before,
            ),
            *[
                (
                    ActionSpec(f"compare-{mode.value}", _MENU, text, tip, checkable=True, group=3),
                    lambda _on, mode=mode: self.set_mode(mode),
                )
                for mode, text, tip in MODES
            ],
            (
                ActionSpec("compare-flip", _MENU, "&Flicker", "Show the other result instead", ("O",), True, 3),
                self.flip,
            ),
            (ActionSpec("compare-end", _MENU, "&End comparison", "Show this result alone again", group=3), self.end),
        ]  # fmt: skip

    def connect(self) -> None:
        """Follows the document, bakes and the panel."""
        bench, document, panel = self.bench, self.bench.document, self.panel
        panel.folder_requested.connect(self._ask)
        panel.before_requested.connect(self.open_before)
        panel.end_requested.connect(self.end)
        panel.mode_chosen.connect(lambda name: self.set_mode(CompareMode(name)))
        panel.flip_changed.connect(self.flip)
        panel.column_chosen.connect(self._on_column)
        panel.row_chosen.connect(self._on_row)
        document.opened.connect(self.end)
        document.result_changed.connect(self._on_result)
        document.field_changed.connect(self._on_field)
        document.decorators_changed.connect(self._on_field)
        document.display_changed.connect(self._on_display)
        document.visibility_changed.connect(self._on_faces)
        document.selection_changed.connect(lambda: panel.table.show_chosen(document.selected))
        bench.undo.indexChanged.connect(self._refresh)
        bench.controller.bake_ended.connect(self._on_baked)
        bench.registry["compare"].toggled.connect(self._on_mappings)
        self._refresh()

    def close(self) -> None:
        """Takes the second result out of the views."""
        self.bench.undo.indexChanged.disconnect(self._refresh)
        self.end()

    def open(self, path: Path, name: str = "") -> None:
        """Compares the result in view with that of a folder.

        Args:
            path: The other result.
            name: What it is called; by default the folder's name.
        """
        if self.bench.document.result is None:
            return
        self.bench.show_panel(PANEL)
        self._path, self._name, self._sent = path.resolve(), name or path.name, None
        if self.compared is None:
            self.panel.set_message(f"Reading {self._name} …")
        self._job.request()

    def open_before(self) -> None:
        """Compares with what the last bake replaced."""
        former = self.bench.part(ResultsHistoryPart).former()
        if former is not None:
            self.open(former, BEFORE)

    def end(self) -> None:
        """Shows this result alone again."""
        self._path, self._sent = None, None
        self.panel.set_message()
        if self.compared is not None:
            self.compared = None
            self.flipped = False
            self._show_mode(CompareMode.ONE)
            if self.layer is not None:
                self.layer.close()
                self.layer = None
            self.bench.presenter.caption_of = None
            self.bench.document.set_other(None)
        self._refresh()

    def set_mode(self, mode: CompareMode) -> None:
        """Shows both results in another way."""
        if self.compared is not None:
            self.flipped = False
            self._show_mode(mode)
        self._refresh()

    def flip(self, on: bool) -> None:
        """Shows the other result in the place of this one, or this one again."""
        if self.compared is None:
            self._refresh()
            return
        if on and self.mode in (CompareMode.DIFFERENCE, CompareMode.WIPE):
            self._show_mode(CompareMode.ONE)
        self.flipped = on
        self._show_layer()
        self._set_captions()
        self._refresh()

    # What is shown

    def _show_mode(self, mode: CompareMode) -> None:
        bench, document = self.bench, self.bench.document
        self.mode = mode
        self._setting = True
        display = document.display
        if (
            mode is CompareMode.DIFFERENCE
            and display.quantity is not Quantity.DIFFERENCE
            and document.result is not None
        ):
            self._former_look = (display.quantity, display.column)
            distances = document.result.settings.column_distances
            column = display.column if display.quantity is Quantity.DISTANCE else distances.index(max(distances))
            document.set_display(display.replaced(quantity=Quantity.DIFFERENCE, column=column, difference_range=None))
        elif mode is not CompareMode.DIFFERENCE and display.quantity is Quantity.DIFFERENCE:
            quantity, column = self._former_look
            document.set_display(display.replaced(quantity=quantity, column=column))
        self._setting = False
        bench.part(ViewsPart).split(mode is CompareMode.SIDE)
        self._show_layer()
        self._set_captions()

    def _show_layer(self) -> None:
        wanted = self.compared is not None and (self.flipped or self.mode is CompareMode.WIPE)
        if wanted:
            if self.layer is None:
                self.layer, self._stale = WipeLayer(self.bench.area.main), True
            self._draw_layer()
            self.layer.show(line=not self.flipped)
        elif self.layer is not None:
            self.layer.hide()

    def _draw_layer(self) -> None:
        document = self.bench.document
        if self.layer is None or not self._stale or self.compared is None or document.result is None:
            return
        self._stale = False
        display = document.display
        if display.quantity is Quantity.INSPECTION:
            display = display.replaced(quantity=Quantity.BLEND)
        self.layer.draw(shown_field(display, document.result, self.compared.field), display)

    def _set_captions(self) -> None:
        viewports = self.bench.area.viewports
        for number, viewport in enumerate(viewports):
            viewport.set_caption(self._caption(number) if self.compared is not None else "")

    def _caption(self, number: int) -> str:
        this, other = self._this(), self._name
        if self.mode is CompareMode.WIPE:
            return f"Left: {this}  ·  right: {other}"
        if self.mode is CompareMode.DIFFERENCE:
            return f"{this}  −  {other}"
        return f"Other: {other}" if number == 1 or self.flipped else f"This: {this}"

    def _this(self) -> str:
        path = self.bench.document.result_path
        return path.name if path is not None and self._name != BEFORE else "this bake"

    # What is compared

    def _prepare(self) -> Work | None:
        document, path = self.bench.document, self._path
        result, field, values = document.result, document.field, document.values
        if path is None or result is None or field is None or values is None:
            return None
        distances = result.settings.column_distances
        if self._column is None or self._column >= len(distances):
            self._column = distances.index(max(distances))
        coloring = DecoratorView(trees=document.decorators.trees, scalars=document.decorators.scalars)
        share = document.display.short_share if self._column < 0 else 0.0
        wanted = Wanted(path, result, field, values, coloring, self._column, share)
        if wanted.same_as(self._sent):
            return None
        self._sent = wanted
        known = self.compared
        other = known.other if known is not None else None
        kept = known.field if known is not None and known.wanted.coloring == coloring else None
        return lambda: compare(wanted, other, kept)

    def _on_compared(self, compared: Compared) -> None:
        document = self.bench.document
        if self._path != compared.wanted.path or document.result is not compared.wanted.result:
            return
        first = self.compared is None
        known = None if self.compared is None else self.compared.field
        self.compared = compared
        distances = compared.wanted.result.settings.column_distances
        self.panel.set_distances([distance_label(metres) for metres in distances], compared.wanted.column)
        self.panel.set_compared(compared, self._this(), self._name)
        self.bench.presenter.caption_of = self._caption
        if first:
            views = self.bench.part(ViewsPart)
            if self.bench.registry["compare"].isChecked():
                views.compare(False)
        if compared.field is not known or document.other is not compared.field:
            self._stale = True
            document.set_other(compared.field, self._name)
        self._show_mode(CompareMode.SIDE if first else self.mode)
        self._refresh()

    def _on_failed(self, error: ObscuraError) -> None:
        self.end()
        self.panel.set_message(str(error))
        self.bench.banner.show_message(logging.ERROR, str(error))

    # What happens elsewhere

    def _on_result(self) -> None:
        if self.bench.document.result is None:
            self.end()
        elif self._path is not None:
            self._stale = True
            self._job.request()
        self._refresh()

    def _on_baked(self, replaced: bool) -> None:
        if replaced and self._name == BEFORE and self._path is not None:
            self.open_before()
        self._refresh()

    def _on_field(self) -> None:
        if self._path is not None:
            self._job.request()
        self._redraw()

    def _on_display(self) -> None:
        if self.compared is None or self._setting:
            return
        is_difference = self.bench.document.display.quantity is Quantity.DIFFERENCE
        if is_difference != (self.mode is CompareMode.DIFFERENCE) and self.mode is not CompareMode.SIDE:
            self._show_mode(CompareMode.DIFFERENCE if is_difference else CompareMode.ONE)
            self._refresh()
        self._redraw()
        if self._column is not None and self._column < 0:
            self._job.request()

    def _redraw(self) -> None:
        self._stale = True
        if self.layer is not None and self.layer.is_shown:
            self._draw_layer()

    def _on_faces(self) -> None:
        if self.layer is not None:
            self.layer.show_faces()

    def _on_mappings(self, on: bool) -> None:
        if on:
            self.end()

    def _on_column(self, column: int) -> None:
        self._column = column
        self._job.request()

    def _on_row(self, row: int) -> None:
        if self.compared is not None:
            worst = self.compared.changes.worst
            if row < len(worst):
                fly_to_vertex(self.bench, row, int(worst[row]))

    def _ask(self) -> None:
        path = dialogs.ask_for_result(self.bench.window, self.bench.part(FilesPart).last_folder())
        if path is not None:
            self.open(path)

    def _refresh(self) -> None:
        registry, on = self.bench.registry, self.compared is not None
        for mode, _, _ in MODES:
            registry[f"compare-{mode.value}"].setChecked(on and self.mode is mode)
            registry.enable(f"compare-{mode.value}", on, "compare with a result first")
        for name in ("compare-flip", "compare-end"):
            registry.enable(name, on, "compare with a result first")
        registry["compare-flip"].setChecked(self.flipped)
        has_result = self.bench.document.result is not None
        before = has_result and self.bench.part(ResultsHistoryPart).former() is not None
        registry.enable("compare-before", before, "bake again first")
        self.panel.set_available(result=has_result, before=before)
        self.panel.set_mode(self.mode)
