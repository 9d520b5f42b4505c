"""Which actions can be used now, and what is said about those that cannot."""

from __future__ import annotations

from collections.abc import Callable

from app.rebake_layers import layers_of
from app.window_parts import Part, Workbench
from bake.types import Role
from viewer.decorator_view import TreeShading


class AvailabilityPart(Part):
    """Greys every action whose `needs` are not met, with the reason."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self._added: dict[str, tuple[Callable[[], bool], str]] = {}

    def add(self, name: str, is_met: Callable[[], bool], why: str) -> None:
        """Takes in a need that another part knows about.

        Args:
            name: As in `ActionSpec.needs`.
            is_met: Whether it is met now.
            why: What is said where it is not.
        """
        self._added[name] = (is_met, why)

    def connect(self) -> None:
        """Follows the document."""
        document = self.bench.document
        for event in (
            document.opened,
            document.world_changed,
            document.result_changed,
            document.selection_changed,
            document.pinned_changed,
            document.current_changed,
        ):
            event.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Looks at every action again."""
        conditions = self._conditions()
        met = {name: is_met() for name, (is_met, _) in conditions.items()}
        for spec in self.bench.registry.specs:
            missing = next((name for name in spec.needs if not met[name]), "")
            if spec.needs:
                self.bench.registry.enable(spec.id, not missing, conditions[missing][1] if missing else "")

    def _conditions(self) -> dict[str, tuple[Callable[[], bool], str]]:
        bench, document = self.bench, self.bench.document
        return {
            "scene": (lambda: document.world is not None, "open a scene first"),
            "result": (lambda: document.result is not None, "bake first"),
            "point": (lambda: document.pinned is not None, "click a point of the surface first"),
            "regions": (
                lambda: document.result is not None and document.result.regions is not None,
                "bake with regions first",
            ),
            "selection": (lambda: document.selected >= 0, "select an object first"),
            "scene-file": (
                lambda: document.world is not None and (document.current is None or not document.current.complaint),
                "the scene's file is not there",
            ),
            "layer": (
                lambda: any(layer.before is not None for layer in layers_of(bench.undo)),
                "rebake first",
            ),
            "lods": (
                lambda: (
                    bench.area.lods is not None
                    or (document.world is not None and Role.LOD in document.world.object_roles)
                ),
                "the scene has no levels of detail",
            ),
            "tree-models": (
                self._has_trees,
                "the result has no baked trees",
            ),
            **self._added,
        }

    def _has_trees(self) -> bool:
        document, is_open = self.bench.document, self.bench.area.trees is not None
        return is_open or (document.values is not None and document.values.has(TreeShading.PRODUCT))
