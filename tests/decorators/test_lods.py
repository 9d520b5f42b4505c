"""Lower levels of detail take on the finest level's baked AO."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bake.bench.lods import compare_lods
from bake.bench.synthetic import write_ply
from bake.decorators.lods import LodBake, bake_lods, finest_levels, lod_world
from bake.decorators.resample import BakedSurface
from bake.devices import resolve
from bake.errors import SceneError
from bake.pipeline import bake
from bake.samples import place_samples
from bake.scene import load_scene, samplable_faces
from bake.settings import BakeSettings
from bake.solve import map_to_vertices
from bake.stages import StageClock, drained
from bake.trace import create_tracer
from bake.types import BakeResult, ObjectKeys, Role, Scene, SolveReport, VertexField, VertexState, World
from tests.worlds import box, icosphere, make_world, quad

SETTINGS = BakeSettings(device="cpu", distances=(2.0,), rays=16, alpha=0.0)
REPORT = SolveReport(0, 0, 0, 0.0, 0, (0,), (0.0,))
CPU = resolve("cpu")


def levels(*objects: tuple[np.ndarray, np.ndarray], of: str = "object_0", **options: Any) -> World:
    """The first object as finest level, the others as its lower levels, which neither cast nor receive."""
    first = np.repeat([True] + [False] * (len(objects) - 1), [len(faces) for _, faces in objects])
    return make_world(
        *objects,
        roles=(Role.STATIC,) + (Role.LOD,) * (len(objects) - 1),
        keys=(ObjectKeys(),) + (ObjectKeys(of=of),) * (len(objects) - 1),
        casts=first,
        samples=first,
        **options,
    )


def field_of(world: World, values: np.ndarray) -> VertexField:
    """The finest level with these values, the others without."""
    ao = np.full((world.vertex_count, 1), np.nan, np.float32)
    ao[: len(values), 0] = values
    return VertexField(ao, np.where(np.isnan(ao[:, 0]), 3, 0).astype(np.uint8), REPORT)


def resampled(world: World, field: VertexField, options: BakeSettings = SETTINGS) -> LodBake:
    """The lower levels of a world, by the real sampler, mapper and tracer."""
    surface = BakedSurface.of(world, field)
    with create_tracer(dataclasses.replace(world, face_casts=surface.carries), options, CPU) as caster:
        return drained(
            bake_lods(
                world, surface, field, options, caster,
                sampler=place_samples, mapper=map_to_vertices, samplable=samplable_faces,
            )
        )  # fmt: skip


@pytest.mark.parametrize("shift", [0.0, 700.0])
def test_a_copy_gets_the_same_values(shift: float) -> None:
    """A lower level that equals the finest gets its values back, however rough they are and wherever it stands."""
    positions, faces = icosphere(2, 2.0, centre=(shift, 0.0, -shift))
    values = np.random.default_rng(1).random(len(positions)).astype(np.float32)
    result = resampled(world := levels((positions, faces), (positions, faces)), field_of(world, values))
    np.testing.assert_allclose(result.field.ao[len(positions) :, 0], values, atol=0.02 if shift else 2e-3)
    np.testing.assert_array_equal(result.field.ao[: len(positions), 0], values)
    assert (result.field.state[len(positions) :] == VertexState.BAKED).all()
    assert not result.findings
    assert result.rays > 0


def test_a_coarser_level_follows_a_linear_signal() -> None:
    """AO that is linear in space survives on a level with a sixteenth of the faces, inside the finest one."""
    fine, coarse = icosphere(4, 3.0), icosphere(2, 3.0)
    world = levels(fine, coarse)
    result = resampled(world, field_of(world, 0.5 + fine[0][:, 1] / 6.0))
    expected = 0.5 + coarse[0][:, 1] / 6.0
    np.testing.assert_allclose(result.field.ao[len(fine[0]) :, 0], expected, atol=0.02)


def test_levels_never_weld_or_mix_with_each_other() -> None:
    """Two lower levels at one place, of two finest ones that interpenetrate, each keep their own level's AO."""
    ball, cube = icosphere(2, 1.0), box((1.7, 1.7, 1.7))
    world = make_world(
        ball, cube, ball, cube,
        roles=(Role.STATIC, Role.STATIC, Role.LOD, Role.LOD),
        keys=(ObjectKeys(), ObjectKeys(), ObjectKeys(of="object_0", weld=True), ObjectKeys(of="object_1", weld=True)),
        casts=np.repeat([True, True, False, False], [len(ball[1]), 12, len(ball[1]), 12]),
    )  # fmt: skip
    values = np.concatenate([np.full(len(ball[0]), 0.2), np.full(8, 0.9)])
    result = resampled(world, field_of(world, values), SETTINGS.replaced(weld_instances=True))
    np.testing.assert_allclose(result.field.ao[:, 0], np.concatenate([values, values]), atol=1e-3)


def test_both_sides_of_a_thin_wall_keep_their_own() -> None:
    """A sample near a thin wall reads the side that faces its own way."""
    fine = (np.concatenate([quad(4.0)[0], quad(4.0, -0.02)[0]]), np.concatenate([quad()[1], quad(up=False)[1] + 4]))
    coarse = (fine[0] + np.array([0.0, -0.015, 0.0]), fine[1])
    world = levels(fine, coarse)
    result = resampled(world, field_of(world, np.repeat([0.9, 0.1], 4)))
    np.testing.assert_allclose(result.field.ao[8:, 0], np.repeat([0.9, 0.1], 4), atol=1e-3)


