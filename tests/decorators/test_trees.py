"""Trees through all their stages, on real tracers."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest

from bake.decorators import tree_fitter
from bake.decorators.alone import only
from bake.decorators.fit import GlobalFit, fit_global
from bake.decorators.local_ao import StagesLent, representatives
from bake.decorators.tree_samples import as_sample_set, place, sample_mesh
from bake.decorators.trees import BakedTrees, bake_trees
from bake.decorators.volume import evaluate
from bake.devices import resolve
from bake.samples import place_samples
from bake.scene import flatten
from bake.settings import BakeSettings
from bake.solve import map_to_vertices
from bake.stages import StageClock
from bake.trace import create_tracer
from bake.types import Material, Mesh, Role, Scene, SceneObject
from tests.worlds import box, quad

QUICK = BakeSettings(rays=32, samples_per_face=(2, 2), volume_directions=256, volume_spacing=0.5)


def mesh_of(positions: np.ndarray, faces: np.ndarray, name: str = "tree") -> Mesh:
    """A mesh without normals of its own."""
    zero = np.zeros((len(positions), 3), np.float32)
    return Mesh(name, positions.astype(float), zero, faces.astype(np.int32), np.zeros(len(faces), np.int32))


def leaves(count: int = 40, seed: int = 2) -> Mesh:
    """A crown of leaf cards about (0, 2, 0)."""
    rng = np.random.default_rng(seed)
    centres = rng.normal(0.0, 0.6, (count, 3)) + np.array([0.0, 2.0, 0.0])
    across = rng.normal(size=(count, 3))
    along = np.cross(across, rng.normal(size=(count, 3)))
    across, along = (0.25 * v / np.linalg.norm(v, axis=1, keepdims=True) for v in (across, along))
    corners = np.stack([-across - along, across - along, across + along, -across + along], axis=1)
    first = 4 * np.arange(count)[:, None]
    faces = np.concatenate([first + np.array([0, 1, 2]), first + np.array([0, 2, 3])])
    return mesh_of((centres[:, None] + corners).reshape(-1, 3), faces)


def scene_of(*objects: tuple[Mesh, np.ndarray, Role]) -> Scene:
    """A scene of placed meshes; equal meshes are shared."""
    meshes = list(dict.fromkeys(id(mesh) for mesh, _, _ in objects))
    by_id = {id(mesh): mesh for mesh, _, _ in objects}
    return Scene(
        Path("made-up.glb"),
        tuple(by_id[key] for key in meshes),
        (Material("leaf", two_sided=True),),
        tuple(
            SceneObject(f"object_{i}", meshes.index(id(mesh)), transform, role)
            for i, (mesh, transform, role) in enumerate(objects)
        ),
    )


def placed(x: float = 0.0, *, scale: float = 1.0, y: float = 0.0) -> np.ndarray:
    """A transform."""
    matrix = np.diag([scale, scale, scale, 1.0])
    matrix[:2, 3] = x, y
    return matrix


def bake(scene: Scene, settings: BakeSettings = QUICK) -> tuple[BakedTrees, StageClock]:
    """All three stages on the CPU."""
    device, clock = resolve("cpu"), StageClock()
    world = flatten(scene, settings)
    lent = StagesLent(flatten, place_samples, partial(create_tracer, device=device), map_to_vertices)
    with create_tracer(world, settings, device) as tracer:
        work = bake_trees(scene, world, settings, tracer, lent, clock)
        with pytest.raises(StopIteration) as done:
            while True:
                next(work)
    return done.value.value, clock


FAR_FLOOR = (mesh_of(*quad(1.0, 0.0), "floor"), placed(1e5), Role.STATIC)


def test_a_tree_alone_in_the_open_has_global_one() -> None:
    """Nothing around it: global AO is 1 without slope, for every distance."""
    baked, clock = bake(scene_of((leaves(), placed(), Role.TREE), FAR_FLOOR))
    wanted = np.tile([[1.0], [0.0], [0.0], [0.0]], (1, 2))
    np.testing.assert_allclose(baked.fits.coefficients[0], wanted, atol=0.01)
    assert baked.fits.terms.tolist() == [[4, 4]]
    assert baked.models[0].local_ao.min() < 0.9
    assert [row.name for row in clock.rows] == ["tree volume", "trees", "fit trees"]
    assert all(row.rays > 0 for row in clock.rows)
    assert baked.volume.valid.all()


def test_a_wall_darkens_its_side() -> None:
    """Beside a long wall global AO falls towards it, and the product beats the linear function alone."""
    wall = mesh_of(*box((0.2, 30.0, 30.0)), "wall")
    baked, _ = bake(scene_of((leaves(), placed(), Role.TREE), (wall, placed(-2.5), Role.STATIC)))
    constant, slope = baked.fits.coefficients[0, 0], baked.fits.coefficients[0, 1]
    assert (constant < 0.95).all()
    assert (slope > 0.01).all()
    assert (baked.fits.rmse_product < baked.fits.rmse_global).all()
    assert (baked.fits.rmse_volume > 0.0).all()


def test_instances_share_one_model_in_scene_order() -> None:
    """Two meshes, four trees: two models; fits are in scene order and point at their models."""
    oak, pine = leaves(), leaves(30, seed=9)
    scene = scene_of(
        (oak, placed(), Role.TREE), (pine, placed(40.0), Role.TREE), FAR_FLOOR, (oak, placed(80.0), Role.TREE),
        (pine, placed(120.0, scale=1.5), Role.TREE),
    )  # fmt: skip
    baked, _ = bake(scene)
    assert len(baked.models) == 2
    assert baked.fits.object.tolist() == [0, 1, 3, 4]
    assert [baked.models[m].mesh for m in baked.fits.model] == [scene.objects[i].mesh for i in (0, 1, 3, 4)]
    world = flatten(scene, QUICK)
    for row, number in enumerate(baked.fits.object):
        own = world.positions[world.first_vertex[number] : world.first_vertex[number + 1]]
        np.testing.assert_allclose(baked.fits.centre[row], (own.min(0) + own.max(0)) / 2.0, atol=1e-4)
        assert np.isfinite(evaluate(baked.volume, own, np.tile([0.0, 1.0, 0.0], (len(own), 1)))).all()


def test_no_trees_no_work() -> None:
    """Without trees, or with their stage skipped, nothing is traced and the report says why."""
    floor = (mesh_of(*quad(4.0), "floor"), placed(), Role.STATIC)
    for scene, settings, why in (
        (scene_of(floor), QUICK, "no trees"),
        (scene_of(floor, (leaves(), placed(), Role.TREE)), QUICK.replaced(skip=("trees",)), "--skip"),
    ):
        baked, clock = bake(scene, settings)
        assert baked is None
        assert [(row.status, row.rays) for row in clock.rows] == [("skipped", 0)]
        assert why in clock.rows[0].why


def test_refining_saves_error_and_says_so() -> None:
    """With refining the error of the product does not grow, and a finding tells both."""
    wall = mesh_of(*box((0.2, 30.0, 30.0)), "wall")
    oak = leaves(30)
    trees = [(oak, placed(x), Role.TREE) for x in (0.0, 6.0, 12.0)]
    baked, _ = bake(scene_of(*trees, (wall, placed(-2.5), Role.STATIC)), QUICK.replaced(refine_local=True))
    finding = next(f for f in baked.findings if f.what == "local-ao-refined")
    assert finding.count == 3
    before, after = (float(v) for v in finding.detail.split("from ")[1].split(",")[0].split(" to "))
    assert after < before
    assert 0.0 <= baked.models[0].local_ao.min() <= baked.models[0].local_ao.max() <= 1.0


def test_refining_tells_how_far_it_is() -> None:
    """While it traces and checks, trees done grow from none towards all."""
    oak = leaves(30)
    scene = scene_of(*((oak, placed(6.0 * x), Role.TREE) for x in range(3)), FAR_FLOOR)
    settings, device = QUICK.replaced(refine_local=True), resolve("cpu")
    world = flatten(scene, settings)
    lent = StagesLent(flatten, place_samples, partial(create_tracer, device=device), map_to_vertices)
    with create_tracer(world, settings, device) as tracer:
        told = [p for p in bake_trees(scene, world, settings, tracer, lent, StageClock()) if p.stage == "fit trees"]
    assert {item.total for item in told} == {3}
    done = [item.done for item in told]
    assert done == sorted(done)
    assert done[0] == 0
    assert {1, 2} <= set(done)


def test_two_hundred_random_placements_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Any rotation, scale 0.01 to 100, mirrored, a single leaf, a flat card: finite, bounded, well conditioned."""
    conditions: list[float] = []

    def watched(*arguments: np.ndarray) -> GlobalFit:
        fit = fit_global(*arguments)
        conditions.extend(fit.condition.tolist())
        return fit

    monkeypatch.setattr(tree_fitter, "fit_global", watched)
    rng = np.random.default_rng(11)
    meshes = [leaves(), mesh_of(*quad(1.0), "card"), mesh_of(np.eye(3), np.array([[0, 1, 2]]), "leaf")]
    objects = [(mesh_of(*quad(2000.0, -5.0), "ground"), placed(), Role.STATIC)]
    for i in range(200):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0] * rng.choice([-1.0, 1.0])
        matrix = placed()
        matrix[:3, :3] = turn * 10.0 ** rng.uniform(-2, 2)
        matrix[:3, 3] = rng.uniform(-300.0, 300.0, 3) * (1.0, 0.05, 1.0)
        objects.append((meshes[i % 3], matrix, Role.TREE))
    quick = QUICK.replaced(volume_directions=8, volume_spacing=16.0, rays=8)
    baked, _ = bake(scene_of(*objects), quick)
    fits = baked.fits
    assert len(fits.object) == 200
    assert len(conditions) >= 2 * 200
    assert max(conditions) <= 1e8
    for values in (fits.coefficients, fits.rmse_global, fits.rmse_product, fits.centre):
        assert np.isfinite(values).all()
    flat = np.isin(fits.object % 3, (2, 0))  # objects 1, 4, … are crowns
    assert (fits.terms[flat] <= 3).all()
    assert (fits.terms[~flat] >= 1).all()
    assert (fits.rmse_product <= 1.0).all()


