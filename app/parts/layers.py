"""The layers that bakes and rebakes make: compared in place, accepted and rejected by object, region or triangle."""

from __future__ import annotations

import enum
import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from app.actions import Action, ActionSpec
from app.parts.availability import AvailabilityPart
from app.parts.comparison import ComparisonPart
from app.parts.faces import FacesPart
from app.parts.history import HistoryPart
from app.parts.rebake import RebakePart
from app.parts.results_history import ResultsHistoryPart
from app.parts.scene_watch import SceneWatchPart
from app.rebake_layers import Layer, LayerInfo, layers_of
from app.rebake_panel import RebakePanel
from app.region_part import RegionsPart
from app.setting_difference import difference_text
from app.window_parts import Part
from bake.errors import ObscuraError
from bake.types import BakeResult, BoolArray, Int32Array, World

logger = logging.getLogger(__name__)


class Some(enum.Enum):
    """To what of a layer something is done."""

    OBJECTS = "selection"
    REGION = "region"
    FACES = "triangles"


@dataclass(frozen=True, slots=True)
class _Mixed:
    """What became of a layer that was turned down in part.

    Attributes:
        stale: Objects that are stale now; 0 if nothing was changed.
        vertices: Vertices whose value is another one.
    """

    stale: int
    vertices: int


