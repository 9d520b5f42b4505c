"""The panels that every window has."""

from __future__ import annotations

from dataclasses import dataclass

from app.bake_panel import BakePanel
from app.decorator_panel import DecoratorPanel
from app.display_panel import DisplayPanel
from app.document import Document
from app.findings_table import FindingsTable
from app.instance_table import InstanceTable
from app.log_panel import LogPanel
from app.outliner import Outliner
from app.overlay_panel import OverlayPanel
from app.probe_panel import ProbePanel
from app.stage_table import StageTable


@dataclass(frozen=True, slots=True)
class Panels:
    """One of each panel."""

    bake: BakePanel
    outliner: Outliner
    display: DisplayPanel
    overlays: OverlayPanel
    decorators: DecoratorPanel
    probe: ProbePanel
    stages: StageTable
    findings: FindingsTable
    instances: InstanceTable
    log: LogPanel


def build_panels(document: Document) -> Panels:
    """Makes the panels of a window over its document."""
    return Panels(
        bake=BakePanel(document),
        outliner=Outliner(document),
        display=DisplayPanel(document),
        overlays=OverlayPanel(document),
        decorators=DecoratorPanel(document),
        probe=ProbePanel(),
        stages=StageTable(),
        findings=FindingsTable(),
        instances=InstanceTable(document),
        log=LogPanel(),
    )
