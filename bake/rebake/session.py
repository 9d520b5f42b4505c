"""A bake that is kept at hand, so that edits of its scene are followed one by one."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Generator
from types import TracebackType
from typing import Self

import numpy as np

from bake.devices import Device
from bake.pipeline import bake, open_tracer
from bake.rebake.find_edit import NoEdit, find_edit, is_baked_from
from bake.rebake.follow import follow, keeper_of
from bake.rebake.reach import Places
from bake.rebake.state import State
from bake.rebake.types import Partial, RebakeOutcome, RebakeReport
from bake.settings import BakeSettings, TracerKind
from bake.solve.update import FieldKeeper
from bake.stages import StageClock, patiently
from bake.types import BakeResult, Int64Array, Progress, Scene

DEFAULT_BOUND = 1.0 / 512.0
"""Most AO that may be skipped for a sample, over all rebakes since it was traced."""


class RebakeSession:
    """Follows edits of a baked scene, one rebake after the other; close it at the end.

    Args:
        result: A bake.
        scene: What was baked, if it is at hand; it spares some work on trees and regions.
        device: Where to trace.
        bound: Most AO that may be skipped for a sample, over all rebakes since it was traced; 0 skips nothing that the
            edit can reach at all.
    """

    def __init__(
        self, result: BakeResult, scene: Scene | None, device: Device, *, bound: float = DEFAULT_BOUND
    ) -> None:
        self._state = State(result, scene)
        self._device = device
        self._bound = bound
        self._is_checked = scene is None

    @property
    def result(self) -> BakeResult:
        """The bake as it stands: of the last rebake that came to its end."""
        return self._state.result

    @property
    def scene(self) -> Scene | None:
        """What it was baked from; None if nobody said."""
        return self._state.scene

    @property
    def keeper(self) -> FieldKeeper | None:
        """What follows the values of the result; None until it is needed."""
        return self._state.keeper

    def rebake(
        self,
        scene: Scene,
        settings: BakeSettings,
        *,
        objects: frozenset[str] | None = None,
        faces: Int64Array | None = None,
        first: Callable[[], Int64Array] | None = None,
    ) -> Generator[Progress | Partial, None, RebakeOutcome]:
        """Bakes what changed since the session's result, and what that can reach.

        The session takes the new state on when the generator ends. Closed before, it stays where it was.

        Args:
            scene: As edited.
            settings: As wanted now.
            objects: Paths of the objects whose values may change; what else the edit can reach is left as it is and
                marked stale. All if None.
            faces: Shape (f,), int64, index into the edited world's faces: the same by faces.
            first: Told when there is a choice: vertices of the edited world that are to be right first, shape (v,).

        Yields:
            Progress, and values as they come.

        Raises:
            SceneError: nothing receives, or the regions cannot be made.
            DeviceError: the device failed.
        """
        clock = StageClock()
        settings = self._as_traced(settings)
        if not self._is_checked:
            yield from patiently("compare", self._check_scene)
        state = self._state
        found, seconds = yield from patiently(
            "compare",
            lambda: find_edit(state, scene, settings, objects=objects, faces=faces),
        )
        if isinstance(found, NoEdit):
            after, outcome = yield from self._in_full(found, settings, clock)
        else:
            clock.ran("compare", f"{len(found.casters):,} boxes hold what rays see differently", seconds)
            after, outcome = yield from follow(state, found, self._device, clock, bound=self._bound, first=first)
        before, self._state = self._state, after
        if before.tracer is not None and before.tracer is not after.tracer:
            before.tracer.close()
        return outcome

    def prepare(self) -> Generator[Progress]:
        """Builds ahead of time what every edit needs, so that the first one is as fast as those after it.

        Raises:
            DeviceError: the device failed.
        """
        if not self._is_checked:
            yield from patiently("compare", self._check_scene)
        state = self._state
        result, settings = state.result, self._as_traced(state.result.settings)
        if state.places is None:
            places, _ = yield from patiently("reach", lambda: Places.of_samples(result.world, result.samples))
            state = dataclasses.replace(state, places=places)
        if state.keeper is None:
            keeper, _ = yield from patiently("solve", lambda: keeper_of(result))
            state = dataclasses.replace(state, keeper=keeper)
        if state.tracer is None:
            tracer, _ = yield from open_tracer(result.world, settings, self._device, state.fog)
            state = dataclasses.replace(state, tracer=tracer)
        self._state = state

    def close(self) -> None:
        """Frees what the session holds."""
        if self._state.tracer is not None:
            self._state.tracer.close()
        self._state = State(self._state.result, self._state.scene)

    def _check_scene(self) -> None:
        """Forgets the scene if the result was baked from another one."""
        state = self._state
        if state.scene is not None and not is_baked_from(state.result, state.scene):
            self._state = dataclasses.replace(state, scene=None)
        self._is_checked = True

    def _as_traced(self, settings: BakeSettings) -> BakeSettings:
        """The settings with the tracer that the result was baked with, wherever the device has it."""
        if self.result.tracer == "brute":
            return settings.replaced(tracer=TracerKind.BRUTE)
        return settings

    def _in_full(
        self, found: NoEdit, settings: BakeSettings, clock: StageClock
    ) -> Generator[Progress | Partial, None, tuple[State, RebakeOutcome]]:
        result = yield from bake(found.scene, settings, self._device, clock)
        vertices = np.flatnonzero(np.isfinite(result.field.ao).any(axis=1)).astype(np.int64)
        rays = int(result.tally.rays.sum(dtype=np.int64))
        yield Partial(vertices, result.field.ao[vertices], rays, rays, final=True)
        report = RebakeReport(
            full=found.why,
            samples=len(result.samples),
            samples_whole=len(result.samples),
            samples_changed=len(result.samples),
            rays_traced=rays,
            rays_changed=rays,
            vertices_changed=len(vertices),
            seconds=clock.seconds,
            stages={row.name: row.seconds for row in clock.rows},
        )
        return State(dataclasses.replace(result), found.scene), RebakeOutcome(result, report)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
