"""What a session keeps between edits: one consistent state of a bake."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bake.change_types import WorldChange
from bake.decorator_types import FogBoxes
from bake.rebake.casters import Casters
from bake.rebake.reach import Places
from bake.rebake.setting_changes import SettingsChange
from bake.settings import BakeSettings
from bake.solve.update import FieldKeeper
from bake.trace import Tracer
from bake.types import BakeResult, BoolArray, Float32Array, Float64Array, Scene, World


@dataclass(frozen=True, slots=True)
class Anchor:
    """The world that a session began with. A prop that is dragged about and back again is where it was: samples that
    were left alone all the while are off by what differs between then and now, not by the sum of all its ways.

    Attributes:
        world, fog: As it was.
        skipped: Shape (n,), float32: what was skipped before, one a sample of the newest world.
        untouched: Shape (n,), bool: samples that nothing was done to since.
    """

    world: World
    fog: FogBoxes | None
    skipped: Float32Array
    untouched: BoolArray


@dataclass(frozen=True, slots=True)
class State:
    """A bake and what was made of it to follow edits fast.

    Attributes:
        result: As it would be stored.
        scene: What it was baked from, if it is known.
        tracer: Of the result's world; None until one is needed.
        keeper: Its values; None until they are needed.
        places: Of its samples; None until they are needed.
        anchor: What the session began with; None: this very result.
        seen: Local AO of trees alone as a volume shows it, by content hash and spacing of the volume: it grows from
            edit to edit for as long as the settings of the trees stay.
    """

    result: BakeResult
    scene: Scene | None = None
    tracer: Tracer | None = None
    keeper: FieldKeeper | None = None
    places: Places | None = None
    anchor: Anchor | None = None
    seen: dict[tuple[str, float], Float64Array] = field(default_factory=dict[tuple[str, float], Float64Array])

    @property
    def anchored(self) -> Anchor:
        """What the session began with."""
        if self.anchor is not None:
            return self.anchor
        return Anchor(self.result.world, self.fog, self.skipped, np.ones(len(self.result.samples), np.bool_))

    @property
    def fog(self) -> FogBoxes | None:
        """The shrubs that dim rays."""
        return None if self.result.decorators is None else self.result.decorators.fog

    @property
    def skipped(self) -> Float32Array:
        """What was skipped so far, one a sample."""
        kept = self.result.skipped
        return np.zeros(len(self.result.samples), np.float32) if kept is None else kept.samples


@dataclass(frozen=True, slots=True)
class Edit:
    """An edit as it was found by comparing.

    Attributes:
        scene, settings: As wanted now.
        world: The edited scene, flattened; its origin is the old one.
        fog: Its shrubs.
        change: How the world follows from the old one.
        casters: What rays see differently.
        settings_change: What differs in the settings.
        wanted: Shape (n,), bool: vertices whose values may change.
        wanted_faces: Shape (m,), bool: faces whose samples may change.
    """

    scene: Scene
    settings: BakeSettings
    world: World
    fog: FogBoxes | None
    change: WorldChange
    casters: Casters
    settings_change: SettingsChange
    wanted: BoolArray
    wanted_faces: BoolArray

    @property
    def selects(self) -> bool:
        """Whether only a part of the level may change."""
        return not bool(self.wanted_faces.all())
