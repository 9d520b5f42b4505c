"""Local AO: what a tree does to itself, baked once for each mesh and shared by all its instances."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from bake.arrays import BoolArray, Float32Array, Float64Array, Int64Array
from bake.decorator_types import TreeModel
from bake.decorators.alone import only, with_unhittable_face
from bake.decorators.tracing import TreeTracer
from bake.decorators.tree_samples import PlacedSamples
from bake.decorators.volume import evaluate, trace_volume, tree_boxes
from bake.decorators.volume_grid import build_grid
from bake.settings import BakeSettings
from bake.types import Role, SampleSet, Scene, SceneObject, Tally, VertexField, World


class OpenTracer(Protocol):
    """Builds a tracer for a world."""

    def __call__(self, world: World, settings: BakeSettings) -> TreeTracer: ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class StagesLent:
    """Other stages of the bake, lent to this one, which may not know them.

    Attributes:
        flatten: Scene to world.
        place_samples: Surface samples of a world.
        open_tracer: A tracer for a world, to be closed after use.
        map_to_vertices: Sample values and validity to vertex values.
    """

    flatten: Callable[[Scene, BakeSettings], World]
    place_samples: Callable[[World, BakeSettings], SampleSet]
    open_tracer: OpenTracer
    map_to_vertices: Callable[[World, SampleSet, Float32Array, BoolArray, BakeSettings], VertexField]


def trees_by_mesh(scene: Scene, world: World) -> dict[int, list[int]]:
    """Objects that are trees with faces, by mesh, both in scene order."""
    groups: dict[int, list[int]] = {}
    for number, item in enumerate(scene.objects):
        if item.role is Role.TREE and world.first_face[number + 1] > world.first_face[number]:
            groups.setdefault(item.mesh, []).append(number)
    return groups


def bake_alone(
    scene: Scene, mesh: int, trees: Sequence[SceneObject], settings: BakeSettings, stages: StagesLent
) -> Generator[int, None, TreeModel]:
    """Bakes one tree mesh in isolation, as a surface whose only occluder is the tree itself.

    It attenuates as it does in the scene, crossing by crossing, with its leaf cards as open as they are there. Nothing
    stops a ray, so neither the falloff nor the size matters: one local AO is right for instances of any scale, and for
    every distance. The mesh is still baked at the geometric mean of its instances' scales, so that rays that end early
    end where most instances' do. Keys (transmission, offset …) are those of the first instance.

    Args:
        scene: Holds the mesh and its materials.
        mesh: Index into `scene.meshes`.
        trees: The instances, at least one.
        settings: As for the surface; the ground plane is left out.
        stages: Flatten, sample, trace, solve.

    Yields:
        How many more rays were traced.

    Returns:
        The model.
    """
    scales = np.array([instance_scale(item) for item in trees])
    usable = scales[scales > 0.0]
    scale = float(np.exp(np.log(usable).mean())) if len(usable) else 1.0
    alone = SceneObject(
        path=trees[0].path, mesh=mesh, transform=np.diag([scale, scale, scale, 1.0]), role=Role.TREE, keys=trees[0].keys
    )
    own = settings.replaced(ground=None)
    world = stages.flatten(replace(scene, objects=(alone,), regions=(), findings=()), own)
    world = with_unhittable_face(replace(world, face_samples=np.ones(world.face_count, np.bool_)))
    samples = stages.place_samples(world, own)
    ao = np.ones((len(scene.meshes[mesh].positions), settings.distance_count), np.float32)
    if len(samples):
        tally = Tally.empty(len(samples), settings.distance_count)
        with stages.open_tracer(world, own) as tracer:
            for batch in samples.batches(tracer.batch_size):
                tracer.accumulate(samples, batch, tally)
                yield int(tally.rays[batch].sum(dtype=np.int64))
        # The mapping knows surfaces that receive, not trees.
        surface = replace(world, object_roles=(Role.RECEIVER, Role.BLOCKER))
        field = stages.map_to_vertices(surface, samples, tally.ao, np.ones(len(samples), np.bool_), own)
        solved = field.ao[: len(ao)]
        ao = np.where(np.isfinite(solved), solved, np.float32(1.0))
    return TreeModel(mesh, ao)


def instance_scale(item: SceneObject) -> float:
    """Cube root of the volume that the transform gives a unit cube."""
    return float(np.cbrt(abs(np.linalg.det(item.transform[:3, :3]))))


REPRESENTATIVES = 8
"""Instances of a mesh for which the volume around the tree alone is traced; all of them, if there are no more."""


def representatives(count: int) -> Int64Array:
    """Which of `count` instances, in order, stand for all."""
    return np.unique(np.linspace(0, count - 1, min(count, REPRESENTATIVES)).round().astype(np.int64))


def seen_by_volume(
    world: World, number: int, placed: PlacedSamples, spacing: float, settings: BakeSettings, stages: StagesLent
) -> Generator[int, None, Float64Array]:
    """Local AO at samples of one tree as a volume of the same voxels would show it, if the tree stood alone.

    A volume is blind to detail finer than its spacing, and to what quadratic harmonics leave out. Gold signals from it
    are so too; fitted against the true local AO, that would count as an effect of the surroundings.

    Args:
        world: With the tree in it.
        number: The tree.
        placed: Its samples.
        spacing: Of the volume.
        settings: Of the bake.
        stages: The tracer is needed.

    Yields:
        How many more rays were traced.

    Returns:
        Shape (n, k), float64.
    """
    low, high = tree_boxes(world.positions, world.faces, world.first_face, np.array([number]))
    grid = build_grid(low, high, spacing, world.origin)
    with stages.open_tracer(only(world, number), settings) as tracer:
        work = trace_volume(
            grid,
            tracer,
            directions=settings.volume_directions,
            back_face_threshold=settings.back_face_threshold,
            seed=settings.seed,
        )
        before = 0
        while True:
            try:
                done = next(work)
            except StopIteration as stop:
                volume = stop.value[0]
                break
            yield (done - before) * settings.volume_directions
            before = done
    return evaluate(volume, placed.points, placed.normals).astype(np.float64)
