"""glTF meshes → `Mesh`: all primitives of a mesh merged, with the way back kept as `PrimitiveRange`s."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bake.errors import SceneError
from bake.scene.gltf_buffers import GltfBuffers
from bake.scene.gltf_document import COMPRESSION_ADVICE, GltfDocument
from bake.scene.gltf_materials import GltfMaterial
from bake.scene.gltf_merge import Block, Part, merge_parts
from bake.scene.json_cursor import JsonCursor
from bake.scene.normals import unit_vectors
from bake.scene.primitives import MODE_NAMES, TRIANGLES, triangulate
from bake.types import Finding, Float32Array, Float64Array, Int64Array, Material, Mesh


class MeshReader:
    """Reads meshes of one document, and collects the materials that they use."""

    def __init__(
        self, document: GltfDocument, buffers: GltfBuffers, materials: list[GltfMaterial], *, crease_angle: float
    ) -> None:
        self._document = document
        self._buffers = buffers
        self._sources = materials
        self._crease_angle = crease_angle
        self._variants: dict[int, int] = {}  # materials used on geometry without texture coordinates
        self.materials: list[Material] = [source.material for source in materials]
        self.findings: list[Finding] = []

    def read(self, index: int, path: str) -> Mesh | None:
        """The mesh `index`, or None if it has no triangles.

        Args:
            path: Path of the first object that shows it, for findings and errors.

        Raises:
            SceneError: malformed or missing data, indices out of range, positions that are not finite.
        """
        where = f"{self._document.root.file}: {path}"
        mesh = self._document.root.get("meshes", []).element(JsonCursor(index, self._document.root.file, path))
        if mesh.has("weights"):
            self._report(path, "morph-targets", 1, "Its morph targets are left out: the rest pose is baked.", "info")
        blocks: dict[tuple[int | bytes, ...], int] = {}
        contents: list[Block] = []
        parts: list[Part] = []
        for number, primitive in enumerate(mesh.get("primitives").items()):
            part = self._part(primitive, number, path, where, blocks, contents)
            if part is not None:
                parts.append(part)
        if not any(len(part.faces) for part in parts):
            return None
        name = mesh.get("name", "").text() or f"mesh_{index}"
        merged, made = merge_parts(name, index, contents, parts, crease_angle=self._crease_angle)
        if made:
            angle = f"{self._crease_angle:g}°"
            self._report(path, "normals-made", made, f"It has no normals: made with a crease angle of {angle}.", "info")
        return merged

    def _part(
        self,
        primitive: JsonCursor,
        number: int,
        path: str,
        where: str,
        blocks: dict[tuple[int | bytes, ...], int],
        contents: list[Block],
    ) -> Part | None:
        mode = primitive.get("mode", TRIANGLES).integer(low=0, high=6)
        if mode < TRIANGLES:
            self._report(path, "not-triangles", 1, f"Primitive {number} is made of {MODE_NAMES[mode]}.", "set-aside")
            return None
        attributes = primitive.get("attributes", {})
        if not attributes.has("POSITION"):
            self._report(path, "no-positions", 1, f"Primitive {number} has no positions.", "set-aside")
            return None
        self._refuse_compressed(primitive)
        material_index = self._material_index(primitive)
        source = self._sources[material_index]
        uv_name = f"TEXCOORD_{source.uv_set}"
        textured = source.uv_set >= 0 and attributes.has(uv_name)
        if source.uv_set >= 0 and not textured:
            material_index = self._without_map(material_index, path)
        names = ["POSITION", "NORMAL"] + ([uv_name] if textured else [])
        key: tuple[int | bytes, ...] = tuple(attributes.get(name, -1).integer() for name in names)
        if source.uv_transform is not None and textured:
            key = (*key, source.uv_transform.tobytes())
        if key not in blocks:
            blocks[key] = len(contents)
            contents.append(self._block(attributes, source if textured else None, path, where))
        block = contents[blocks[key]]
        faces = self._faces(primitive, mode, len(block.positions), number, path, where)
        return Part(number, blocks[key], faces, material_index)

    def _block(self, attributes: JsonCursor, textured: GltfMaterial | None, path: str, where: str) -> Block:
        positions = self._buffers.floats(attributes.get("POSITION"), 3)
        finite = np.isfinite(positions).all(axis=1)
        if not finite.all():
            raise SceneError(
                f"vertex {int(np.argmin(finite))} has the position {positions[np.argmin(finite)].tolist()}",
                where=where,
                remedy="repair the mesh: positions must be finite numbers",
            )
        normals = uvs = None
        if attributes.has("NORMAL"):
            stored = self._matching(self._buffers.floats, attributes.get("NORMAL"), 3, len(positions))
            normals = unit_vectors(stored)
            unusable = int((~normals.any(axis=1)).sum())
            if unusable:
                self._report(
                    path, "bad-normals", unusable, "Normals without length or not finite: face normals serve instead."
                )
        if textured is not None:
            stored = self._matching(
                self._buffers.floats, attributes.get(f"TEXCOORD_{textured.uv_set}"), 2, len(positions)
            )
            uvs = self._transformed(np.nan_to_num(stored, nan=0.0, posinf=0.0, neginf=0.0), textured, path)
        return Block(positions, normals, uvs)

    def _matching(
        self, read: Callable[[JsonCursor, int], Float64Array], accessor: JsonCursor, columns: int, count: int
    ) -> Float64Array:
        values = read(accessor, columns)
        if len(values) != count:
            raise SceneError(
                f"{accessor.place} has {len(values)} elements for {count} positions",
                where=accessor.file,
                remedy="export the scene again",
            )
        return values

    def _transformed(self, uvs: Float64Array, source: GltfMaterial, path: str) -> Float32Array:
        if source.uv_transform is not None:
            uvs = uvs @ source.uv_transform[:, :2].T + source.uv_transform[:, 2]
        if not source.wraps and len(uvs) and (uvs.min() < -0.01 or uvs.max() > 1.01):
            self._report(
                path,
                "texture-clamp",
                1,
                f"The alpha texture of {source.material.name} is clamped or mirrored; it is read as repeating.",
            )
        return uvs.astype(np.float32)

    def _faces(
        self, primitive: JsonCursor, mode: int, vertex_count: int, number: int, path: str, where: str
    ) -> Int64Array:
        if primitive.has("indices"):
            indices = self._buffers.integers(primitive.get("indices"))
        else:
            indices = np.arange(vertex_count)
        if len(indices) and indices.max() >= vertex_count:
            raise SceneError(
                f"primitive {number} refers to vertex {int(indices.max())} of {vertex_count}",
                where=where,
                remedy="export the scene again",
            )
        faces, left_over = triangulate(indices, mode)
        if left_over:
            self._report(
                path,
                "incomplete-triangle",
                left_over,
                f"Primitive {number} ends with {left_over} corners that make no whole triangle.",
                "set-aside",
            )
        return faces

    def _material_index(self, primitive: JsonCursor) -> int:
        if not primitive.has("material"):
            return len(self._sources) - 1
        self._document.root.get("materials", []).element(primitive.get("material"))
        return primitive.get("material").integer()

    def _without_map(self, material: int, path: str) -> int:
        if material not in self._variants:
            self._variants[material] = len(self.materials)
            self.materials.append(self._sources[material].without_map.material)
        self._report(
            path,
            "no-texture-coordinates",
            1,
            f"The alpha texture of {self.materials[material].name} counts by its mean: it has no coordinates.",
        )
        return self._variants[material]

    def _refuse_compressed(self, primitive: JsonCursor) -> None:
        extensions = primitive.get("extensions", {})
        position = self._document.root.get("accessors", []).element(primitive.get("attributes").get("POSITION"))
        for name, advice in COMPRESSION_ADVICE.items():
            if extensions.has(name) and not position.has("bufferView"):
                raise self._document.wrong(f"the file is compressed with {name}", remedy=advice)

    def _report(self, path: str, what: str, count: int, detail: str, severity: str = "warning") -> None:
        self.findings.append(Finding(path, what, count, detail, severity))
