"""Lines, squares and triangles with a colour a vertex, drawn over the surface: boxes, slices, glyphs."""

from __future__ import annotations

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

from bake.types import Float32Array, Int32Array, UInt8Array
from viewer.actors import vtk_cells, vtk_points

_NEAREST = -66000.0
"""A shift of depth that outdoes every depth there is."""


class ShapesActor:
    """Cells of one kind: pairs of points are lines, three or four are faces.

    Args:
        opacity: 1 is solid.
        width: Of lines, in pixels.
        lit: Whether a light shapes them.
        in_front: Drawn before everything that is not.
    """

    def __init__(self, *, opacity: float = 1.0, width: float = 1.5, lit: bool = False, in_front: bool = False) -> None:
        self._data = vtkPolyData()
        mapper = vtkPolyDataMapper()
        mapper.SetInputData(self._data)
        mapper.SetScalarModeToUsePointData()
        mapper.SetColorModeToDirectScalars()
        if in_front:
            mapper.SetResolveCoincidentTopologyToPolygonOffset()
            mapper.SetRelativeCoincidentTopologyLineOffsetParameters(0.0, _NEAREST)
            mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(0.0, _NEAREST)
        self.actor = vtkActor()
        self.actor.SetMapper(mapper)
        self.actor.PickableOff()
        self.actor.VisibilityOff()
        look = self.actor.GetProperty()
        look.SetLighting(lit)
        look.SetOpacity(opacity)
        look.SetLineWidth(width)
        if lit:
            look.SetAmbient(0.55)
            look.SetDiffuse(0.45)

    def set_shapes(self, positions: Float32Array, cells: Int32Array, colors: UInt8Array) -> None:
        """Replaces what is drawn; no cells hide the actor.

        Args:
            positions: Shape (n, 3), metres from the world's origin.
            cells: Shape (m, 2), (m, 3) or (m, 4), indices of positions.
            colors: Shape (n, 3), uint8.
        """
        data = vtkPolyData()
        data.SetPoints(vtk_points(positions))
        if cells.shape[1] == 2:
            data.SetLines(vtk_cells(cells))
        else:
            data.SetPolys(vtk_cells(cells))
        data.GetPointData().SetScalars(numpy_to_vtk(np.ascontiguousarray(colors, np.uint8), deep=1))
        self._data.ShallowCopy(data)
        self._data.Modified()
        self.actor.SetVisibility(len(cells) > 0)

    def hide(self) -> None:
        """Draws nothing."""
        self.actor.VisibilityOff()
