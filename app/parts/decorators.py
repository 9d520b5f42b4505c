"""Trees, shrubs and levels of detail: comparisons side by side, and values that take longer than a frame."""

from __future__ import annotations

import logging
from functools import partial

from app.actions import Action, ActionSpec
from app.latest_job import LatestJob, Work
from app.window_parts import Part, Workbench
from bake.errors import ObscuraError
from viewer.decorated import DecoratedValues
from viewer.decorator_view import TreeShading

logger = logging.getLogger(__name__)


class DecoratorsPart(Part):
    """What the window does about decorators besides drawing them."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self._job = LatestJob(bench.jobs, "tree values", self._prepare, self._on_values, self._on_failed)

    def actions(self) -> list[Action]:
        """The two comparisons."""
        return [
            (
                ActionSpec(
                    "tree-models",
                    "View",
                    "Compare tree &models",
                    "Global only, local × global and gold of the selected tree side by side",
                    ("M",),
                    True,
                    3,
                    needs=("tree-models",),
                ),
                self.compare_models,
            ),
            (
                ActionSpec(
                    "lod-levels",
                    "View",
                    "Compare &LODs",
                    "The levels of detail of the selected object beside its finest one, on one camera",
                    ("Alt+M",),
                    True,
                    3,
                    needs=("lods",),
                ),
                self.compare_lods,
            ),
        ]

    def connect(self) -> None:
        """Follows the document and its panel."""
        document, panel = self.bench.document, self.bench.panels.decorators
        panel.models_requested.connect(lambda: self.compare_models(True))
        panel.lods_requested.connect(lambda: self.compare_lods(True))
        for event in (document.decorators_changed, document.result_changed):
            event.connect(self._job.request)

    def compare_models(self, on: bool) -> None:
        """Shows the three models of the selected tree side by side, on a camera of their own."""
        area = self.bench.area
        if on and area.trees is None:
            area.compare_trees(self.bench.document).close_requested.connect(lambda: self.compare_models(False))
        elif not on and area.trees is not None:
            area.close_below()
        self._tick()

    def compare_lods(self, on: bool) -> None:
        """Shows the levels of the selected object, or of the first that has some, on a camera of their own."""
        area, bench = self.bench.area, self.bench
        if on and area.lods is None:
            widget = area.compare_lods(bench.document, bench.jobs)
            widget.close_requested.connect(lambda: self.compare_lods(False))
        elif not on and area.lods is not None:
            area.close_below()
        self._tick()

    def _tick(self) -> None:
        area, registry = self.bench.area, self.bench.registry
        registry["tree-models"].setChecked(area.trees is not None)
        registry["lod-levels"].setChecked(area.lods is not None)

    def _prepare(self) -> Work | None:
        """The values of all trees that the picture wants and does not have."""
        values, wanted = self.bench.document.values, self.bench.document.decorators.trees
        return None if values is None or values.ready(wanted) else partial(_made, values, wanted)

    def _on_values(self, made: tuple[DecoratedValues, TreeShading]) -> None:
        values, shading = made
        values.set_ready(shading)
        if values is self.bench.document.values:
            self.bench.document.decorators_changed.emit()

    def _on_failed(self, error: ObscuraError) -> None:
        logger.error("%s", error)
        self.bench.banner.show_message(logging.ERROR, str(error))


def _made(values: DecoratedValues, shading: TreeShading) -> tuple[DecoratedValues, TreeShading]:
    values.compute(shading)
    return values, shading
