"""Which actions can be used now, and what is said about those that cannot."""

from __future__ import annotations

from collections.abc import Callable

from app.window_parts import Part
from viewer.decorator_view import TreeShading


class AvailabilityPart(Part):
    """Greys every action whose `needs` are not met, with the reason."""

    def connect(self) -> None:
        """Follows the document."""
        document = self.bench.document
        for event in (document.opened, document.world_changed, document.result_changed, document.selection_changed):
            event.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Looks at every action again."""
        met = {name: is_met() for name, (is_met, _) in self._conditions().items()}
        for spec in self.bench.registry.specs:
            missing = next((name for name in spec.needs if not met[name]), "")
            if spec.needs:
                self.bench.registry.enable(spec.id, not missing, self._conditions()[missing][1] if missing else "")

    def _conditions(self) -> dict[str, tuple[Callable[[], bool], str]]:
        document = self.bench.document
        return {
            "scene": (lambda: document.world is not None, "open a scene first"),
            "result": (lambda: document.result is not None, "bake first"),
            "selection": (lambda: document.selected >= 0, "select an object first"),
            "scene-file": (
                lambda: document.world is not None and document.scene_path is not None and document.scene_path.exists(),
                "the scene's file is not there",
            ),
            "tree-models": (
                self._has_trees,
                "the result has no baked trees",
            ),
        }

    def _has_trees(self) -> bool:
        document, is_open = self.bench.document, self.bench.area.trees is not None
        return is_open or (document.values is not None and document.values.has(TreeShading.PRODUCT))
