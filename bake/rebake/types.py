"""What a rebake tells on its way and at its end."""

from __future__ import annotations

from dataclasses import dataclass, field

from bake.types import BakeResult, Float32Array, Int64Array


@dataclass(frozen=True, slots=True)
class Partial:
    """Values as they are known so far: better with each, and final in the last.

    Attributes:
        vertices: Shape (n,), int64, ascending, index into the edited world's vertices: those that differ from what was
            shown before.
        ao: Shape (n, k), float32: their values now.
        rays_done, rays_total: Rays traced so far and in all, as far as it is known.
        final: The values are those of the result.
    """

    vertices: Int64Array
    ao: Float32Array
    rays_done: int
    rays_total: int
    final: bool = False


@dataclass(frozen=True, slots=True)
class RebakeReport:
    """What a rebake did.

    Attributes:
        changed: Paths of the objects that differ: changed, added or gone.
        stale: Paths of the objects that were left as they are though the edit may reach them.
        full: Why everything was baked anew; empty if it was not.
        samples: Samples of the edited world.
        samples_checked: Those that the edit may reach by more than the bound.
        samples_whole: Those traced with all of their rays, because they are new or lie on what changed.
        samples_changed: Those whose value changed.
        rays_tested: Rays tested against the changed parts alone.
        rays_traced: Rays traced through a whole scene, of surface samples.
        rays_changed: Those whose value changed, as far as it is known: of samples traced whole, all.
        rays_elsewhere: Rays traced for trees, regions and small decorators.
        vertices_changed: Vertices whose value changed at all.
        voxels, voxels_traced: Of the tree volume: all, and those traced.
        points, points_traced: Of the regions: all that are traced in a bake, and those traced now.
        bound: Most that was skipped for one sample, this rebake and those before it together, in AO.
        seconds: Of the whole rebake.
        stages: Seconds by stage, in order.
        carried: What was carried over whole, and why.
    """

    changed: tuple[str, ...] = ()
    stale: tuple[str, ...] = ()
    full: str = ""
    samples: int = 0
    samples_checked: int = 0
    samples_whole: int = 0
    samples_changed: int = 0
    rays_tested: int = 0
    rays_traced: int = 0
    rays_changed: int = 0
    rays_elsewhere: int = 0
    vertices_changed: int = 0
    voxels: int = 0
    voxels_traced: int = 0
    points: int = 0
    points_traced: int = 0
    bound: float = 0.0
    seconds: float = 0.0
    stages: dict[str, float] = field(default_factory=dict[str, float])
    carried: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class RebakeOutcome:
    """What came of it.

    Attributes:
        result: The edited scene's result, to be stored or shown.
        report: What was done for it.
    """

    result: BakeResult
    report: RebakeReport
