"""Which side of a face is outside and which normals count, where an object's keys overrule its file.

- `winding = "normals"` turns every face to the side that its corner normals point to: for meshes that were mirrored
  without their triangles. `winding = "flipped"` turns all of them.
- `normals = "faces"` forgets the vertex normals; rays then leave around each face's own.
- `two_sided = true` makes one surface of two opposed triangles on the same three vertices. Those have one value between
  them, and without this it is the mean of what both sides see.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.scene.normals import known_opposing_normals
from bake.types import BoolArray, Float32Array, Float64Array, Int32Array, Mesh, ObjectKeys


@dataclass(frozen=True, slots=True)
class Orientation:
    """A mesh as its keys want it.

    Attributes:
        faces: Shape (m, 3), int32.
        normals: Shape (n, 3), float32: turned round where they oppose every face around them; zero to be ignored.
        needless: Shape (m,): faces that an opposed twin on the same vertices stands for; they neither cast nor sample.
        turned: Faces whose winding differs from the file's.
    """

    faces: Int32Array
    normals: Float32Array
    needless: BoolArray
    turned: int


def says_orientation(keys: ObjectKeys) -> bool:
    """Whether the keys change anything that `oriented` looks at."""
    return bool(keys.two_sided) or keys.winding not in (None, "file") or keys.normals not in (None, "file")


def oriented(mesh: Mesh, keys: ObjectKeys) -> Orientation:
    """Turns faces and normals as the keys say.

    Args:
        mesh: As loaded.
        keys: `winding`, `normals` and `two_sided` matter.
    """
    faces, normals = mesh.faces, mesh.normals
    turned = np.zeros(len(faces), np.bool_)
    if keys.winding == "normals":
        turned = against_normals(mesh.positions, normals, faces)
    elif keys.winding == "flipped":
        turned[:] = True
    if turned.any():
        faces = np.where(turned[:, None], faces[:, ::-1], faces)
    needless = np.zeros(len(faces), np.bool_)
    if keys.two_sided:
        needless = needless_twins(mesh.positions, normals, faces)
    if keys.normals == "faces":
        normals = np.zeros_like(normals)
    else:
        opposing = known_opposing_normals(mesh.positions, normals, faces[~needless] if needless.any() else faces)
        normals = np.where(opposing[:, None], -normals, normals) if opposing.any() else normals
    return Orientation(faces, normals, needless, int(turned.sum()))


def agreement(positions: Float64Array, normals: Float32Array, faces: Int32Array) -> Float64Array:
    """How far a face's corner normals point to its own side, shape (m,), float64, in [-3, 3].

    The sum of the three cosines; 0 for faces without area and where normals are unknown.
    """
    corners = positions[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(across, axis=1, keepdims=True)
    across = np.divide(across, length, out=np.zeros_like(across), where=length > 0.0)
    return np.einsum("ij,ikj->i", across, normals[faces].astype(np.float64))


def against_normals(positions: Float64Array, normals: Float32Array, faces: Int32Array) -> BoolArray:
    """Faces whose corner normals point, by and large, to their back, shape (m,)."""
    return agreement(positions, normals, faces) < 0.0


def needless_twins(positions: Float64Array, normals: Float32Array, faces: Int32Array) -> BoolArray:
    """All but one of the faces on the same three vertices that look opposite ways, shape (m,).

    The one that its corner normals agree with most is kept, the first if they don't tell. Faces that coincide but have
    vertices of their own are not concerned: each has its own value. Nor are copies that look the same way.
    """
    needless = np.zeros(len(faces), np.bool_)
    corners = np.sort(faces, axis=1)
    order = np.lexsort(corners.T)
    same: BoolArray = (corners[order[1:]] == corners[order[:-1]]).all(axis=1)
    if not same.any():
        return needless
    run = np.concatenate(([0], np.cumsum(~same)))
    a, b, c = faces[order].T
    odd = ((a > b) ^ (b > c)) ^ (a > c)
    count = np.bincount(run)
    mixed = (np.bincount(run, odd) > 0) & (np.bincount(run, odd) < count)
    rows = np.flatnonzero(mixed[run])
    side = agreement(positions, normals, faces[order[rows]])
    best = np.lexsort((order[rows], -side, run[rows]))  # within each run, the most agreeing first, then the first
    first = np.unique(run[rows][best], return_index=True)[1]
    needless[order[rows]] = True
    needless[order[rows[best[first]]]] = False
    return needless
