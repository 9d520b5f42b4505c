"""Marks drawn over the surface: points and boxes."""

from __future__ import annotations

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

from bake.types import Float32Array, Float64Array, UInt8Array
from viewer.actors import vtk_cells, vtk_points

_NEAREST = -66000.0  # a shift of depth that outdoes every depth there is


class PointsActor:
    """Coloured squares of a size in pixels, drawn in front of the surface that they lie on, or of everything."""

    def __init__(self, size: float = 5.0, *, in_front: bool = False) -> None:
        self._data = vtkPolyData()
        mapper = vtkPolyDataMapper()
        mapper.SetInputData(self._data)
        mapper.SetScalarModeToUsePointData()
        mapper.SetColorModeToDirectScalars()
        mapper.SetResolveCoincidentTopologyToPolygonOffset()
        mapper.SetRelativeCoincidentTopologyPointOffsetParameter(_NEAREST if in_front else -4.0)
        self.actor = vtkActor()
        self.actor.SetMapper(mapper)
        self.actor.PickableOff()
        self.actor.VisibilityOff()
        self.actor.GetProperty().SetLighting(False)
        self.set_size(size)

    def set_size(self, pixels: float) -> None:
        """Edge length of a mark in pixels."""
        self.actor.GetProperty().SetPointSize(pixels)

    def set_points(self, positions: Float32Array, colors: UInt8Array) -> None:
        """Replaces the marks; none hides the actor.

        Args:
            positions: Shape (n, 3), metres from the world's origin.
            colors: Shape (n, 3), uint8.
        """
        data = vtkPolyData()
        data.SetPoints(vtk_points(positions))
        data.SetVerts(vtk_cells(np.arange(len(positions), dtype=np.int32)[:, None]))
        data.GetPointData().SetScalars(numpy_to_vtk(np.ascontiguousarray(colors, np.uint8), deep=1))
        self._data.ShallowCopy(data)
        self._data.Modified()
        self.actor.SetVisibility(len(positions) > 0)


class BoxActor:
    """The edges of an axis-aligned box, e.g. around the selected object."""

    EDGES = np.array(
        [(0, 1), (2, 3), (4, 5), (6, 7), (0, 2), (1, 3), (4, 6), (5, 7), (0, 4), (1, 5), (2, 6), (3, 7)], np.int32
    )

    def __init__(self, color: tuple[float, float, float]) -> None:
        self._data = vtkPolyData()
        mapper = vtkPolyDataMapper()
        mapper.SetInputData(self._data)
        self.actor = vtkActor()
        self.actor.SetMapper(mapper)
        self.actor.PickableOff()
        self.actor.VisibilityOff()
        look = self.actor.GetProperty()
        look.SetLighting(False)
        look.SetColor(*color)
        look.SetLineWidth(2.0)

    def set_box(self, low: Float64Array, high: Float64Array) -> None:
        """Shows the box between two corners, each of shape (3,)."""
        self.set_boxes(np.stack((low, high))[None])

    def set_boxes(self, boxes: Float64Array) -> None:
        """Shows boxes by their lowest and highest corners, shape (k, 2, 3), k at least 1."""
        bits = np.arange(8)[:, None] >> np.arange(3) & 1
        corners = boxes[:, bits, np.arange(3)].reshape(-1, 3).astype(np.float32)
        first = 8 * np.arange(len(boxes), dtype=np.int32)
        data = vtkPolyData()
        data.SetPoints(vtk_points(corners))
        data.SetLines(vtk_cells((first[:, None, None] + self.EDGES).reshape(-1, 2)))
        self._data.ShallowCopy(data)
        self._data.Modified()
        self.actor.VisibilityOn()

    def hide(self) -> None:
        """Shows no box."""
        self.actor.VisibilityOff()
