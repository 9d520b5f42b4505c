"""Primitives of a glTF mesh → one `Mesh`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bake.scene.normals import crease_normals
from bake.types import Float32Array, Float64Array, Int64Array, Mesh, PrimitiveRange


@dataclass(frozen=True, slots=True)
class Block:
    """One set of vertices, used by one primitive or shared by several."""

    positions: Float64Array
    normals: Float32Array | None
    uvs: Float32Array | None


@dataclass(frozen=True, slots=True)
class Part:
    """One primitive's triangles, indexing the vertices of its block."""

    primitive: int
    block: int
    faces: Int64Array
    material: int


def merge_parts(
    name: str, index: int, blocks: Sequence[Block], parts: Sequence[Part], *, crease_angle: float
) -> tuple[Mesh, int]:
    """One mesh from all primitives of a glTF mesh; blocks without normals are split along their creases.

    Args:
        name, index: Of the mesh in its file.
        blocks: Vertices, each set once.
        parts: Primitives in the file's order.
        crease_angle: In degrees.

    Returns:
        The mesh, and how many of its vertices had their normals made.
    """
    bare = [number for number, block in enumerate(blocks) if block.normals is None]
    split = _split_bare(bare, blocks, parts, crease_angle) if bare else {}
    sources = [split[i].source if i in split else np.arange(len(block.positions)) for i, block in enumerate(blocks)]
    normals = [split[i].normals if i in split else block.normals for i, block in enumerate(blocks)]
    first = np.concatenate(([0], np.cumsum([len(source) for source in sources])))
    faces = [
        first[part.block] + (split[part.block].faces[part.primitive] if part.block in split else part.faces)
        for part in parts
    ]
    first_face = np.concatenate(([0], np.cumsum([len(part.faces) for part in parts])))
    mesh = Mesh(
        name=name,
        positions=np.concatenate([block.positions[source] for block, source in zip(blocks, sources, strict=True)]),
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
    return mesh, sum(len(item.source) for item in split.values())


@dataclass(frozen=True, slots=True)
class _Split:
    """A block split along its creases: its source vertices, their normals, and faces by primitive."""

    source: Int64Array
    normals: Float32Array
    faces: dict[int, Int64Array]


def _split_bare(
    bare: list[int], blocks: Sequence[Block], parts: Sequence[Part], crease_angle: float
) -> dict[int, _Split]:
    """Normals for the blocks without, made over all of them at once so that their seams shade smoothly."""
    offset = np.concatenate(([0], np.cumsum([len(blocks[number].positions) for number in bare])))
    members = [part for part in parts if part.block in bare]
    result = crease_normals(
        np.concatenate([blocks[number].positions for number in bare]),
        np.concatenate([part.faces + offset[bare.index(part.block)] for part in members]),
        crease_angle,
    )
    begins = np.searchsorted(result.source, offset)
    split: dict[int, _Split] = {}
    for order, number in enumerate(bare):
        span = slice(int(begins[order]), int(begins[order + 1]))
        split[number] = _Split(result.source[span].astype(np.int64) - offset[order], result.normals[span], {})
    position = 0
    for part in members:
        faces = result.faces[position : position + len(part.faces)].astype(np.int64)
        split[part.block].faces[part.primitive] = faces - begins[bare.index(part.block)]
        position += len(part.faces)
    return split


def _merged_uvs(blocks: Sequence[Block], sources: Sequence[Int64Array]) -> Float32Array | None:
    if all(block.uvs is None for block in blocks):
        return None
    return np.concatenate(
        [
            np.zeros((len(source), 2), np.float32) if block.uvs is None else block.uvs[source]
            for block, source in zip(blocks, sources, strict=True)
        ]
    )
