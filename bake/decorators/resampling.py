"""The stages that read the baked surface again: small decorators and lower levels of detail."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Generator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Protocol

from bake.decorator_types import SmallScalars
from bake.decorators.lods import LodBake, Mapper, Samplable, Sampler, bake_lods
from bake.decorators.resample import BakedSurface, RayCaster
from bake.decorators.small import SmallBake, bake_small
from bake.settings import BakeSettings
from bake.stages import StageClock
from bake.types import Finding, Progress, Role, VertexField, World


class ClosableCaster(RayCaster, AbstractContextManager[object], Protocol):
    """A ray caster that is closed at the end of its `with` block."""


CasterMaker = Callable[[World], Generator[Progress, None, tuple[ClosableCaster, float]]]
"""Builds a tracer over a world; returns it and the seconds it took."""


@dataclass(frozen=True, slots=True)
class Resampling:
    """What the two stages made.

    Attributes:
        field: The bake's field, with the lower levels of detail if there are any.
        shrub_scalars, small_scalars: See `Decorators`.
        findings: What they found.
    """

    field: VertexField
    shrub_scalars: SmallScalars | None
    small_scalars: SmallScalars | None
    findings: tuple[Finding, ...]


def resample_surfaces(
    world: World,
    field: VertexField,
    settings: BakeSettings,
    clock: StageClock,
    *,
    caster: CasterMaker,
    sampler: Sampler,
    mapper: Mapper,
    samplable: Samplable,
) -> Generator[Progress, None, Resampling]:
    """Runs both stages, or says in the report why not; a scene with neither builds and traces nothing.

    Args:
        world: The flattened scene.
        field: What was baked.
        settings: `skip` and `decorator_radius` matter, and what places and maps samples.
        clock: Gets the rows `decorators` and `lods`.
        caster: Called with a world in which only baked surface stops rays.
        sampler, mapper, samplable: See `bake.decorators.lods`.
    """
    small_count = sum(world.object_roles.count(role) for role in (Role.SMALL, Role.SHRUB))
    lod_count = world.object_roles.count(Role.LOD)
    wants_small = small_count > 0 and "decorators" not in settings.skip
    wants_lods = lod_count > 0 and "lods" not in settings.skip
    small = SmallBake(None, None, (), 0)
    lods: LodBake | None = None
    seconds = {"decorators": 0.0, "lods": 0.0}
    if wants_small or wants_lods:
        surface = BakedSurface.of(world, field)
        # Without roles a tracer finds neither shrubs nor trees to prepare for.
        roles = (Role.IGNORE,) * world.object_count
        bare = dataclasses.replace(world, face_casts=surface.carries, object_roles=roles)
        tracer, building = yield from caster(bare)
        seconds["decorators" if wants_small else "lods"] += building
        with tracer:
            begin = time.perf_counter()
            if wants_small:
                small = yield from bake_small(world, surface, settings, tracer)
            between = time.perf_counter()
            if wants_lods:
                lods = yield from bake_lods(
                    world, surface, field, settings, tracer, sampler=sampler, mapper=mapper, samplable=samplable
                )
            seconds["decorators"] += between - begin
            seconds["lods"] += time.perf_counter() - between
    if wants_small:
        clock.ran("decorators", _small_counts(small), seconds["decorators"], small.rays)
    else:
        clock.skipped("decorators", _why_not(small_count, "small decorators"))
    if lods is not None:
        why = f"{lod_count} lower LODs, {lods.samples:,} samples, {lods.report.unknowns:,} unknowns"
        clock.ran("lods", why, seconds["lods"], lods.rays)
    else:
        clock.skipped("lods", _why_not(lod_count, "lower LODs"))
    findings = (*small.findings, *(lods.findings if lods is not None else ()))
    return Resampling(field if lods is None else lods.field, small.shrubs, small.small, findings)


def _small_counts(small: SmallBake) -> str:
    scalars = {"small decorators": small.small, "shrubs": small.shrubs}
    return ", ".join(f"{len(part.object):,} {plural}" for plural, part in scalars.items() if part is not None)


def _why_not(count: int, plural: str) -> str:
    return "asked for by --skip" if count else f"no {plural} in the scene"
