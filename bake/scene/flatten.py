"""Scene → World: instances expanded, recentred in float64, and every face told how it treats a ray."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bake.errors import SceneError
from bake.in_parts import meanwhile
from bake.scene.content_hash import ContentHasher
from bake.scene.extent import box_of, through_matrix
from bake.scene.ground import with_ground
from bake.scene.normals import unit_vectors
from bake.scene.shared_mesh import MeshSharer, SharedMesh
from bake.scene.surface import samplable_faces
from bake.settings import BakeSettings
from bake.types import Float64Array, Int64Array, Role, Scene, SceneObject, World

INDEX_LIMIT = 2**31 - 1


def flatten(scene: Scene, settings: BakeSettings) -> World:
    """Expands a scene into one vertex and one face array in world space.

    - The origin lies near the centre of where most of what is baked stands (`origin_of`), on a coarse grid: a small
      edit hardly ever moves it, and an object's positions then depend on that object alone, to the bit. The subtraction
      is done in float64, so that a level far from zero loses nothing.
    - A mirroring transform flips the winding; normals go by the inverse transpose.
    - A vertex normal is turned round where it opposes every face around it (`opposing_normals`).
    - A face with an exact twin of opposite winding counts as two-sided (`SharedMesh.face_two_sided`).
    - An object's keys may turn its faces, drop its normals, or make one surface of opposed triangles that share their
      vertices (`bake.scene.orientation`); the faces that this makes needless stay, with both flags off.
    - Objects that are neither cast nor received per vertex stay in the world, with both flags off.
    - With the `ground` setting, the last object is the ground plane, a two-sided blocker called `ground`.

    Args:
        scene: As loaded.
        settings: `ground` and `alpha_lookup` matter.

    Raises:
        SceneError: the scene is empty, or has more vertices or faces than 32-bit indices can name.
    """
    with np.errstate(all="ignore"):
        return _flatten(scene, settings, None)


def flatten_about(scene: Scene, settings: BakeSettings, origin: Float64Array) -> World:
    """Like `flatten` about an origin wherever the scene lies: for some objects of a larger world.

    Raises:
        SceneError: as `flatten`.
    """
    with np.errstate(all="ignore"):
        return _flatten(scene, settings, origin)


def _flatten(scene: Scene, settings: BakeSettings, origin: Float64Array | None) -> World:
    objects = scene.objects
    _check_size(scene)
    sharer = MeshSharer(scene.materials)
    shared = {index: sharer.share(scene.meshes[index]) for index in sorted({item.mesh for item in objects})}
    placed = _place(objects, shared, origin)
    hasher = ContentHasher(scene)
    hashing = meanwhile(lambda: tuple(hasher.object_hash(item) for item in objects), int(placed.first_face[-1]))
    face_object = np.repeat(np.arange(len(objects), dtype=np.int32), np.diff(placed.first_face))
    casts = np.array([item.role.casts_opaque for item in objects], np.bool_)[face_object]
    receives = np.array([item.role.receives_per_vertex for item in objects], np.bool_)[face_object]
    faces = np.empty((placed.first_face[-1], 3), np.int32)
    normals = np.zeros((placed.first_vertex[-1], 3), np.float32)
    two_sided, needless = np.empty(len(faces), np.bool_), np.zeros(len(faces), np.bool_)
    openness = np.empty(len(faces), np.float32)
    for number, item in enumerate(objects):
        mesh, vertices, own = shared[item.mesh], placed.vertices(number), placed.faces(number)
        matrix, mirrored = _normal_matrix(item.transform)
        sides = mesh.orientation(item.keys)
        normals[vertices] = unit_vectors(sides.normals, matrix)
        faces[own] = (sides.faces[:, ::-1] if mirrored else sides.faces) + np.int32(vertices.start)
        needless[own] = sides.needless
        two_sided[own] = mesh.face_two_sided(item.keys)
        openness[own] = mesh.openness
    lookup = settings.alpha_lookup and bool(sharer.textures)
    world = World(
        origin=placed.origin,
        positions=placed.positions,
        normals=normals,
        faces=faces,
        face_object=face_object,
        face_casts=casts & ~needless,
        face_samples=receives & ~needless & samplable_faces(placed.positions, faces, face_object, placed.diagonals),
        face_two_sided=two_sided,
        face_openness=openness,
        first_vertex=placed.first_vertex,
        first_face=placed.first_face,
        object_paths=tuple(item.path for item in objects),
        object_roles=tuple(item.role for item in objects),
        object_keys=tuple(item.keys for item in objects),
        object_hash=hashing(),
        vertex_uv=np.concatenate([_uvs(shared[item.mesh]) for item in objects]) if lookup else None,
        face_texture=np.concatenate([shared[item.mesh].texture for item in objects]) if lookup else None,
        textures=tuple(sharer.textures) if lookup else (),
    )
    if settings.ground is None:
        return world
    return with_ground(world, settings.ground, placed.minimum, placed.maximum)


def _uvs(mesh: SharedMesh) -> np.ndarray[tuple[int, int], np.dtype[np.float32]]:
    return np.zeros((len(mesh.mesh.positions), 2), np.float32) if mesh.mesh.uvs is None else mesh.mesh.uvs


def _check_size(scene: Scene) -> None:
    vertices = sum(len(scene.meshes[item.mesh].positions) for item in scene.objects)
    faces = sum(len(scene.meshes[item.mesh].faces) for item in scene.objects)
    if faces == 0:
        raise SceneError("the scene has no triangles", where=str(scene.path), remedy="export it with its meshes")
    if max(vertices, 3 * faces) > INDEX_LIMIT:
        raise SceneError(
            f"with its instances expanded the scene has {vertices:,} vertices and {faces:,} triangles",
            where=str(scene.path),
            remedy="split it into levels of fewer than 700 million triangles",
        )


@dataclass(frozen=True, slots=True)
class _Placed:
    """Where everything lies.

    Attributes:
        origin, positions, first_vertex, first_face: As in `World`.
        minimum, maximum: Shape (3,): recentred bounding box of what is not ignored.
        diagonals: Shape (o,): diagonal of each object's bounding box.
    """

    origin: Float64Array
    positions: Float64Array
    first_vertex: Int64Array
    first_face: Int64Array
    minimum: Float64Array
    maximum: Float64Array
    diagonals: Float64Array

    def vertices(self, number: int) -> slice:
        return slice(int(self.first_vertex[number]), int(self.first_vertex[number + 1]))

    def faces(self, number: int) -> slice:
        return slice(int(self.first_face[number]), int(self.first_face[number + 1]))


def _place(objects: Sequence[SceneObject], shared: dict[int, SharedMesh], given: Float64Array | None) -> _Placed:
    """World positions about the given origin, or the scene's own.

    Boxes are those of the vertices that faces use.
    """
    first_vertex = _offsets([len(shared[item.mesh].mesh.positions) for item in objects])
    first_face = _offsets([len(shared[item.mesh].mesh.faces) for item in objects])
    positions = np.empty((first_vertex[-1], 3))
    low, high = np.empty((len(objects), 3)), np.empty((len(objects), 3))
    for number, item in enumerate(objects):
        mesh = shared[item.mesh]
        own = positions[first_vertex[number] : first_vertex[number + 1]]
        through_matrix(mesh.mesh.positions, item.transform[:3, :3], own)
        used = own
        if len(mesh.used_positions) != len(mesh.mesh.positions):
            used = mesh.used_positions @ item.transform[:3, :3].T
        low[number], high[number] = box_of(used)
    moved = np.array([item.transform[:3, 3] for item in objects])
    counts = np.array([item.role is not Role.IGNORE for item in objects])
    counts |= not counts.any()
    minimum, maximum = (low + moved)[counts].min(axis=0), (high + moved)[counts].max(axis=0)
    if given is None:
        roles = [item.role for item in objects]
        origin = origin_of(roles, low + moved, high + moved, np.diff(first_vertex))
    else:
        origin = np.array(given, np.float64)
    for number, shift in enumerate(moved - origin):
        positions[first_vertex[number] : first_vertex[number + 1]] += shift
    return _Placed(
        origin=origin,
        positions=positions,
        first_vertex=first_vertex,
        first_face=first_face,
        minimum=minimum - origin,
        maximum=maximum - origin,
        diagonals=np.linalg.norm(high - low, axis=1),
    )


def origin_of(roles: Sequence[Role], low: Float64Array, high: Float64Array, vertex_counts: Int64Array) -> Float64Array:
    """The origin of a world, shape (3,), float64: a point of a coarse grid, near the centre of most of what is baked.

    Rounding to float32 costs a vertex the 2⁻²⁴th part of its distance from the origin, and it is where values are baked
    that this matters. So what is ignored or only blocks does not count, and of the rest the box that holds the middle
    nine tenths of all vertices: a backdrop may stand as far off as it likes, on one side of the level, and a prop at
    the edge may be moved, removed or given another role without any other vertex being rounded afresh.

    The grid's spacing is the power of two below a quarter of that box's diagonal. A centre moves on to the next point
    at 9/16 of the way and not in the middle, where the centres of levels built on whole metres would often lie. The
    point is never further off than 9/16 √3 / 4 of the diagonal, which is less than a quarter.

    Args:
        roles: o of them, at least one.
        low, high: Shape (o, 3), metres: the objects' boxes.
        vertex_counts: Shape (o,).
    """
    counts = np.array([role not in (Role.IGNORE, Role.BLOCKER) for role in roles], np.bool_)
    if not counts.any():
        counts = np.array([role is Role.BLOCKER for role in roles], np.bool_)
    if not counts.any():
        counts[:] = True
    minimum = _weighted_quantile(low[counts], vertex_counts[counts], 0.05)
    maximum = _weighted_quantile(high[counts], vertex_counts[counts], 0.95)
    centre = minimum + 0.5 * (maximum - minimum)
    diagonal = float(np.linalg.norm(maximum - minimum))
    if not 0.0 < diagonal < np.inf:
        return centre
    spacing = 2.0 ** np.floor(np.log2(0.25 * diagonal))
    return np.asarray(np.floor(centre / spacing + 7.0 / 16.0) * spacing)


def _weighted_quantile(values: Float64Array, weights: Int64Array, share: float) -> Float64Array:
    """Of each column of values, shape (o, 3), the one that `share` of the weight does not exceed."""
    order = np.argsort(values, axis=0, kind="stable")
    sums = np.cumsum(weights[order], axis=0)
    row = np.argmax(sums >= share * sums[-1], axis=0)
    return values[order[row, np.arange(3)], np.arange(3)]


def _offsets(counts: Sequence[int]) -> Int64Array:
    return np.concatenate(([0], np.cumsum(counts, dtype=np.int64))).astype(np.int64)


def _normal_matrix(transform: Float64Array) -> tuple[Float64Array, bool]:
    """The matrix that takes normals along, and whether the transform mirrors.

    The cofactor matrix is the inverse transpose up to a factor, and exists where there is no inverse.
    """
    linear = transform[:3, :3]
    cofactor = np.stack([np.cross(linear[(row + 1) % 3], linear[(row + 2) % 3]) for row in range(3)])
    mirrored = bool(np.dot(linear[0], cofactor[0]) < 0.0)
    return (-cofactor if mirrored else cofactor), mirrored
