"""A few objects of a scene with all that their values hang on.

Objects that share no vertex are solved apart. A scene is kept as blocks of whole objects: an edit takes one block anew
and follows it through the others.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from bake.settings import BakeSettings
from bake.solve.far_fill import Places
from bake.solve.mass import FaceMoments, sum_moments
from bake.solve.object_match import joiners, receivers
from bake.solve.prior import ScatterSums, SceneScatter
from bake.solve.surface import Surface, build_surface
from bake.solve.system import Equations, build_equations
from bake.types import BoolArray, Float32Array, Float64Array, Int64Array, SampleSet, World

FACES = 16_000
"""Objects are put together until a block has this many faces."""


@dataclass(frozen=True, slots=True)
class Block:
    """Some objects' surface, the sums over their samples, their equations and values.

    Attributes:
        objects: Shape (o,), int64, ascending: their numbers in the world.
        surface: Theirs alone; vertices and faces count from those of the first object on.
        faces_around: Shape (u, m): the faces (columns) that touch each unknown (rows).
        own_alpha: Shape (m,), float64: alpha of faces whose object has its own, NaN elsewhere.
        moments: Sums over the valid samples of each face.
        sums: The part of the scene's mean scatter.
        scene: The mean scatter that the equations pool.
        equations: What is solved.
        values: Shape (u, k), float64, in [0, 1].
        gradient: Shape (u, k), float64, m²: by how much the values miss their rows, Ax - b.
        pull: Shape (u,), float64, m²: the weight of the average in the rows that the values belong to.
        held: Shape (u, k), bool: values that the bounds hold back.
        held_vertices: Shape (k,), int64: vertices of the world with such a value.
        failed: Shape (c,), bool: components that did not converge and keep their average.
        square_error: Shape (k,), float64, m²: Σ dA (interpolated value - sample)².
        tolerance: What the values are solved for, in AO; 0 to the end.
        mass: Σ dA of the valid samples, m².
        places: Where the unknowns are, for those that have no samples near.
    """

    objects: Int64Array
    surface: Surface
    faces_around: csr_array
    own_alpha: Float64Array
    moments: FaceMoments
    sums: ScatterSums
    scene: SceneScatter
    equations: Equations
    values: Float64Array
    gradient: Float64Array
    pull: Float64Array
    held: BoolArray
    held_vertices: Int64Array
    failed: BoolArray
    square_error: Float64Array
    mass: float
    places: Places
    tolerance: float = 0.0

    def rings(self, unknowns: Int64Array, count: int) -> BoolArray:
        """The unknowns within `count` faces of some, shape (u,)."""
        inside = np.zeros(self.surface.unknown_count, np.bool_)
        inside[unknowns] = True
        front = unknowns
        for _ in range(count):
            reached = self.surface.corners[self.faces_of(front)].ravel()
            fresh = np.zeros(len(inside), np.bool_)
            fresh[reached] = True
            front = np.flatnonzero(fresh & ~inside)
            if not len(front):
                break
            inside[front] = True
        return inside

    def faces_of(self, unknowns: Int64Array) -> Int64Array:
        """The faces that touch some unknowns; those that touch several come more than once."""
        return self.faces_around.indices[entries_of(self.faces_around.indptr, unknowns)].astype(np.int64)


@dataclass(frozen=True, slots=True)
class Draft:
    """A block before its equations; attributes as there."""

    objects: Int64Array
    surface: Surface
    faces_around: csr_array
    own_alpha: Float64Array
    moments: FaceMoments
    sums: ScatterSums


@dataclass(frozen=True, slots=True)
class Bake:
    """What values hang on, for the whole scene.

    Attributes:
        first_sample: Shape (o + 1,), int64: object i owns samples `first_sample[i]:first_sample[i + 1]`.
    """

    world: World
    samples: SampleSet
    ao: Float32Array
    valid: BoolArray
    settings: BakeSettings
    first_sample: Int64Array

    @staticmethod
    def of(world: World, samples: SampleSet, ao: Float32Array, valid: BoolArray, settings: BakeSettings) -> Bake:
        """With the samples of each object found."""
        first = np.searchsorted(samples.face, world.first_face.astype(samples.face.dtype)).astype(np.int64)
        return Bake(world, samples, ao, valid, settings, first)

    def extent(self) -> float:
        """Largest coordinate of what receives, in metres."""
        largest = 0.0
        for number in receivers(self.world):
            faces = self.world.faces[self.world.first_face[number] : self.world.first_face[number + 1]]
            own = self.world.positions[self.world.first_vertex[number] : self.world.first_vertex[number + 1]]
            used = own if len(own) <= 3 * len(faces) else own[np.unique(faces) - self.world.first_vertex[number]]
            largest = max(largest, float(np.abs(used).max()))
        return largest


def cut_into_blocks(world: World, objects: Int64Array, *, weld_instances: bool) -> list[Int64Array]:
    """Objects that are solved together: those that may share vertices in one block, others as they come."""
    joining = joiners(world, weld_instances)
    together = [int(i) for i in objects if int(i) in joining]
    blocks = [np.array(together, np.int64)] if together else []
    open_block: list[int] = []
    size = 0
    for number in (int(i) for i in objects if int(i) not in joining):
        faces = int(world.first_face[number + 1] - world.first_face[number])
        if open_block and size + faces > FACES:
            blocks.append(np.array(open_block, np.int64))
            open_block, size = [], 0
        open_block.append(number)
        size += faces
    if open_block:
        blocks.append(np.array(open_block, np.int64))
    return blocks


def ranges(first: Int64Array, objects: Int64Array) -> Int64Array:
    """What some objects own, one after the other; object i owns `first[i]:first[i + 1]`."""
    return entries_of(first, objects)


def entries_of(start: np.ndarray, rows: Int64Array) -> Int64Array:
    """Places of the entries of some rows of a compressed matrix."""
    begin = start[rows].astype(np.int64)
    count = start[rows + 1] - begin
    return np.repeat(begin - (np.cumsum(count) - count), count) + np.arange(int(count.sum()))


def local_faces(world: World, objects: Int64Array, faces: Int64Array) -> Int64Array:
    """Numbers in a block of some faces of its objects."""
    sizes = np.diff(world.first_face)[objects]
    place = np.searchsorted(objects, world.face_object[faces])
    return faces - world.first_face[objects][place] + (np.cumsum(sizes) - sizes)[place]


def block_moments(bake: Bake, objects: Int64Array) -> FaceMoments:
    """Sums over the samples of all faces of some objects."""
    rows = ranges(bake.first_sample, objects)
    local = local_faces(bake.world, objects, bake.samples.face[rows].astype(np.int64))
    faces = int(np.diff(bake.world.first_face)[objects].sum())
    return sum_moments(local, faces, bake.samples.only(rows), bake.ao[rows], bake.valid[rows])


def moments_of_faces(bake: Bake, faces: Int64Array) -> FaceMoments:
    """Sums over the samples of some faces, given as sorted numbers in the world."""
    wanted = faces.astype(bake.samples.face.dtype)  # lest all of the samples' are converted
    begin = np.searchsorted(bake.samples.face, wanted)
    count = np.searchsorted(bake.samples.face, wanted, side="right") - begin
    rows = np.repeat(begin - (np.cumsum(count) - count), count) + np.arange(int(count.sum()))
    local = np.repeat(np.arange(len(faces)), count)
    return sum_moments(local, len(faces), bake.samples.only(rows), bake.ao[rows], bake.valid[rows])


def surface_of(bake: Bake, objects: Int64Array, extent: float) -> Surface:
    """The welded surface of some objects."""
    part = _part_of_world(bake.world, objects)
    return build_surface(
        part,
        crease_angle=bake.settings.crease_angle,
        weld_instances=bake.settings.weld_instances,
        extent=extent,
    )


def alpha_of_faces(world: World, objects: Int64Array) -> Float64Array:
    """Alpha of the faces of objects that have their own, NaN elsewhere."""
    own = np.full(len(objects), np.nan)
    for place, number in enumerate(map(int, objects)):
        alpha = world.object_keys[number].alpha
        if alpha is not None:
            own[place] = alpha
    return np.repeat(own, np.diff(world.first_face)[objects])


def drafted(bake: Bake, objects: Int64Array, extent: float) -> Draft:
    """What a block of these objects begins with."""
    surface, moments = surface_of(bake, objects, extent), block_moments(bake, objects)
    corners = surface.corners
    rows = np.repeat(np.arange(len(corners), dtype=np.int32), 3)
    touch = (np.ones(corners.size, np.bool_), (corners.ravel().astype(np.int32), rows))
    around = csr_array(touch, shape=(surface.unknown_count, len(corners)))
    own_alpha = alpha_of_faces(bake.world, objects)
    return Draft(objects, surface, around, own_alpha, moments, ScatterSums.of(moments))


def moved(bake: Bake, objects: Int64Array, surface: Surface) -> Surface:
    """The same surface where some of its objects were moved as rigid bodies."""
    vertices = ranges(bake.world.first_vertex, objects)
    has = np.flatnonzero(surface.unknown >= 0)
    position = surface.position.copy()
    position[surface.unknown[has]] = bake.world.positions[vertices[has]]
    return replace(surface, position=position)


def begun(draft: Draft, scene: SceneScatter) -> Block:
    """A block with its equations, its values still the average."""
    surface, own_alpha = draft.surface, draft.own_alpha
    equations = build_equations(surface, draft.moments, own_alpha, scene)
    values = equations.average.copy()
    columns = int(values.shape[1])
    return Block(
        objects=draft.objects,
        surface=surface,
        faces_around=draft.faces_around,
        own_alpha=own_alpha,
        moments=draft.moments,
        sums=draft.sums,
        scene=scene,
        equations=equations,
        values=values,
        gradient=np.zeros(values.shape),
        pull=np.zeros(len(values)),
        held=np.zeros(values.shape, np.bool_),
        held_vertices=np.zeros(columns, np.int64),
        failed=np.zeros(len(surface.first) - 1, np.bool_),
        square_error=np.zeros(columns),
        mass=float(draft.moments.mass.sum()),
        places=Places(surface.position, equations.starved, surface.first),
    )


def _part_of_world(world: World, objects: Int64Array) -> World:
    """Some objects as a world of their own."""
    vertices, faces = ranges(world.first_vertex, objects), ranges(world.first_face, objects)
    sizes, counts = np.diff(world.first_vertex)[objects], np.diff(world.first_face)[objects]
    first = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    numbers = [int(number) for number in objects]
    shift = np.repeat(world.first_vertex[objects] - first[:-1], counts)
    return replace(
        world,
        positions=world.positions[vertices],
        normals=world.normals[vertices],
        faces=(world.faces[faces] - shift[:, None]).astype(np.int32),
        face_object=np.repeat(np.arange(len(objects), dtype=np.int32), counts),
        face_casts=world.face_casts[faces],
        face_samples=world.face_samples[faces],
        face_two_sided=world.face_two_sided[faces],
        face_openness=world.face_openness[faces],
        first_vertex=first,
        first_face=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        object_paths=tuple(world.object_paths[i] for i in numbers),
        object_roles=tuple(world.object_roles[i] for i in numbers),
        object_keys=tuple(world.object_keys[i] for i in numbers),
        object_hash=tuple(world.object_hash[i] for i in numbers),
        vertex_uv=None,
        face_texture=None,
        textures=(),
    )
