"""What the models of a tree's AO look like on the tree: values at its vertices, beside those traced on it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bake.arrays import Float32Array, Float64Array, Int32Array
from bake.decorators.alone import only
from bake.decorators.tracing import SurfaceTracer, trace_samples
from bake.samples import place_samples
from bake.settings import BakeSettings
from bake.solve import map_to_vertices
from bake.types import Role, SampleSet, World


@dataclass(frozen=True, slots=True)
class TreeFigure:
    """One tree under each model (after figure 2 of Sloan et al. 2013).

    Attributes:
        scene, tree: The scene's name and the object's path.
        up_axis: 1 for +Y up, 2 for +Z up.
        distances: Of the AO columns, metres.
        positions: Shape (n, 3), metres from the tree's own centre.
        faces: Shape (m, 3), int32.
        values: Model to AO at the vertices, shape (n, k), in [0, 1]; "traced" is what the others are held to.
        errors: Model to RMSE against what is traced, shape (k,).
    """

    scene: str
    tree: str
    up_axis: int
    distances: tuple[float, ...]
    positions: Float64Array
    faces: Int32Array
    values: Mapping[str, Float32Array]
    errors: Mapping[str, Float64Array]


def traced_at_vertices(
    world: World, number: int, tracer: SurfaceTracer, settings: BakeSettings
) -> tuple[Float32Array, Float64Array]:
    """AO of one tree traced on it and mapped to its vertices like any surface.

    Args:
        world: All of it.
        number: The tree.
        tracer: Of the world, with the rays of `settings`.
        settings: How samples are placed and mapped.

    Returns:
        Values, shape (n, k), in [0, 1], and the vertex normals that go with them, shape (n, 3).
    """
    alone = only(world, number)
    own = len(alone.faces) - 1  # the last one cannot be hit
    vertex_count = int(world.first_vertex[number + 1] - world.first_vertex[number])
    receives = np.arange(len(alone.faces)) < own
    surface = dataclasses.replace(
        alone, face_samples=receives, object_roles=(Role.RECEIVER, Role.BLOCKER), face_casts=~receives
    )
    samples = place_samples(surface, settings)
    first = int(world.first_face[number])
    seeds = np.zeros(world.face_count, np.uint32)
    seeds[first : first + own] = samples.face_seed[:own]
    there = SampleSet(samples.face + np.int32(first), samples.barycentric, samples.area, samples.index, seeds)
    tally = trace_samples(tracer, there, settings.distance_count)
    field = map_to_vertices(surface, samples, tally.ao, tally.valid(settings.back_face_threshold), settings)
    values = field.ao[:vertex_count]
    return np.where(np.isfinite(values), values, np.float32(1.0)), vertex_normals(world, number)


def vertex_normals(world: World, number: int) -> Float64Array:
    """An object's vertex normals, shape (n, 3), unit: the mean of the faces around where it has none of its own."""
    first, last = (int(v) for v in world.first_vertex[number : number + 2])
    normals = world.normals[first:last].astype(np.float64)
    positions = world.positions[first:last]
    faces = world.faces[world.first_face[number] : world.first_face[number + 1]] - first
    a, b, c = (positions[faces[:, corner]] for corner in range(3))
    sums = np.zeros_like(normals)
    for corner in range(3):
        np.add.at(sums, faces[:, corner], np.cross(b - a, c - a))
    normals = np.where(normals.any(axis=1, keepdims=True), normals, sums)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / np.where(length > 0.0, length, 1.0)
