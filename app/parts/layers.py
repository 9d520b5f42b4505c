"""The layers that bakes and rebakes make: compared in place, accepted and rejected object by object."""

from __future__ import annotations

import logging

from app.actions import Action, ActionSpec
from app.parts.availability import AvailabilityPart
from app.parts.comparison import ComparisonPart
from app.parts.rebake import RebakePart
from app.parts.results_history import ResultsHistoryPart
from app.parts.scene_watch import SceneWatchPart
from app.rebake_layers import Layer, LayerInfo, layers_of
from app.rebake_panel import RebakePanel
from app.window_parts import Part
from bake.errors import ObscuraError

logger = logging.getLogger(__name__)


class LayersPart(Part):
    """The list of layers in the Rebake panel, and the actions on them."""

    def actions(self) -> list[Action]:
        """What to do with layers."""
        layers, chosen = "Bake/Layers", ("result", "scene-file", "layer", "selection")
        return [
            (
                ActionSpec(
                    "layer-compare", layers, "&Compare", "See the chosen layer and what it replaced",
                    group=1, needs=("layer",),
                ),
                self._compare,
            ),
            (
                ActionSpec(
                    "layer-select", layers, "Select what c&hanged", "Select what the chosen layer changed",
                    group=1, needs=("layer",),
                ),
                self._select_changed,
            ),
            (
                ActionSpec(
                    "layer-reject", layers, "&Reject for selection",
                    "The selected objects get the values that they had before the chosen layer, and are stale",
                    group=1, context=("object",), needs=chosen,
                ),
                self.reject,
            ),
            (
                ActionSpec(
                    "layer-accept", layers, "Keep only for &selection",
                    "All others get the values that they had before the chosen layer, and are stale",
                    group=1, needs=chosen,
                ),
                lambda: self.reject(others=True),
            ),
        ]  # fmt: skip

    def connect(self) -> None:
        """Follows the undo stack and the choice in the list."""
        bench, panel = self.bench, self._panel
        names = ("layer-compare", "layer-select", "layer-reject", "layer-accept")
        panel.add_layer_buttons(
            [bench.registry[name] for name in names], ("Compare", "Select changed", "Reject", "Keep only")
        )
        bench.undo.indexChanged.connect(self.refresh)
        bench.document.result_changed.connect(self.refresh)
        self.refresh()

    def close(self) -> None:
        """Stops following."""
        self.bench.undo.indexChanged.disconnect(self.refresh)

    def refresh(self) -> None:
        """Lists the layers."""
        self._panel.show_layers(self._layers())
        self.bench.part(AvailabilityPart).refresh()

    def reject(self, *, others: bool = False) -> None:
        """Gives the selected objects, or all others, what they had before the chosen layer."""
        layer, document = self._layer(), self.bench.document
        result, folder = self.bench.part(SceneWatchPart).result, document.result_path
        if layer is None or layer.before is None or result is None or folder is None:
            text = "Choose a layer whose former result is still kept."
            self.bench.banner.show_message(logging.INFO, text)
            return
        if self.bench.engine.is_baking or self.bench.part(RebakePart).rebaker.is_busy:
            self.bench.banner.show_message(logging.INFO, "Wait for the bake to end, or cancel it first.")
            return
        chosen, before = set(self.bench.part(RebakePart).selected()), layer.before

        def work() -> int:
            from bake.rebake.mix import differing_objects, with_former
            from bake.results import load_result, save_result

            former = load_result(before, verify=False)
            paths = set(differing_objects(result, former)) - chosen if others else chosen
            mixed = with_former(result, former, paths)
            if mixed is result:
                return 0
            save_result(mixed, folder)
            return len(mixed.stale)

        word = "keep only some of" if others else "reject part of"
        self.bench.part(ResultsHistoryPart).next_step = (f"{word} “{layer.name}”", LayerInfo())
        self.bench.controller.about_to_bake.emit(folder)
        self.bench.jobs.run("reject layer", work, self._on_rejected, self._on_not_rejected)

    def _on_rejected(self, count: int) -> None:
        if count:
            self.bench.controller.reload_result(self.bench.controller.bake_ended.emit)
        else:
            self._not_changed("These objects have the same values in both, or other triangles.")

    def _on_not_rejected(self, error: ObscuraError) -> None:
        self._not_changed(str(error))

    def _not_changed(self, text: str) -> None:
        self.bench.controller.bake_ended.emit(False)
        self.bench.banner.show_message(logging.WARNING, text)

    @property
    def _panel(self) -> RebakePanel:
        return self.bench.part(RebakePart).panel

    def _layers(self) -> list[Layer]:
        return layers_of(self.bench.undo)

    def _layer(self) -> Layer | None:
        """The chosen layer, or the one in view."""
        layers, chosen = self._layers(), self._panel.chosen_layer()
        found = next((layer for layer in layers if layer.number == chosen), None)
        return found or next((layer for layer in layers if layer.state == "in view"), None)

    def _compare(self) -> None:
        layer = self._layer()
        if layer is not None and layer.before is not None:
            self.bench.part(ComparisonPart).open(layer.before, f"before “{layer.name}”")

    def _select_changed(self) -> None:
        layer, result = self._layer(), self.bench.part(SceneWatchPart).result
        if layer is None or layer.before is None or result is None:
            return
        before = layer.before

        def work() -> tuple[str, ...]:
            from bake.rebake.mix import differing_objects
            from bake.results import load_result

            return differing_objects(result, load_result(before, verify=False))

        self.bench.jobs.run("changed objects", work, self._select, lambda error: logger.warning("%s", error))

    def _select(self, paths: tuple[str, ...]) -> None:
        world = self.bench.document.world
        if world is not None:
            wanted = set(paths)
            self.bench.document.select_all(i for i, path in enumerate(world.object_paths) if path in wanted)
