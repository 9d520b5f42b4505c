"""Which triangle lies under the cursor: one ray on the CPU, in microseconds.

VTK's cell picker is brute force without a locator, and building one locator over a million triangles blocks for half
a second with the interpreter lock held. So the faces are split into chunks whose locators are built one at a time,
in the idle moments of whoever owns the picker.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from vtkmodules.vtkCommonCore import vtkIdList, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkGenericCell, vtkPolyData, vtkStaticCellLocator

from bake.types import BoolArray, Float64Array, Int32Array, Int64Array
from viewer.actors import vtk_cells, vtk_points

CHUNK_FACES = 40_000
"""Faces a locator: about 15 ms to build."""


@dataclass(frozen=True, slots=True)
class Pick:
    """A point on the surface.

    Attributes:
        face: Index of the face.
        barycentric: Weights of its three corners, each in [0, 1], summing to 1.
        position: The point, metres from the world's origin.
        distance: From the ray's origin, metres.
    """

    face: int
    barycentric: tuple[float, float, float]
    position: tuple[float, float, float]
    distance: float


class SurfacePicker:
    """Answers single rays against a set of triangles.

    Args:
        positions: Shape (n, 3), float64, metres from the world's origin.
        faces: Shape (m, 3), int32.
        subset: Indices of the faces that can be hit; all of them by default.
    """

    def __init__(self, positions: Float64Array, faces: Int32Array, subset: Int64Array | None = None) -> None:
        self._positions = positions
        self._faces = faces
        chosen: Int32Array = (np.arange(len(faces), dtype=np.int32) if subset is None else subset).astype(
            np.int32, copy=False
        )
        self._chunks = [chosen[start : start + CHUNK_FACES] for start in range(0, len(chosen), CHUNK_FACES)]
        self._locators: list[vtkStaticCellLocator | None] = [None] * len(self._chunks)
        self._missing = list(range(len(self._chunks)))[::-1]
        self._bounds = np.zeros((len(self._chunks), 2, 3))
        self._spans: list[tuple[int, int]] = [(0, len(positions))] * len(self._chunks)  # vertices that a chunk may have
        self._points: vtkPoints | None = None
        self._cell = vtkGenericCell()

    @property
    def is_ready(self) -> bool:
        """Whether every face can be hit."""
        return not self._missing

    def build_next(self) -> bool:
        """Makes the next chunk hittable; returns whether any is left."""
        if self.is_ready:
            return False
        if self._points is None:
            self._points = vtk_points(self._positions.astype(np.float32))
        index = self._missing.pop()
        faces = self._faces[self._chunks[index]]
        corners = self._positions[faces.ravel()]
        self._spans[index] = int(faces.min()), int(faces.max()) + 1
        self._bounds[index] = corners.min(axis=0), corners.max(axis=0)
        data = vtkPolyData()
        data.SetPoints(self._points)
        data.SetPolys(vtk_cells(faces))
        locator = vtkStaticCellLocator()
        locator.SetDataSet(data)
        locator.BuildLocator()
        self._locators[index] = locator
        return not self.is_ready

    def has_faces(self, faces: Int32Array, visible: BoolArray | None) -> bool:
        """Whether it answers for exactly these faces, shape (m, 3), of which some may be invisible, shape (m,)."""
        count = len(faces) if visible is None else int(np.count_nonzero(visible))
        own = sum(map(len, self._chunks))
        if own != count or len(faces) != len(self._faces):
            return False
        same = faces is self._faces or np.array_equal(faces, self._faces)
        return same and (visible is None or all(visible[chunk].all() for chunk in self._chunks))

    def moved(self, positions: Float64Array) -> SurfacePicker:
        """The same faces with their vertices elsewhere, shape (n, 3); only chunks that have moved are to be built."""
        other = SurfacePicker.__new__(SurfacePicker)
        other._positions, other._faces, other._chunks = positions, self._faces, self._chunks
        other._locators, other._bounds, other._points, other._cell = (
            list(self._locators),
            self._bounds,
            None,
            self._cell,
        )
        moved = np.flatnonzero((positions != self._positions).ravel()) // 3
        touched = {
            index for index, (first, end) in enumerate(self._spans) if np.diff(np.searchsorted(moved, (first, end)))[0]
        }
        other._spans = list(self._spans)
        for index in touched:
            other._locators[index] = None
        other._missing = sorted(touched | set(self._missing), reverse=True)
        other._bounds = self._bounds.copy()
        return other

    def build(self) -> None:
        """Makes every face hittable now."""
        while self.build_next():
            pass

    def pick(self, origin: Float64Array, direction: Float64Array, *, cull_back_faces: bool = False) -> Pick | None:
        """The nearest face along a ray.

        Args:
            origin: Shape (3,), metres from the world's origin.
            direction: Shape (3,), unit length.
            cull_back_faces: Passes through faces seen from behind, as a view does that hides them.

        Returns:
            None if nothing is hit, or what would be hit is not built yet.
        """
        if not self._chunks:
            return None
        near, far = _slab_test(self._bounds, origin, direction)
        best: Pick | None = None
        for index in np.argsort(near):
            if self._locators[index] is None or not far[index] >= max(near[index], 0.0):
                continue
            if best is not None and near[index] > best.distance:
                break
            found = self._nearest_in_chunk(int(index), origin, direction, float(far[index]), cull_back_faces)
            if found is not None and (best is None or found.distance < best.distance):
                best = found
        return best

    def _nearest_in_chunk(
        self, index: int, origin: Float64Array, direction: Float64Array, reach: float, cull: bool
    ) -> Pick | None:
        end = origin + direction * (reach * 1.001 + 1e-3)
        cells = vtkIdList()
        locator = self._locators[index]
        assert locator is not None
        locator.IntersectWithLine(_triple(origin), _triple(end), 0.0, vtkPoints(), cells, self._cell)
        best: Pick | None = None
        for position in range(cells.GetNumberOfIds()):
            face = int(self._chunks[index][cells.GetId(position)])
            found = self._intersect(face, origin, direction, cull)
            if found is not None and (best is None or found.distance < best.distance):
                best = found
        return best

    def _intersect(self, face: int, origin: Float64Array, direction: Float64Array, cull: bool) -> Pick | None:
        """Exact point on one face in float64 (Möller and Trumbore 1997); the locator has decided that it is hit."""
        a, b, c = self._positions[self._faces[face]]
        edge_1, edge_2 = b - a, c - a
        normal = np.cross(edge_1, edge_2)
        facing = float(normal @ direction)
        if facing == 0.0 or (cull and facing > 0.0):
            return None
        distance = float(normal @ (a - origin)) / facing
        if distance < 0.0:
            return None
        offset = origin + distance * direction - a
        area = float(normal @ normal)
        second = float(np.cross(offset, edge_2) @ normal) / area
        third = float(np.cross(edge_1, offset) @ normal) / area
        weights = np.clip((1.0 - second - third, second, third), 0.0, 1.0)
        weights /= weights.sum()
        point = weights @ np.stack((a, b, c))
        return Pick(face, _triple(weights), _triple(point), distance)


def _slab_test(boxes: Float64Array, origin: Float64Array, direction: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Where a ray enters and leaves boxes, shape (b, 2, 3): two arrays of shape (b,); far < near is a miss."""
    safe = np.where(np.abs(direction) < 1e-12, 1e-12, direction)
    first = (boxes[:, 0] - origin) / safe
    second = (boxes[:, 1] - origin) / safe
    return np.minimum(first, second).max(axis=1) - 1e-6, np.maximum(first, second).min(axis=1) + 1e-6


def _triple(vector: Float64Array) -> tuple[float, float, float]:
    return float(vector[0]), float(vector[1]), float(vector[2])