def test_what_lies_elsewhere_is_said() -> None:
    """A level far from its finest one takes the nearest vertices' values, and a finding counts its samples."""
    fine = quad(2.0)
    world = levels(fine, (fine[0] + np.array([500.0, 0.0, 0.0]), fine[1]))
    result = resampled(world, field_of(world, np.float32([0.1, 0.7, 0.7, 0.1])))
    np.testing.assert_allclose(result.field.ao[4:, 0], 0.7, atol=1e-3)
    (finding,) = result.findings
    assert (finding.object, finding.what, finding.count) == ("object_1", "far-from-finest-level", result.samples)


def test_without_any_baked_surface_levels_are_filled() -> None:
    """Where nothing is baked at all, the levels' vertices are filled and never NaN or black."""
    world = levels(quad(2.0), quad(2.0))
    field = field_of(world, np.full(4, np.nan, np.float32))
    result = resampled(world, field)
    assert (result.field.state[4:] == VertexState.FILLED).all()
    assert np.isfinite(result.field.ao[4:]).all()


def test_only_levels_receive_in_their_world() -> None:
    """The world of the lower levels samples their faces alone, slivers left out."""
    sliver = (np.array([[0, 0, 0], [1, 0, 0], [0.5, 1e-9, 0.0], [0, 0, 1]]), np.array([[0, 1, 2], [0, 3, 1]]))
    world = levels(quad(2.0), sliver)
    alone = lod_world(world, np.int32([1]), samplable_faces)
    np.testing.assert_array_equal(alone.face_samples, [False, False, False, True])
    assert alone.object_roles == (Role.IGNORE, Role.RECEIVER)


def test_finest_levels_by_name() -> None:
    """`of` names an object, its repeats, or a node above it; never another lower level; else the nearest is named."""
    world = levels(*[quad()] * 6)
    paths = ("Level/Rock/A", "Level/Rock/B", "Level/Tree#1", "Level/Tree#2", "Level/Tower", "Level/Tower/LOD1")
    roles = (Role.STATIC,) * 4 + (Role.LOD, Role.STATIC)

    def belongs(of: str) -> list[bool]:
        keys = (ObjectKeys(),) * 4 + (ObjectKeys(of=of), ObjectKeys())
        named = dataclasses.replace(world, object_paths=paths, object_roles=roles, object_keys=keys)
        return finest_levels(named, np.int32([4]))[0].tolist()

    assert belongs("Level/Rock") == [True, True, False, False, False, False]
    assert belongs("Level/Tree#2") == [False, False, False, True, False, False]
    assert belongs("Level/Tree") == [False, False, True, True, False, False]
    assert belongs("Level/Tower") == [False, False, False, False, False, True]
    with pytest.raises(SceneError, match=r"did you mean 'Level/Rock/A'"):
        belongs("Level/Rock/AA")


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 2**31), st.floats(0.01, 50.0), st.booleans())
def test_constants_survive_any_placement(seed: int, scale: float, mirrored: bool) -> None:
    """A uniform finest level gives its value to a coarser one under any rotation, scale and reflection."""
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0] * scale
    turn *= np.sign(np.linalg.det(turn)) * (-1.0 if mirrored else 1.0)
    fine, coarse = ((p @ turn.T, f[:, ::-1] if mirrored else f) for p, f in (icosphere(2), icosphere(1)))
    world = levels(fine, coarse)
    result = resampled(world, field_of(world, np.full(len(fine[0]), 0.37)))
    np.testing.assert_allclose(result.field.ao[:, 0], 0.37, atol=1e-4)


def bumpy() -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """A ball with deep dents, fine and coarse."""

    def dented(subdivisions: int) -> tuple[np.ndarray, np.ndarray]:
        positions, faces = icosphere(subdivisions, 1.0)
        return positions * (1.0 + 0.12 * np.sin(14.0 * positions).prod(axis=1, keepdims=True)), faces

    return dented(4), dented(2)


def test_resampling_the_surface_beats_the_vertices(tmp_path: Any) -> None:
    """At equal rays the fit over the surface is nearer to what is traced on the finest level than vertices are."""
    fine, coarse = bumpy()
    write_ply(tmp_path / "fine.ply", fine)
    options = BakeSettings(device="cpu", distances=(0.5,), rays=64)
    result: BakeResult = drained(
        bake(two_levels(load_scene(tmp_path / "fine.ply"), coarse), options, CPU, StageClock())
    )
    (row,) = compare_lods(result, options, CPU)
    assert row["RMSE surface + fit"] < row["RMSE at vertices"]
    assert row["RMSE surface + fit"] < row["RMSE nearest vertex"]
    rows = {stage.name: stage for stage in result.stages}
    assert rows["lods"].status == "ran"
    assert rows["decorators"].status == "skipped"
    assert rows["lods"].rays > 0


def two_levels(scene: Scene, coarse: tuple[np.ndarray, np.ndarray]) -> Scene:
    """A scene of one object with a lower level of detail beside it."""
    finest = scene.objects[0]
    mesh = dataclasses.replace(
        scene.meshes[0],
        positions=coarse[0],
        normals=np.zeros((len(coarse[0]), 3), np.float32),
        faces=coarse[1].astype(np.int32),
        face_material=np.zeros(len(coarse[1]), np.int32),
        primitives=(),
    )
    lower = dataclasses.replace(finest, path="lower", mesh=1, role=Role.LOD, keys=ObjectKeys(of=finest.path))
    return dataclasses.replace(scene, meshes=(scene.meshes[0], mesh), objects=(finest, lower))
