"""Reading baked AO within spheres: by the tracers' kernel and in NumPy over closest hits."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from bake.decorator_types import ReadingSpheres
from bake.decorators.resample import BakedSurface, sphere_reader
from bake.devices import cuda_devices, resolve
from bake.settings import BakeSettings, TracerKind
from bake.trace import Tracer, create_tracer
from bake.types import Float32Array, SolveReport, VertexField, World
from tests.worlds import box, icosphere, make_world, quad

RAYS = 32


class OnlyClosestHits:
    """A tracer that can do nothing else."""

    def __init__(self, tracer: Tracer) -> None:
        self._tracer = tracer

    def nearest(self, origins: Float32Array, directions: Float32Array, t_max: float) -> object:
        """As the tracer does."""
        return self._tracer.nearest(origins, directions, t_max)


def rough_surface() -> tuple[World, BakedSurface]:
    """Three objects of which the last carries no AO, one of them open to both sides."""
    world = make_world(icosphere(3, 2.0), quad(6.0, 0.3), box((1.0, 1.0, 1.0)))
    world = dataclasses.replace(world, face_two_sided=world.face_object == 1)
    values = np.random.default_rng(1).random((world.vertex_count, 3)).astype(np.float32)
    values[int(world.first_vertex[2]) :] = np.nan
    field = VertexField(values, np.zeros(len(values), np.uint8), SolveReport(0, 0, 0, 0.0, 0, (), ()))
    return world, BakedSurface.of(world, field)


def spheres_around(world: World, count: int) -> ReadingSpheres:
    """Spheres near the surface and far from it; every object, side and lack of either asked for."""
    random = np.random.default_rng(2)
    return ReadingSpheres(
        centre=random.normal(size=(count, 3)) * 1.5,
        least=random.uniform(0.01, 0.5, count),
        most=random.uniform(0.2, 3.0, count),
        row=random.integers(-1, 3, count).astype(np.int32),
        own_face=np.where(random.random(count) < 0.5, -1, random.integers(0, world.face_count, count)).astype(np.int32),
    )


CUDA = pytest.param(TracerKind.WARP, "cuda", marks=pytest.mark.cuda)


@pytest.mark.parametrize(("kind", "on"), [(TracerKind.EMBREE, "cpu"), (TracerKind.WARP, "cpu"), CUDA])
def test_the_kernel_reads_what_closest_hits_do(kind: TracerKind, on: str) -> None:
    """Both readers find the same AO with the same rays, but where one ray slips between two triangles."""
    if on == "cuda" and not cuda_devices():
        pytest.skip("no CUDA device")
    world, surface = rough_surface()
    spheres = spheres_around(world, 300)
    counts = np.array([[True, False, True], [False, True, True], [True, True, False]])
    settings = BakeSettings(tracer=kind, distances=(1.0, 2.0, 3.0))
    with create_tracer(world, settings, resolve(on)) as tracer:
        fused = sphere_reader(surface, tracer, rays=RAYS, counts=counts).read(spheres)
        plain = sphere_reader(surface, OnlyClosestHits(tracer), rays=RAYS, counts=counts).read(spheres)  # pyright: ignore[reportArgumentType]
    assert plain.hits.any()
    assert (plain.hits == 0).any()
    differs = np.abs(fused.ao - plain.ao).max(axis=1) > 1e-6
    assert differs.mean() <= 0.01
    assert (fused.hits != plain.hits).mean() <= 0.01
    np.testing.assert_allclose(fused.rays, plain.rays, rtol=1e-3)
    np.testing.assert_array_equal(fused.ao[fused.hits == 0], 1.0)


def test_a_sphere_widens_until_it_finds_enough() -> None:
    """A sphere that begins too small reads what one of the needed size reads; one that may not grow finds nothing."""
    world, surface = rough_surface()
    every = np.full(3, -1, np.int32)
    centre = np.tile([0.0, 4.0, 0.0], (3, 1))  # two metres above the ball
    spheres = ReadingSpheres(centre, np.array([0.01, 2.56, 0.01]), np.array([9.0, 9.0, 1.0]), every, every)
    with create_tracer(world, BakeSettings(device="cpu", distances=(1.0, 2.0, 3.0)), resolve("cpu")) as tracer:
        read = sphere_reader(surface, tracer, rays=RAYS).read(spheres)
    assert read.hits[0] == read.hits[1] >= RAYS / 8
    np.testing.assert_allclose(read.ao[0], read.ao[1], atol=1e-9)
    assert read.hits[2] == 0