class LayersPart(Part):
    """The list of layers in the Rebake panel, and the actions on them."""

    _busy = False

    def actions(self) -> list[Action]:
        """What to do with layers."""
        layers, chosen = "Bake/Layers", ("result", "scene-file", "layer")
        bench = self.bench
        # Before anything is connected: what is needed has to be known when the actions are first greyed.
        bench.part(AvailabilityPart).add("region", lambda: self._region() >= 0, "select a region first")
        bench.part(AvailabilityPart).add("stale", lambda: bool(self._stale()), "nothing is stale")
        needs = {Some.OBJECTS: "selection", Some.REGION: "region", Some.FACES: "faces"}
        whose = {
            Some.OBJECTS: "The selected objects",
            Some.REGION: "Triangles in the selected region",
            Some.FACES: "The chosen triangles",
        }
        found: list[Action] = [
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
                    "select-stale", "Edit", "Select what is s&tale", "Select what has changed since the bake",
                    group=1, needs=("stale",),
                ),
                lambda: self._select(tuple(self._stale())),
            ),
        ]  # fmt: skip
        for some in Some:
            name = "" if some is Some.OBJECTS else f"-{some.value}"
            context = ("object",) if some is Some.OBJECTS else ()
            found += [
                (
                    ActionSpec(
                        f"layer-reject{name}", layers, f"&Reject for {some.value}",
                        f"{whose[some]} get the values that they had before the chosen layer, and are stale",
                        group=2, context=context, needs=(*chosen, needs[some]),
                    ),
                    lambda some=some: self.reject(some),
                ),
                (
                    ActionSpec(
                        f"layer-accept{name}", layers, f"Keep only for {some.value}",
                        f"All but {whose[some][0].lower()}{whose[some][1:]} get the values that they had before the "
                        "chosen layer, and are stale",
                        group=3, needs=(*chosen, needs[some]),
                    ),
                    lambda some=some: self.reject(some, others=True),
                ),
            ]  # fmt: skip
        return found

    def connect(self) -> None:
        """Follows the undo stack, the choice in the list, and what would be rebaked with other settings."""
        bench, panel, registry = self.bench, self._panel, self.bench.registry
        names = ("", "-region", "-triangles")
        panel.add_layer_buttons([registry["layer-compare"], registry["layer-select"]], ("Compare", "Select changed"))
        panel.add_layer_rows(
            [
                ("Reject", [registry[f"layer-reject{name}"] for name in names]),
                ("Keep only", [registry[f"layer-accept{name}"] for name in names]),
            ],
            ("Selection", "Region", "Triangles"),
        )
        panel.layer_activated.connect(registry["layer-compare"].trigger)
        panel.stale_asked.connect(registry["select-stale"].trigger)
        bench.undo.indexChanged.connect(self.refresh)
        bench.document.result_changed.connect(self.refresh)
        bench.document.result_changed.connect(self._show_settings)
        bench.panels.bake.form.changed.connect(self._show_settings)
        bench.part(RegionsPart).state.view_changed.connect(bench.part(AvailabilityPart).refresh)
        self.refresh()
        self._show_settings()

    def close(self) -> None:
        """Stops following."""
        self.bench.undo.indexChanged.disconnect(self.refresh)
        self.bench.part(RegionsPart).state.view_changed.disconnect(self.bench.part(AvailabilityPart).refresh)

    def refresh(self) -> None:
        """Lists the layers."""
        self._panel.show_layers(self._layers())
        self.bench.part(AvailabilityPart).refresh()

    def reject(self, some: Some = Some.OBJECTS, *, others: bool = False) -> None:
        """Gives some of the surface, or all the rest of it, what it had before the chosen layer.

        Args:
            some: The selected objects, what lies in the selected region, or the chosen triangles.
            others: All but these.
        """
        layer, document = self._layer(), self.bench.document
        result, folder = self.bench.part(SceneWatchPart).result, document.result_path
        if layer is None or layer.before is None or result is None or folder is None:
            text = "Choose a layer whose former result is still kept."
            self.bench.banner.show_message(logging.INFO, text)
            return
        if self._busy or self.bench.engine.is_baking or self.bench.part(RebakePart).rebaker.is_busy:
            self.bench.banner.show_message(logging.INFO, "Wait for the bake to end, or cancel it first.")
            return
        before, chooses = layer.before, self._chooser(some, result)

        def work() -> _Mixed:
            from bake.rebake.mix import differing_objects, differing_vertices, with_former
            from bake.results import load_result, save_result

            former = load_result(before, verify=False)
            chosen = chooses(result.world)
            if some is Some.OBJECTS and not others:
                owners = np.unique(np.asarray(result.world.face_object)[chosen])
                mixed = with_former(result, former, [result.world.object_paths[owner] for owner in owners])
            else:
                paths = differing_objects(result, former, least=0.0)
                mixed = with_former(result, former, paths, faces=~chosen if others else chosen)
            if mixed is result:
                return _Mixed(0, 0)
            save_result(mixed, folder)
            return _Mixed(len(mixed.stale), differing_vertices(mixed, result))

        verb, where = "keep only" if others else "reject", self._where(some)
        name = f"{verb} “{layer.name}” {where}"
        self.bench.controller.about_to_bake.emit(folder)
        self.bench.controller.busy.emit("Putting former values back")
        self.bench.part(HistoryPart).set_waiting(True)
        self._busy = True
        take = lambda mixed: self._on_rejected(mixed, name)  # noqa: E731
        self.bench.jobs.run("reject layer", work, take, self._on_not_rejected)

    def _chooser(self, some: Some, result: BakeResult) -> Callable[[World], BoolArray]:
        """What finds the triangles meant, shape (m,), in the result's world."""
        if some is Some.OBJECTS:
            wanted = set(self.bench.part(RebakePart).selected())
            return lambda world: np.array([path in wanted for path in world.object_paths], bool)[world.face_object]
        if some is Some.FACES:
            chosen = self.bench.part(FacesPart).by_object()
            return lambda world: _of_objects(world, chosen)
        graph, region = self.bench.part(RegionsPart).state.regions, self._region()
        assert graph is not None
        low, high = graph.graph.minimum[region], graph.graph.maximum[region]

        def within(world: World) -> BoolArray:
            from bake.rebake.mix import faces_within

            return faces_within(world, low, high)

        return within

    def _where(self, some: Some) -> str:
        if some is Some.OBJECTS:
            paths = self.bench.part(RebakePart).selected()
            return f"for {paths[0].rpartition('/')[2]}" if len(paths) == 1 else f"for {len(paths):,} objects"
        if some is Some.FACES:
            return f"for {int(self.bench.part(FacesPart).chosen.sum()):,} triangles"
        regions = self.bench.part(RegionsPart).state.regions
        return "" if regions is None else f"in {regions.graph.names[self._region()]}"

    def _region(self) -> int:
        """The selected region, -1 for none."""
        state = self.bench.part(RegionsPart).state
        region = -1 if state.regions is None else state.view.region
        return region if state.regions is not None and region < len(state.regions.graph) else -1

    def _stale(self) -> frozenset[str]:
        current, world = self.bench.document.current, self.bench.document.world
        return frozenset() if current is None or world is None else (current.stale | current.new) - current.gone

    def _show_settings(self) -> None:
        result, wanted = self.bench.document.result, self.bench.panels.bake.settings()
        text = "" if result is None or wanted is None else difference_text(result.settings, wanted)
        self._panel.show_settings(text)

    def _on_rejected(self, mixed: _Mixed, name: str) -> None:
        self._end_waiting()
        if mixed.stale:
            self.bench.part(ResultsHistoryPart).next_step = (name, LayerInfo(mixed.vertices))
            self.bench.controller.reload_result(self.bench.controller.bake_ended.emit)
        else:
            self._not_changed("There the values are the same in both, or the triangles are others.")

    def _on_not_rejected(self, error: ObscuraError) -> None:
        self._end_waiting()
        self._not_changed(str(error))

    def _end_waiting(self) -> None:
        self._busy = False
        self.bench.controller.busy.emit("")
        self.bench.part(HistoryPart).set_waiting(False)

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


def _of_objects(world: World, chosen: Mapping[str, Int32Array]) -> BoolArray:
    """Triangles that are numbered within their objects, shape (m,), in a world."""
    found = np.zeros(world.face_count, bool)
    place = {path: number for number, path in enumerate(world.object_paths)}
    for path, numbers in chosen.items():
        if path in place:
            first, end = (int(world.first_face[place[path] + step]) for step in (0, 1))
            found[first + numbers[numbers < end - first]] = True
    return found
