"""Scene → World: instances expanded, recentred in float64, and every face told how it treats a ray."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bake.errors import SceneError
from bake.scene.alpha import face_openness
from bake.scene.coincident import find_coincident
from bake.scene.content_hash import ContentHasher
from bake.scene.ground import GROUND_PATH, QUAD_FACES, ground_quad
from bake.scene.normals import opposing_normals, unit_vectors
from bake.settings import BakeSettings, Ground
from bake.types import (
    BoolArray,
    Float32Array,
    Float64Array,
    Int32Array,
    Int64Array,
    Material,
    Mesh,
    ObjectKeys,
    Role,
    Scene,
    World,
)

INDEX_LIMIT = 2**31 - 1
SLIVER_RATIO = 1e-6  # height over longest edge
AREA_RATIO = 1e-12  # area over the square of the object's diagonal: what float32 coordinates can still resolve
FACES_AT_ONCE = 1 << 18


@dataclass(frozen=True, slots=True)
class _SharedMesh:
    """What all instances of a mesh have in common."""

    positions: Float64Array
    normals: Float32Array
    faces: Int32Array
    two_sided: BoolArray
    opposed: BoolArray
    openness: Float32Array
    texture: Int32Array | None
    uvs: Float32Array | None


def flatten(scene: Scene, settings: BakeSettings) -> World:
    """Expands a scene into one vertex and one face array in world space.

    - The origin is the centre of the bounding box of all objects that are not ignored; the subtraction is done in
      float64, so that a level far from zero loses nothing.
    - A mirroring transform flips the winding; normals go by the inverse transpose.
    - A vertex normal is turned round where it opposes every face around it (`opposing_normals`).
    - A face with an exact twin of opposite winding counts as two-sided: together they are a surface seen from both
      sides, and which of the two a ray reports is chance.
    - Objects that are neither cast nor received per vertex stay in the world, with both flags off.
    - With the `ground` setting, the last object is the ground plane, a two-sided blocker called `ground`.

    Args:
        scene: As loaded.
        settings: `ground` and `alpha_lookup` matter.

    Raises:
        SceneError: the expanded scene has more vertices or faces than 32-bit indices can name.
    """
    with np.errstate(all="ignore"):
        return _flatten(scene, settings)


def _flatten(scene: Scene, settings: BakeSettings) -> World:
    objects = scene.objects
    _check_size(scene)
    first_vertex = _offsets([len(scene.meshes[item.mesh].positions) for item in objects])
    first_face = _offsets([len(scene.meshes[item.mesh].faces) for item in objects])
    textures = _Textures(scene.materials, wanted=settings.alpha_lookup)
    shared = {index: _share(scene.meshes[index], scene.materials, textures) for index in {o.mesh for o in objects}}
    positions, origin, minimum, maximum = _place(scene, first_vertex)
    normals = np.zeros((first_vertex[-1], 3), np.float32)
    faces = np.empty((first_face[-1], 3), np.int32)
    two_sided = np.empty(first_face[-1], np.bool_)
    openness = np.empty(first_face[-1], np.float32)
    texture = np.full(first_face[-1], -1, np.int32) if textures.used else None
    uvs = np.zeros((first_vertex[-1], 2), np.float32) if textures.used else None
    for number, item in enumerate(objects):
        vertex_span = slice(first_vertex[number], first_vertex[number + 1])
        face_span = slice(first_face[number], first_face[number + 1])
        mesh = shared[item.mesh]
        matrix, mirrored = _normal_matrix(item.transform)
        normals[vertex_span] = unit_vectors(mesh.normals.astype(np.float64) @ matrix.T)
        faces[face_span] = (mesh.faces[:, ::-1] if mirrored else mesh.faces) + np.int32(first_vertex[number])
        two_sided[face_span] = _two_sided(mesh, item.keys)
        openness[face_span] = mesh.openness
        if texture is not None and mesh.texture is not None:
            texture[face_span] = mesh.texture
        if uvs is not None and mesh.uvs is not None:
            uvs[vertex_span] = mesh.uvs
    roles = [item.role for item in objects]
    face_object = np.repeat(np.arange(len(objects), dtype=np.int32), np.diff(first_face))
    receives = np.array([role.receives_per_vertex for role in roles], np.bool_)[face_object]
    hasher = ContentHasher(scene)
    world = World(
        origin=origin,
        positions=positions,
        normals=normals,
        faces=faces,
        face_object=face_object,
        face_casts=np.array([role.casts_opaque for role in roles], np.bool_)[face_object],
        face_samples=receives & samplable_faces(positions, faces, first_vertex, face_object),
        face_two_sided=two_sided,
        face_openness=openness,
        first_vertex=first_vertex,
        first_face=first_face,
        object_paths=tuple(item.path for item in objects),
        object_roles=tuple(roles),
        object_keys=tuple(item.keys for item in objects),
        object_hash=tuple(hasher.object_hash(item) for item in objects),
        vertex_uv=uvs,
        face_texture=texture,
        textures=tuple(textures.maps) if textures.used else (),
    )
    return world if settings.ground is None else with_ground(world, settings.ground, minimum, maximum)


def _check_size(scene: Scene) -> None:
    vertices = sum(len(scene.meshes[item.mesh].positions) for item in scene.objects)
    faces = sum(len(scene.meshes[item.mesh].faces) for item in scene.objects)
    if max(vertices, 3 * faces) > INDEX_LIMIT:
        raise SceneError(
            f"with its instances expanded the scene has {vertices:,} vertices and {faces:,} triangles",
            where=str(scene.path),
            remedy="split it into levels of fewer than 700 million triangles",
        )


def _offsets(counts: Sequence[int]) -> Int64Array:
    return np.concatenate(([0], np.cumsum(counts, dtype=np.int64))).astype(np.int64)


class _Textures:
    """Numbers the openness maps in use; without `alpha_lookup` it stays empty."""

    def __init__(self, materials: Sequence[Material], *, wanted: bool) -> None:
        self.maps: list[Float32Array] = []
        self._number: dict[int, int] = {}  # by identity: materials of one image may share it
        self.by_material = np.full(len(materials), -1, np.int32)
        if wanted:
            for index, material in enumerate(materials):
                if material.openness_map is not None:
                    self.by_material[index] = self._numbered(material.openness_map)
        self.used = bool(self.maps)

    def _numbered(self, openness_map: Float32Array) -> int:
        if id(openness_map) not in self._number:
            self._number[id(openness_map)] = len(self.maps)
            self.maps.append(openness_map)
        return self._number[id(openness_map)]


def _share(mesh: Mesh, materials: Sequence[Material], textures: _Textures) -> _SharedMesh:
    normals = mesh.normals
    opposing = opposing_normals(mesh.positions, normals, mesh.faces)
    if opposing.any():
        normals = np.where(opposing[:, None], -normals, normals)
    openness = np.array([material.openness for material in materials], np.float32)[mesh.face_material]
    if mesh.uvs is not None:
        for index in np.unique(mesh.face_material):
            openness_map = materials[index].openness_map
            if openness_map is not None:
                concerned = np.flatnonzero(mesh.face_material == index)
                openness[concerned] = face_openness(openness_map, mesh.uvs[mesh.faces[concerned]])
    return _SharedMesh(
        positions=mesh.positions,
        normals=normals,
        faces=mesh.faces,
        two_sided=np.array([material.two_sided for material in materials], np.bool_)[mesh.face_material],
        opposed=find_coincident(mesh.positions, mesh.faces).opposed,
        openness=openness,
        texture=textures.by_material[mesh.face_material] if textures.used and mesh.uvs is not None else None,
        uvs=mesh.uvs,
    )


def _two_sided(mesh: _SharedMesh, keys: ObjectKeys) -> BoolArray | bool:
    return mesh.two_sided | mesh.opposed if keys.two_sided is None else keys.two_sided


def _place(scene: Scene, first_vertex: Int64Array) -> tuple[Float64Array, Float64Array, Float64Array, Float64Array]:
    """Recentred positions, the origin, and the recentred bounding box of what is not ignored.

    A first origin near the scene keeps every sum small; the exact box then moves it to the centre.
    """
    objects = scene.objects
    near = np.mean([item.transform[:3, 3] for item in objects], axis=0) if objects else np.zeros(3)
    positions = np.empty((first_vertex[-1], 3))
    counts = any(item.role is not Role.IGNORE for item in objects)
    minimum, maximum = np.full(3, np.inf), np.full(3, -np.inf)
    for number, item in enumerate(objects):
        placed = positions[first_vertex[number] : first_vertex[number + 1]]
        np.matmul(scene.meshes[item.mesh].positions, item.transform[:3, :3].T, out=placed)
        placed += item.transform[:3, 3] - near
        if item.role is not Role.IGNORE or not counts:
            referenced = placed  # unreferenced vertices may stretch the box; that only moves the origin
            minimum, maximum = np.minimum(minimum, referenced.min(axis=0)), np.maximum(maximum, referenced.max(axis=0))
    centre = 0.5 * (minimum + maximum) if objects else np.zeros(3)
    positions -= centre
    return positions, near + centre, minimum - centre, maximum - centre


def _normal_matrix(transform: Float64Array) -> tuple[Float64Array, bool]:
    """The cofactor matrix, which is the inverse transpose up to a factor and exists without an inverse too."""
    linear = transform[:3, :3]
    cofactor = np.stack([np.cross(linear[(row + 1) % 3], linear[(row + 2) % 3]) for row in range(3)])
    mirrored = bool(np.dot(linear[0], cofactor[0]) < 0.0)
    return (-cofactor if mirrored else cofactor), mirrored


def samplable_faces(
    positions: Float64Array, faces: Int32Array, first_vertex: Int64Array, face_object: Int32Array
) -> BoolArray:
    """Faces with enough surface to take samples, shape (m,): no points, no slivers.

    A face is left out if its area is below 1e-12 of the square of its object's diagonal, or its height below 1e-6 of
    its longest edge: its normal would be made of rounding errors. Measured against the object, not the scene, so that
    a small prop in a wide level keeps its faces.
    """
    diagonal_squared = np.zeros(len(first_vertex) - 1)
    for number in range(len(diagonal_squared)):
        own = positions[first_vertex[number] : first_vertex[number + 1]]
        if len(own):
            diagonal_squared[number] = np.square(own.max(axis=0) - own.min(axis=0)).sum()
    enough = np.empty(len(faces), np.bool_)
    for begin in range(0, len(faces), FACES_AT_ONCE):
        span = slice(begin, begin + FACES_AT_ONCE)
        enough[span] = enough_surface(positions[faces[span]], diagonal_squared[face_object[span]])
    return enough


def enough_surface(corners: Float64Array, diagonal_squared: Float64Array | float) -> BoolArray:
    """Whether faces are neither points nor slivers, shape (m,).

    Args:
        corners: Shape (m, 3, 3).
        diagonal_squared: Square of their object's diagonal, a number or shape (m,).
    """
    edges = np.roll(corners, -1, axis=1) - corners
    doubled_area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    longest_squared = np.square(edges).sum(axis=2).max(axis=1, initial=0.0)
    return (
        (doubled_area > 0.0)
        & (0.5 * doubled_area >= AREA_RATIO * diagonal_squared)
        & (doubled_area >= SLIVER_RATIO * longest_squared)
    )


def with_ground(world: World, ground: Ground, minimum: Float64Array, maximum: Float64Array) -> World:
    """`world` with the ground plane as its last object.

    Args:
        world: Without a ground.
        ground: Side, size and distance.
        minimum, maximum: Shape (3,): the scene's box, relative to the world's origin.
    """
    from dataclasses import replace

    corners, normal = ground_quad(ground, minimum, maximum)
    path = GROUND_PATH
    while path in world.object_paths:
        path += "#"
    number, two = world.object_count, len(QUAD_FACES)

    def extended(array: np.ndarray, value: object) -> np.ndarray:
        return np.concatenate((array, np.full(two, value, array.dtype)))

    return replace(
        world,
        positions=np.concatenate((world.positions, corners)),
        normals=np.concatenate((world.normals, np.tile(normal, (4, 1)).astype(np.float32))),
        faces=np.concatenate((world.faces, QUAD_FACES + np.int32(world.vertex_count))),
        face_object=extended(world.face_object, number),
        face_casts=extended(world.face_casts, True),
        face_samples=extended(world.face_samples, False),
        face_two_sided=extended(world.face_two_sided, True),
        face_openness=extended(world.face_openness, 0.0),
        first_vertex=np.append(world.first_vertex, world.vertex_count + 4),
        first_face=np.append(world.first_face, world.face_count + two),
        object_paths=(*world.object_paths, path),
        object_roles=(*world.object_roles, Role.BLOCKER),
        object_keys=(*world.object_keys, ObjectKeys(two_sided=True)),
        object_hash=(*world.object_hash, ContentHasher.ground_hash(world.origin, corners)),
        vertex_uv=None if world.vertex_uv is None else np.concatenate((world.vertex_uv, np.zeros((4, 2), np.float32))),
        face_texture=None if world.face_texture is None else extended(world.face_texture, -1),
    )
