"""Triangles of one material, and what turns bare geometry into what a modelling program would export."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]
Faces = NDArray[np.int64]

# Coordinates are multiples of this, so that the last bits of a machine's sine never reach the file.
POSITION_STEP = 2.0**-12
NORMAL_STEP = 2.0**-20


@dataclass(frozen=True)
class Solid:
    """Bare geometry: welded positions, shape (n, 3), and faces, shape (m, 3), counter-clockwise from outside."""

    positions: Points
    faces: Faces

    def moved(self, x: float, y: float, z: float) -> Solid:
        """Shifted by a vector."""
        return Solid(self.positions + np.array([x, y, z]), self.faces)

    def turned(self, degrees: float) -> Solid:
        """Rotated about +Y."""
        return Solid(self.positions @ yaw_matrix(degrees).T, self.faces)

    def flipped(self) -> Solid:
        """With the winding reversed."""
        return Solid(self.positions, self.faces[:, ::-1])


@dataclass(frozen=True)
class Part:
    """One primitive: vertices split where normals or UVs differ.

    Attributes:
        positions, normals: Shape (n, 3).
        faces: Shape (m, 3).
        material: Name of a material.
        uvs: Shape (n, 2), or None.
    """

    positions: Points
    normals: Points
    faces: Faces
    material: str
    uvs: Points | None = None


def yaw_matrix(degrees: float) -> Points:
    """Rotation about +Y, shape (3, 3)."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def quantised(values: Points, step: float) -> Points:
    """Rounded to multiples of `step`."""
    return np.round(values / step) * step


def joined(*solids: Solid) -> Solid:
    """Several solids as one, not welded to each other."""
    offsets = np.cumsum([0] + [len(s.positions) for s in solids[:-1]])
    return Solid(
        np.concatenate([s.positions for s in solids]),
        np.concatenate([s.faces + o for s, o in zip(solids, offsets, strict=True)]),
    )


def welded(solid: Solid) -> Solid:
    """Coincident positions made one; faces that collapse are dropped."""
    keys = np.round(solid.positions / POSITION_STEP).astype(np.int64)
    unique, inverse = np.unique(keys, axis=0, return_inverse=True)
    faces = inverse.reshape(-1)[solid.faces]
    proper = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    return Solid(unique.astype(np.float64) * POSITION_STEP, faces[proper])


def face_normals(solid: Solid) -> Points:
    """Twice the area of each face times its unit normal, shape (m, 3)."""
    a, b, c = (solid.positions[solid.faces[:, i]] for i in range(3))
    return np.cross(b - a, c - a)


def shaded(solid: Solid, material: str, *, crease: float = 35.0) -> Part:
    """Vertex normals by crease angle, vertices split where they differ.

    A corner's normal is the mean of its own face and of the faces around the vertex that lie within `crease` degrees
    of it, weighted by area.
    """
    normals = face_normals(solid)
    units = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    corner_vertex = solid.faces.reshape(-1)
    corner_face = np.repeat(np.arange(len(solid.faces)), 3)
    order = np.argsort(corner_vertex, kind="stable")
    counts = np.bincount(corner_vertex, minlength=len(solid.positions))
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    # Every pair of corners that share a vertex.
    repeat = counts[corner_vertex]
    first = np.repeat(np.arange(len(corner_vertex)), repeat)
    step = np.arange(len(first)) - np.repeat(np.cumsum(repeat) - repeat, repeat)
    second = order[np.repeat(starts[corner_vertex], repeat) + step]
    near = np.einsum("ij,ij->i", units[corner_face[first]], units[corner_face[second]]) > np.cos(np.radians(crease))
    sums = np.zeros((len(corner_vertex), 3))
    for axis in range(3):
        sums[:, axis] = np.bincount(first[near], normals[corner_face[second[near]], axis], len(corner_vertex))
    sums /= np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), 1e-30)
    rough = np.round(sums * 2**14).astype(np.int64)
    keys, index, inverse = np.unique(
        np.column_stack([corner_vertex, rough]), axis=0, return_index=True, return_inverse=True
    )
    return Part(solid.positions[keys[:, 0]], sums[index], inverse.reshape(-1, 3), material)


def faces_where(solid: Solid, keep: Callable[[Points], NDArray[np.bool_]]) -> Solid:
    """The faces whose middles, shape (m, 3), `keep` says True for."""
    return Solid(solid.positions, solid.faces[keep(solid.positions[solid.faces].mean(axis=1))])


def painted(solid: Solid, below: str, above: str, height: float, *, crease: float = 35.0) -> tuple[Part, ...]:
    """Two materials: `below` for the faces whose middle lies under `height`, `above` for the others.

    Normals don't see the border: they are those of the whole.
    """
    whole = shaded(solid, "", crease=crease)
    low = whole.positions[whole.faces].mean(axis=1)[:, 1] < height
    return tuple(_only(whole, faces, name) for faces, name in ((low, below), (~low, above)) if faces.any())


def _only(part: Part, keep: NDArray[np.bool_], material: str) -> Part:
    used, faces = np.unique(part.faces[keep], return_inverse=True)
    return Part(part.positions[used], part.normals[used], faces.reshape(-1, 3), material)


def with_normals(solid: Solid, normals: Points, material: str, uvs: Points | None = None) -> Part:
    """Geometry with normals as given, right or wrong."""
    return Part(solid.positions, normals, solid.faces, material, uvs)


def merged(*parts: Part) -> tuple[Part, ...]:
    """Parts of the same material made one primitive, in order of first appearance."""
    materials = list(dict.fromkeys(p.material for p in parts))
    return tuple(_concatenated([p for p in parts if p.material == m]) for m in materials)


def _concatenated(parts: list[Part]) -> Part:
    offsets = np.cumsum([0] + [len(p.positions) for p in parts[:-1]])
    uvs = [p.uvs for p in parts if p.uvs is not None]
    return Part(
        np.concatenate([p.positions for p in parts]),
        np.concatenate([p.normals for p in parts]),
        np.concatenate([p.faces + o for p, o in zip(parts, offsets, strict=True)]),
        parts[0].material,
        np.concatenate(uvs) if len(uvs) == len(parts) else None,
    )