def test_samples_stand_for_the_whole_surface() -> None:
    """Their areas add up to the instance's, also mirrored and stretched, and their weights mean the same corners."""
    mesh = leaves()
    mirrored = placed(3.0)
    mirrored[:3, :3] = np.diag([-2.0, 1.0, 0.5])
    world = flatten(scene_of((mesh, placed(), Role.TREE), (mesh, mirrored, Role.TREE)), QUICK)
    samples = sample_mesh(mesh)
    local = np.einsum("ij,ijk->ik", samples.weights, mesh.positions[mesh.faces[samples.face]])
    for number, matrix in ((0, placed()), (1, mirrored)):
        spots = place(samples, mesh, world, number)
        np.testing.assert_allclose(spots.points + world.origin, local @ matrix[:3, :3].T + matrix[:3, 3], atol=1e-5)
        a, b, c = (world.positions[world.faces[world.face_object == number][:, i]] for i in range(3))
        total = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
        assert spots.area.sum() == pytest.approx(total, rel=0.02)
        np.testing.assert_allclose(np.linalg.norm(spots.normals, axis=1), 1.0, atol=1e-6)
        sample_set = as_sample_set(spots, world, 1)
        weights = np.c_[sample_set.barycentric, 1.0 - sample_set.barycentric.sum(1)]
        there = np.einsum("ij,ijk->ik", weights, world.positions[world.faces[sample_set.face]])
        np.testing.assert_allclose(there, spots.points, atol=1e-4)
        of_face = np.unique(np.c_[sample_set.face, sample_set.index], axis=0)
        assert len(of_face) == len(sample_set)


def test_one_object_alone() -> None:
    """The cut-out world holds just that object where it stands, and a blocker that cannot be hit."""
    world = flatten(scene_of(FAR_FLOOR, (leaves(), placed(2.0), Role.TREE)), QUICK)
    alone = only(world, 1)
    np.testing.assert_array_equal(alone.positions[:-1], world.positions[world.first_vertex[1] :])
    assert alone.object_roles == (Role.TREE, Role.BLOCKER)
    assert alone.face_casts.sum() == 1
    assert alone.faces.max() == alone.vertex_count - 1


def test_few_instances_stand_for_many() -> None:
    """Up to eight, spread evenly, without repetition."""
    assert representatives(1).tolist() == [0]
    assert representatives(3).tolist() == [0, 1, 2]
    assert len(representatives(1000)) == 8
    assert representatives(1000)[[0, -1]].tolist() == [0, 999]
