"""A bake that is kept at hand, so that edits of its scene are followed one by one."""

from __future__ import annotations

from collections.abc import Callable, Generator
from types import TracebackType
from typing import Self

import numpy as np

from bake.devices import Device
from bake.pipeline import bake
from bake.rebake.types import Partial, RebakeOutcome, RebakeReport
from bake.settings import BakeSettings
from bake.stages import StageClock
from bake.types import BakeResult, Int64Array, Progress, Scene

DEFAULT_BOUND = 1.0 / 512.0
"""Most AO that may be skipped for a sample, over all rebakes since it was traced."""


class RebakeSession:
    """Follows edits of a baked scene, one rebake after the other; close it at the end.

    Args:
        result: A bake.
        scene: What was baked, if it is at hand; it spares some work on trees.
        device: Where to trace.
        bound: Most AO that may be skipped for a sample, over all rebakes since it was traced; 0 skips nothing that the
            edit can reach at all.

    Attributes:
        result: The result as it stands: of the last rebake that came to its end.
        scene: What it was baked from; None if nobody said.
    """

    def __init__(
        self, result: BakeResult, scene: Scene | None, device: Device, *, bound: float = DEFAULT_BOUND
    ) -> None:
        self.result = result
        self.scene = scene
        self._device = device
        self._bound = bound

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
        result = yield from bake(scene, settings, self._device, clock)
        changed = np.flatnonzero(np.isfinite(result.field.ao).any(axis=1)).astype(np.int64)
        rays = int(result.tally.rays.sum(dtype=np.int64))
        yield Partial(changed, result.field.ao[changed], rays, rays, final=True)
        report = RebakeReport(
            full="every edit is baked in full",
            samples=len(result.samples),
            samples_whole=len(result.samples),
            rays_traced=rays,
            rays_changed=rays,
            vertices_changed=len(changed),
            seconds=clock.seconds,
            stages={row.name: row.seconds for row in clock.rows},
        )
        self.result, self.scene = result, scene
        return RebakeOutcome(result, report)

    def close(self) -> None:
        """Frees what the session holds."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
