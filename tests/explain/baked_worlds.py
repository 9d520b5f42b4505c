"""Small worlds, baked without files, and what a bake of them without an object would give."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from bake.decorator_types import Decorators, FogBoxes
from bake.devices import Device
from bake.samples import place_samples
from bake.settings import BakeSettings
from bake.solve import map_to_vertices
from bake.solve.importance import SampleImportance
from bake.trace import Tracer, create_tracer
from bake.trace.adaptive import trace_adaptively
from bake.types import BakeResult, ObjectKeys, Role, SampleSet, Tally, World
from tests.solve.solve_cases import grid
from tests.worlds import box, make_world

CPU = Device("cpu", "CPU")
SETTINGS = BakeSettings(rays=16, samples_per_face=(4, 6), device="cpu")


def baked(world: World, settings: BakeSettings = SETTINGS, fog: FogBoxes | None = None) -> BakeResult:
    """A bake of a world, as the pipeline makes it."""
    samples = place_samples(world, settings)
    tally = Tally.empty(len(samples), settings.distance_count)
    with create_tracer(world, settings, CPU, fog=fog) as tracer:
        if settings.adaptive_error is not None:
            tally = adapted(tracer, samples, settings)
        else:
            for batch in samples.batches(tracer.batch_size):
                tracer.accumulate(samples, batch, tally)
        name = tracer.name
    valid = tally.valid(settings.back_face_threshold)
    return BakeResult(
        scene_path=Path("/nowhere.glb"),
        files={},
        settings=settings,
        world=world,
        samples=samples,
        tally=tally,
        field=map_to_vertices(world, samples, tally.ao, valid, settings),
        stages=(),
        findings=(),
        device="cpu",
        tracer=name,
        rays_skipped=0,
        versions={},
        decorators=None if fog is None else Decorators(fog=fog),
    )


def adapted(tracer: Tracer, samples: SampleSet, settings: BakeSettings) -> Tally:
    """What adaptive rays find."""
    run = trace_adaptively(tracer, samples, SampleImportance(tracer.world, samples, settings).of, settings)
    while True:
        try:
            next(run)
        except StopIteration as ended:
            return ended.value[0]


def baked_without(result: BakeResult, wanted: int, fog: FogBoxes | None = None) -> BakeResult:
    """The same level baked anew with an object that does not cast, and with `fog` as it is then."""
    world = result.world
    roles = list(world.object_roles)
    roles[wanted] = Role.RECEIVER if roles[wanted].receives_per_vertex else Role.IGNORE
    casts = world.face_casts & (world.face_object != wanted)
    return baked(replace(world, face_casts=casts, object_roles=tuple(roles)), result.settings, fog)


def floor(n: int = 8, size: float = 8.0, y: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """A horizontal grid facing up (+y), centred on the axis."""
    positions, faces = grid(n, n, size=size)
    x, z, _ = positions.T
    return np.column_stack([x - size / 2, np.full(len(x), y), z - size / 2]), faces[:, ::-1]


def courtyard(*, keys: tuple[ObjectKeys, ...] | None = None) -> World:
    """A floor with boxes on it: one stands in the floor, one hides a corner of it, one is inside another.

    Objects: 0 floor, 1 block, 2 wall, 3 crate that sinks into the floor, 4 a small box closed up in the block.
    """
    return make_world(
        floor(),
        box((2.0, 2.0, 2.0), centre=(1.5, 1.001, 0.5)),
        box((0.2, 3.0, 7.0), centre=(-3.5, 1.5, 0.0)),
        box((1.0, 1.0, 1.0), centre=(-1.5, 0.2, -1.0)),
        box((0.5, 0.5, 0.5), centre=(1.5, 1.0, 0.5)),
        keys=keys,
    )
