"""Content hashes of objects: equal exactly if nothing about the object that a bake can see has changed."""

from __future__ import annotations

import hashlib
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.types import Float64Array, Material, Mesh, ObjectKeys, Scene, SceneObject

DIGEST_BYTES = 16

_KEY_NAMES = sorted(item.name for item in fields(ObjectKeys))


class ContentHasher:
    """Hashes the objects of one scene; what instances share is hashed once.

    Names and numbering do not enter: an object that is renamed or moves within the file keeps its hash.

    Args:
        scene: Whose objects.
        earlier: Of a scene with the same meshes and materials, whose hashes are taken over; of any other, nothing is.
    """

    def __init__(self, scene: Scene, earlier: ContentHasher | None = None) -> None:
        self._scene = scene
        self._meshes: dict[int, bytes] = {}
        self._materials: dict[int, bytes] = {}
        if earlier is not None and _same(earlier._scene, scene):
            self._meshes, self._materials = earlier._meshes, earlier._materials

    def object_hash(self, item: SceneObject) -> str:
        """Hex hash of an object's geometry, transform, role, keys and materials."""
        if item.mesh not in self._meshes:
            self._meshes[item.mesh] = self._mesh_digest(self._scene.meshes[item.mesh])
        keys = [(name, value) for name in _KEY_NAMES if (value := getattr(item.keys, name)) is not None]
        said = repr((item.role.value, keys))
        return _digest(self._meshes[item.mesh], item.transform.tobytes(), said.encode()).hex()

    @staticmethod
    def ground_hash(origin: Float64Array, corners: Float64Array) -> str:
        """Hex hash of a ground plane by its place in the world."""
        return _digest(b"ground", (corners + origin).tobytes()).hex()

    def _mesh_digest(self, mesh: Mesh) -> bytes:
        used, local = np.unique(mesh.face_material, return_inverse=True)
        arrays = (mesh.positions, mesh.normals, mesh.faces, local.astype(np.int32), mesh.uvs)
        parts = [b"" if array is None else _bytes_of(array) for array in arrays]
        return _digest(*parts, *(self._material_digest(index) for index in used.tolist()))

    def _material_digest(self, index: int) -> bytes:
        if index not in self._materials:
            self._materials[index] = _material_digest(self._scene.materials[index])
        return self._materials[index]


def _same(a: Scene, b: Scene) -> bool:
    return all(
        len(ours) == len(theirs) and all(one is other for one, other in zip(ours, theirs, strict=True))
        for ours, theirs in ((a.meshes, b.meshes), (a.materials, b.materials))
    )


def _bytes_of(array: NDArray[Any]) -> memoryview:
    return np.ascontiguousarray(array).reshape(-1).view(np.uint8).data


def _digest(*parts: bytes | memoryview) -> bytes:
    digest = hashlib.blake2b(digest_size=DIGEST_BYTES)
    for part in parts:
        digest.update(len(part).to_bytes(8, "little"))
        digest.update(part)
    return digest.digest()


def _material_digest(material: Material) -> bytes:
    texture = b"" if material.openness_map is None else _bytes_of(material.openness_map)
    shape = () if material.openness_map is None else material.openness_map.shape
    return _digest(repr((material.two_sided, material.openness, shape)).encode(), texture)
