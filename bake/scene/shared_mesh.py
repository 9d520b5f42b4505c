"""What all instances of a mesh have in common, worked out once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bake.scene.alpha import OpennessPyramid
from bake.scene.coincident import find_coincident
from bake.scene.orientation import Orientation, oriented, says_orientation
from bake.scene.surface import referenced_vertices
from bake.types import (
    BoolArray,
    Float32Array,
    Float64Array,
    Int32Array,
    Material,
    Mesh,
    ObjectKeys,
)


@dataclass(frozen=True, slots=True)
class SharedMesh:
    """A mesh in object space, ready to be placed.

    Attributes:
        mesh: As loaded.
        plain: Faces and normals where an object says nothing about them.
        used_positions: Shape (u, 3): positions of the vertices that some face uses.
        two_sided: Shape (m,): by material.
        opposed: Shape (m,): whether a face has an exact twin of opposite winding.
        openness: Shape (m,), float32: share of light that passes, averaged over each face's part of the texture.
        texture: Shape (m,), int32: index of each face's openness map, -1 without one.
    """

    mesh: Mesh
    plain: Orientation
    used_positions: Float64Array
    two_sided: BoolArray
    opposed: BoolArray
    openness: Float32Array
    texture: Int32Array

    def orientation(self, keys: ObjectKeys) -> Orientation:
        """Faces and normals as an object's keys want them."""
        return oriented(self.mesh, keys) if says_orientation(keys) else self.plain

    def face_two_sided(self, keys: ObjectKeys) -> BoolArray:
        """Which faces are seen from both sides, shape (m,); the object's own word wins.

        A face with an opposed twin counts, since together they are one surface seen from both sides, and which of the
        two a ray reports is chance.
        """
        if keys.two_sided is not None:
            return np.full(len(self.two_sided), keys.two_sided)
        return self.two_sided | self.opposed


class MeshSharer:
    """Prepares the meshes of one scene; openness maps and their pyramids are numbered and built once.

    Attributes:
        textures: Openness maps in the order of `SharedMesh.texture`.
    """

    def __init__(self, materials: Sequence[Material]) -> None:
        self._materials = materials
        self._pyramids: dict[int, OpennessPyramid] = {}
        self.textures: list[Float32Array] = []
        self._material_texture = np.full(len(materials), -1, np.int32)
        self._two_sided = np.array([material.two_sided for material in materials], np.bool_)
        self._openness = np.array([material.openness for material in materials], np.float32)
        numbers: dict[int, int] = {}  # by identity: several materials may share a map
        for index, material in enumerate(materials):
            if material.openness_map is not None:
                number = numbers.setdefault(id(material.openness_map), len(self.textures))
                self._material_texture[index] = number
                if number == len(self.textures):
                    self.textures.append(material.openness_map)

    def share(self, mesh: Mesh) -> SharedMesh:
        """Prepares one mesh."""
        used = referenced_vertices(mesh.faces, len(mesh.positions))
        texture = self._material_texture[mesh.face_material]
        return SharedMesh(
            mesh=mesh,
            plain=oriented(mesh, ObjectKeys()),
            used_positions=mesh.positions if used.all() else mesh.positions[used],
            two_sided=self._two_sided[mesh.face_material],
            opposed=find_coincident(mesh.positions, mesh.faces).opposed,
            openness=self._face_openness(mesh, texture),
            texture=texture if mesh.uvs is not None else np.full_like(texture, -1),
        )

    def _face_openness(self, mesh: Mesh, texture: Int32Array) -> Float32Array:
        openness = self._openness[mesh.face_material]
        if mesh.uvs is None:
            return openness
        numbers: list[int] = np.flatnonzero(np.bincount(texture + 1)[1:]).tolist()
        for number in numbers:
            if number not in self._pyramids:
                self._pyramids[number] = OpennessPyramid(self.textures[number])
            concerned: BoolArray = texture == number
            corner_uvs: Float32Array = np.take(mesh.uvs, mesh.faces[concerned], axis=0)
            openness[concerned] = self._pyramids[number].face_means(corner_uvs)
        return openness
