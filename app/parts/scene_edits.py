"""What the user says about objects and settings, written to the scene's side file; every edit can be undone."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from app.actions import Action, ActionSpec
from app.parts.scene_watch import SceneWatchPart
from app.undo_step import Step
from app.window_parts import Part, Workbench
from bake.errors import ObscuraError
from bake.types import Role

if TYPE_CHECKING:
    from bake.scene.side_file_writer import SideFileEdit

_ROLE_TIPS = {
    Role.STATIC: "Blocks light and gets values at its vertices",
    Role.BLOCKER: "Blocks light, gets no values",
    Role.RECEIVER: "Gets values, blocks no light",
    Role.TREE: "Each hit takes part of the light; local values by global ones",
    Role.SHRUB: "A box of fog, and one value for all of it",
    Role.SMALL: "Blocks no light, one value for all of it",
    Role.IGNORE: "Is not there for the bake",
}
_RUN_ONLY = ("device", "tracer")
"""Settings of a machine rather than of a scene."""


class SceneEditsPart(Part):
    """Writes to the side file: one edit at a time, in order, each a step of the undo stack."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__(bench)
        self._waiting: deque[tuple[Callable[[], SideFileEdit], str]] = deque()
        self._planning = self._pushing = False

    def actions(self) -> list[Action]:
        """Roles, and settings to keep with the scene."""
        menu, needs = "Edit/Role", ("selection", "scene-file")
        found: list[Action] = [
            (
                ActionSpec(
                    f"role-{role.value}", menu, role.value.capitalize(), tip, group=3, context=("object",), needs=needs
                ),
                lambda role=role: self.set_role(role),
            )
            for role, tip in _ROLE_TIPS.items()
        ]
        found.append(
            (
                ActionSpec(
                    "role-of-scene",
                    menu,
                    "As the scene says",
                    "Takes back what the side file says of the role of exactly these objects",
                    group=3,
                    context=("object",),
                    needs=needs,
                ),
                lambda: self.set_role(None),
            )
        )
        found.append(
            (
                ActionSpec(
                    "keep-settings",
                    "Bake",
                    "&Keep settings with the scene",
                    "Write the settings of the panel to the scene's side file, for the next bakes and for others",
                    group=3,
                    needs=("scene-file",),
                ),
                self.keep_settings,
            )
        )
        return found

    def set_role(self, role: Role | None) -> None:
        """Gives the selected objects a role; None takes back what was said of exactly them."""
        document = self.bench.document
        if document.world is None or not document.selection:
            return
        paths = [document.world.object_paths[index] for index in document.selection]
        what = paths[0].rpartition("/")[2] if len(paths) == 1 else f"{len(paths):,} objects"
        value = None if role is None else role.value
        self.set_keys({path: {"role": value} for path in paths}, f"role of {what}: {value or 'as the scene says'}")

    def set_keys(
        self,
        objects: Mapping[str, Mapping[str, Any]],
        text: str,
        *,
        copies: Sequence[Mapping[str, Any]] = (),
        without: Collection[str] = (),
    ) -> None:
        """Writes keys of objects.

        Args:
            objects: Values by path or pattern and key; None takes a key away.
            text: What the step is called.
            copies: Copies to make: `of`, `name` and keys.
            without: Paths of copies to take away.
        """
        scene = self.bench.document.scene_path
        if scene is None:
            return

        def plan() -> SideFileEdit:
            from bake.scene.side_file_writer import plan_edit

            return plan_edit(scene, objects, copies=copies, without=without)

        self._queue(plan, text)

    def keep_settings(self) -> None:
        """Writes the settings of the panel, as far as they differ from what the scene says already."""
        document, settings = self.bench.document, self.bench.panels.bake.settings()
        scene = document.scene_path
        if scene is None or settings is None:
            return
        known = {} if document.side_file_settings is None else document.side_file_settings.to_json()
        wanted = {
            name: value
            for name, value in settings.to_json().items()
            if name not in _RUN_ONLY and (name not in known or known[name] != value)
        }
        if not wanted:
            self.bench.banner.show_message(logging.INFO, "The side file says the same already.")
            return

        def plan() -> SideFileEdit:
            from bake.scene.side_file_writer import plan_edit

            return plan_edit(scene, {}, wanted)

        self._queue(plan, f"keep {', '.join(name.replace('-', ' ') for name in wanted)}")

    def push(self, edit: SideFileEdit, text: str, *, done: bool = False) -> None:
        """Makes an edit a step of the undo stack.

        Args:
            edit: As planned.
            text: What the step is called.
            done: Whether it has been written already.
        """
        from bake.scene.side_file_writer import apply_edit

        def write(edit: SideFileEdit) -> None:
            apply_edit(edit)
            self.bench.part(SceneWatchPart).note_own(edit, new=self._pushing)

        if edit.before == edit.after:
            return
        self._pushing = True
        self.bench.undo.push(
            Step(
                text,
                redo=lambda: write(edit),
                undo=lambda: write(edit.reversed()),
                done=done,
                failed=self._on_error,
            )
        )
        self._pushing = False
        if done:
            self.bench.part(SceneWatchPart).note_own(edit)

    def _queue(self, plan: Callable[[], SideFileEdit], text: str) -> None:
        self._waiting.append((plan, text))
        self._plan_next()

    def _plan_next(self) -> None:
        if self._planning or not self._waiting:
            return
        plan, text = self._waiting.popleft()
        self._planning = True
        self.bench.jobs.run("side file", plan, lambda edit: self._on_planned(edit, text), self._on_refused)

    def _on_planned(self, edit: SideFileEdit, text: str) -> None:
        self._planning = False
        self.push(edit, text)
        self._plan_next()

    def _on_refused(self, error: ObscuraError) -> None:
        self._planning = False
        self._on_error(error)
        self._plan_next()

    def _on_error(self, error: ObscuraError) -> None:
        self.bench.banner.show_message(logging.ERROR, str(error))
