"""The panels that every window has, and who listens to whom among them."""

from __future__ import annotations

from PyQt6.QtCore import QTimer

from app.log_panel import LogBridge
from app.user_commands import select_path
from app.view_presenter import Overlays
from app.window_parts import DockSpec, Part, Side, Workbench


class PanelsPart(Part):
    """Docks of the panels; selections that travel between them."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self._list_soon = QTimer(bench.window)  # a level can have thousands: in an event of their own
        self._list_soon.setSingleShot(True)
        self._list_soon.setInterval(0)
        self._list_soon.timeout.connect(lambda: bench.panels.findings.set_findings(bench.document.findings))
        self._log = LogBridge(bench.window)
        self._log.attach()

    def docks(self) -> list[DockSpec]:
        """Settings left, display right, tables below the view."""
        panels = self.bench.panels
        return [
            DockSpec("Bake", panels.bake, Side.LEFT),
            DockSpec("Objects", panels.outliner, Side.LEFT),
            DockSpec("Display", panels.display, Side.RIGHT, scrolled=True),
            DockSpec("Marks", panels.overlays, Side.RIGHT, scrolled=True, seldom=True),
            DockSpec("Decorators", panels.decorators, Side.RIGHT, scrolled=True, seldom=True),
            DockSpec("Probe", panels.probe, Side.BOTTOM),
            DockSpec("Stages", panels.stages, Side.BOTTOM),
            DockSpec("Findings", panels.findings, Side.BOTTOM),
            DockSpec("Instances", panels.instances, Side.BOTTOM),
            DockSpec("Log", panels.log, Side.BOTTOM),
        ]

    def connect(self) -> None:
        """Joins panels, document and log."""
        bench, panels, document = self.bench, self.bench.panels, self.bench.document
        frame = bench.registry["frame"].trigger
        panels.overlays.overlays_changed.connect(self._on_overlays)
        panels.outliner.object_activated.connect(lambda _index: frame())
        panels.findings.object_chosen.connect(lambda path: select_path(document, path))
        panels.findings.object_activated.connect(lambda _path: frame())
        panels.instances.object_chosen.connect(document.select)
        panels.instances.object_activated.connect(lambda _index: frame())
        panels.decorators.table_requested.connect(self._show_instances)
        panels.probe.cleared.connect(lambda: bench.readouts.click(None))
        bench.banner.log_requested.connect(lambda: bench.show_panel("Log"))
        bench.engine.logged.connect(lambda level, name, text: panels.log.add(level, f"engine: {name}", text))
        self._log.line.connect(panels.log.add)
        document.opened.connect(self._list_soon.start)
        document.result_changed.connect(self._on_result)
        document.selection_changed.connect(self._on_selection)
        document.threshold_changed.connect(self._show_drawn)
        document.pinned_changed.connect(lambda: panels.probe.set_readout(document.pinned))

    def close(self) -> None:
        """Hears no more of the log."""
        self._list_soon.stop()
        self._log.detach()

    def _show_instances(self, kind: str) -> None:
        self.bench.panels.instances.set_kind(kind)
        self.bench.show_panel("Instances")

    def _on_selection(self) -> None:
        document = self.bench.document
        chosen = document.world is not None and document.selected >= 0
        path = document.world.object_paths[document.selected] if chosen and document.world is not None else ""
        self.bench.panels.findings.show_object(path)

    def _on_overlays(self, overlays: Overlays) -> None:
        self.bench.presenter.set_overlays(overlays)
        self.bench.registry["invalid"].setChecked(overlays.invalid)
        self._show_drawn()

    def _show_drawn(self) -> None:
        self.bench.panels.overlays.set_drawn(self.bench.presenter.drawn_note)

    def _on_result(self) -> None:
        self.bench.panels.stages.set_result(self.bench.document.result)
        self._list_soon.start()
