"""glTF meshes → `Mesh`: all primitives of a mesh merged, with the way back kept as `PrimitiveRange`s."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bake.errors import SceneError
from bake.scene.gltf_buffers import GltfBuffers
from bake.scene.gltf_document import COMPRESSION_ADVICE, GltfDocument
from bake.scene.gltf_materials import GltfMaterial
from bake.scene.json_cursor import JsonCursor
from bake.scene.normals import crease_normals, unit_vectors
from bake.scene.primitives import MODE_NAMES, TRIANGLES, triangulate
from bake.types import Finding, Float32Array, Float64Array, Int64Array, Material, Mesh, PrimitiveRange


@dataclass(slots=True)
class _Block:
    """One set of vertices, used by one primitive or shared by several."""

    positions: Float64Array
    normals: Float32Array | None
    uvs: Float32Array | None


@dataclass(slots=True)
class _Part:
    """One primitive's triangles, indexing the vertices of its block."""

    primitive: int
    block: int
    faces: Int64Array
    material: int


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
        contents: list[_Block] = []
        parts: list[_Part] = []
        for number, primitive in enumerate(mesh.get("primitives").items()):
            part = self._part(primitive, number, path, where, blocks, contents)
            if part is not None:
                parts.append(part)
        if not any(len(part.faces) for part in parts):
            return None
        name = mesh.get("name", "").text() or f"mesh_{index}"
        return self._merge(name, index, path, contents, parts)

    def _part(
        self,
        primitive: JsonCursor,
        number: int,
        path: str,
        where: str,
        blocks: dict[tuple[int | bytes, ...], int],
        contents: list[_Block],
    ) -> _Part | None:
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
        return _Part(number, blocks[key], faces, material_index)

    def _block(self, attributes: JsonCursor, textured: GltfMaterial | None, path: str, where: str) -> _Block:
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
        return _Block(positions, normals, uvs)

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

    def _merge(self, name: str, index: int, path: str, blocks: list[_Block], parts: list[_Part]) -> Mesh:
        bare = [number for number, block in enumerate(blocks) if block.normals is None]
        split = self._split_bare(bare, blocks, parts) if bare else {}
        if bare:
            made = sum(len(split[number][0]) for number in bare)
            angle = f"{self._crease_angle:g}°"
            self._report(path, "normals-made", made, f"It has no normals: made with a crease angle of {angle}.", "info")
        sources = [split[i][0] if i in split else np.arange(len(block.positions)) for i, block in enumerate(blocks)]
        normals = [split[i][1] if i in split else block.normals for i, block in enumerate(blocks)]
        first = np.concatenate(([0], np.cumsum([len(source) for source in sources])))
        positions = np.concatenate([block.positions[source] for block, source in zip(blocks, sources, strict=True)])
        faces = [
            first[part.block] + (split[part.block][2][part.primitive] if part.block in split else part.faces)
            for part in parts
        ]
        first_face = np.concatenate(([0], np.cumsum([len(part.faces) for part in parts])))
        return Mesh(
            name=name,
            positions=positions,
            normals=np.concatenate([item for item in normals if item is not None]),
            faces=np.concatenate(faces).astype(np.int32),
            face_material=np.repeat([part.material for part in parts], np.diff(first_face)).astype(np.int32),
            primitives=tuple(
                PrimitiveRange(
                    part.primitive,
                    int(first[part.block]),
                    int(first[part.block + 1] - first[part.block]),
                    int(first_face[number]),
                    len(part.faces),
                )
                for number, part in enumerate(parts)
            ),
            source_index=index,
            uvs=_merged_uvs(blocks, sources),
            source_vertex=np.concatenate(sources).astype(np.int32) if bare else None,
        )

    def _split_bare(
        self, bare: list[int], blocks: list[_Block], parts: list[_Part]
    ) -> dict[int, tuple[Int64Array, Float32Array, dict[int, Int64Array]]]:
        """Normals for the blocks without: per block its source vertices, normals, and faces by primitive."""
        offset = np.concatenate(([0], np.cumsum([len(blocks[number].positions) for number in bare])))
        members = [part for part in parts if part.block in bare]
        result = crease_normals(
            np.concatenate([blocks[number].positions for number in bare]),
            np.concatenate([part.faces + offset[bare.index(part.block)] for part in members]),
            self._crease_angle,
        )
        begins = np.searchsorted(result.source, offset)
        split: dict[int, tuple[Int64Array, Float32Array, dict[int, Int64Array]]] = {}
        for order, number in enumerate(bare):
            span = slice(int(begins[order]), int(begins[order + 1]))
            split[number] = (result.source[span].astype(np.int64) - offset[order], result.normals[span], {})
        position = 0
        for part in members:
            faces = result.faces[position : position + len(part.faces)].astype(np.int64)
            split[part.block][2][part.primitive] = faces - begins[bare.index(part.block)]
            position += len(part.faces)
        return split

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


def _merged_uvs(blocks: list[_Block], sources: list[Int64Array]) -> Float32Array | None:
    if all(block.uvs is None for block in blocks):
        return None
    return np.concatenate(
        [
            np.zeros((len(source), 2), np.float32) if block.uvs is None else block.uvs[source]
            for block, source in zip(blocks, sources, strict=True)
        ]
    )
