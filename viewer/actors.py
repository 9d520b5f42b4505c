"""The surface as one VTK actor: geometry uploaded once, colours written in place.

`vtkPolyDataMapper` with uint8 colours, because PyVista's data-set mapper and float scalars cost half as much again on
large meshes. The game's 5-bit storage is drawn in the fragment shader, where the game does it too: after
interpolation, per pixel.
"""

from __future__ import annotations

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

from bake.types import BoolArray, Float32Array, Float64Array, Int32Array, UInt8Array
from viewer.colormaps import GEOMETRY_COLOR, INVALID_COLOR, NOT_BAKED_COLOR, ColorMap
from viewer.tone import BAYER, GAME_BITS

EDGE_COLOR = (0.09, 0.11, 0.14)

_LEVELS = 1 << GAME_BITS
# Vertex colours then carry the value in red, the relief of what is not baked in green and "missing" in blue.
_GAME_SHADER = f"""//VTK::Color::Impl
  if (obscuraGame == 1) {{
    const float bayer[16] = float[16]({", ".join(f"{value}.0" for value in BAYER.ravel())});
    ivec2 pixel = ivec2(gl_FragCoord.xy) & 3;
    float threshold = (bayer[pixel.y * 4 + pixel.x] + 0.5) / 16.0;
    int code = clamp(int(floor(vertexColorVSOutput.r * {_LEVELS - 1}.0 + threshold)), 0, {_LEVELS - 1});
    diffuseColor = vec3(obscuraColors[3 * code], obscuraColors[3 * code + 1], obscuraColors[3 * code + 2]);
    if (vertexColorVSOutput.g > 0.25)
      diffuseColor = vertexColorVSOutput.g * vec3({", ".join(f"{c / 255:.5f}" for c in NOT_BAKED_COLOR)});
    if (vertexColorVSOutput.b > 0.5) diffuseColor = vec3({", ".join(f"{c / 255:.5f}" for c in INVALID_COLOR)});
    ambientColor = obscuraAmbient * diffuseColor;
    diffuseColor = (1.0 - obscuraAmbient) * diffuseColor;
  }}
"""
# Only where it is asked for: a shader that may discard costs early depth tests.
_SPAN_SHADER = f"""{_GAME_SHADER}
  if (gl_FragCoord.x < obscuraLeft || gl_FragCoord.x >= obscuraRight) discard;
"""
_COLOR_CODE = "//VTK::Color::Impl"


def vtk_points(positions: Float32Array) -> vtkPoints:
    """Points that share the array's memory, shape (n, 3), float32 (VTK keeps a reference)."""
    points = vtkPoints()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(positions, np.float32)))
    return points


def vtk_cells(cells: Int32Array) -> vtkCellArray:
    """Cells of equal size from corner indices, shape (m, corners), that share the array's memory if it is int32."""
    offsets = np.arange(0, cells.size + 1, cells.shape[1], dtype=np.int32)
    array = vtkCellArray()
    array.SetData(numpy_to_vtk(offsets), numpy_to_vtk(np.ascontiguousarray(cells, np.int32).ravel()))
    return array


class SurfaceActor:
    """Triangles with a colour a vertex.

    Args:
        positions: Shape (n, 3), metres from the world's origin.
        faces: Shape (m, 3), int32; must stay as they are.
    """

    def __init__(self, positions: Float64Array | Float32Array, faces: Int32Array) -> None:
        self._faces = np.ascontiguousarray(faces, np.int32)
        self._subset = False
        self._data = vtkPolyData()
        self._data.SetPoints(vtk_points(np.array(positions, np.float32)))
        self._data.SetPolys(vtk_cells(self._faces))
        self._begin(len(positions))

    def _begin(self, count: int) -> None:
        self._colors: UInt8Array = np.empty((count, 3), np.uint8)
        self._colors[:] = GEOMETRY_COLOR
        self._scalars = numpy_to_vtk(self._colors)
        self._data.GetPointData().SetScalars(self._scalars)
        mapper = vtkPolyDataMapper()
        mapper.SetInputData(self._data)
        mapper.SetScalarModeToUsePointData()
        mapper.SetColorModeToDirectScalars()
        # Marks on the surface are drawn with the same depth and must win.
        mapper.SetResolveCoincidentTopologyToPolygonOffset()
        mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(1.0, 1.0)
        self.actor = vtkActor()
        self.actor.SetMapper(mapper)
        self.actor.PickableOff()
        shaders = self.actor.GetShaderProperty()
        shaders.AddFragmentShaderReplacement(_COLOR_CODE, True, _GAME_SHADER, False)
        self._spanned = False
        self._uniforms = shaders.GetFragmentCustomUniforms()
        self._uniforms.SetUniform1fv("obscuraColors", 3 * _LEVELS, [0.0] * (3 * _LEVELS))
        self._uniforms.SetUniformi("obscuraGame", 0)
        look = self.actor.GetProperty()
        look.SetInterpolationToFlat()
        look.SetEdgeColor(*EDGE_COLOR)
        look.SetEdgeOpacity(0.4)
        look.SetLineWidth(1.0)
        self.set_shading(1.0)

    @property
    def colors(self) -> UInt8Array:
        """The vertex colours as drawn, shape (n, 3), uint8."""
        return self._colors

    @property
    def face_count(self) -> int:
        """Number of faces, hidden ones included."""
        return len(self._faces)

    def move_vertices(self, first: int, positions: Float64Array | Float32Array) -> None:
        """Puts vertices from the `first` on elsewhere; shape (n, 3). Its twins follow."""
        points = self._data.GetPoints()
        vtk_to_numpy(points.GetData())[first : first + len(positions)] = positions
        points.Modified()
        self._data.Modified()

    def set_colors(self, colors: UInt8Array) -> None:
        """Draws vertex colours as they are; shape (n, 3), uint8."""
        self._colors[:] = colors
        self._scalars.Modified()
        self._data.Modified()
        self._uniforms.SetUniformi("obscuraGame", 0)

    def set_game_values(
        self,
        values: Float32Array,
        not_baked: BoolArray,
        color_map: ColorMap,
        low: float,
        high: float,
        relief: Float32Array | None = None,
    ) -> None:
        """Draws values as the game stores them: quantised with ordered dither per pixel.

        Args:
            values: Shape (n,), in [0, 1]; NaN is missing.
            not_baked: Shape (n,), bool.
            color_map, low, high: How the stored codes are coloured.
            relief: Shape (n,), in [0.5, 1]: brightness of what is not baked.
        """
        missing = np.isnan(values)
        self._colors[:, 0] = np.round(np.clip(np.where(missing, 0.0, values), 0.0, 1.0) * 255.0)
        self._colors[:, 1] = np.where(not_baked, 255.0 if relief is None else 255.0 * relief, 0.0)
        self._colors[:, 2] = np.where(missing & ~not_baked, 255, 0)
        self._scalars.Modified()
        self._data.Modified()
        codes = (np.arange(_LEVELS) / (_LEVELS - 1)).astype(np.float32)
        table = color_map.colors(codes, low, high).astype(np.float64) / 255.0
        self._uniforms.SetUniform1fv("obscuraColors", 3 * _LEVELS, table.ravel().tolist())
        self._uniforms.SetUniformi("obscuraGame", 1)

    def set_uniform_color(self, color: tuple[int, int, int]) -> None:
        """One colour for all vertices."""
        self.set_colors(np.broadcast_to(np.array(color, np.uint8), self._colors.shape))

    def set_shading(self, amount: float) -> None:
        """How much a headlight shapes the surface: 0 leaves colours exact, 1 is fully lit."""
        look = self.actor.GetProperty()
        look.SetLighting(amount > 0.0)
        look.SetAmbient(1.0 - 0.75 * amount)
        look.SetDiffuse(0.75 * amount)
        self._uniforms.SetUniformf("obscuraAmbient", 1.0 - 0.75 * amount)

    def set_edges(self, shown: bool) -> None:
        """Draws the edges of the triangles."""
        self.actor.GetProperty().SetEdgeVisibility(shown)

    def set_back_faces(self, shown: bool) -> None:
        """Shows or hides faces seen from behind: hidden, one can look into a closed room from outside."""
        self.actor.GetProperty().SetBackfaceCulling(not shown)

    def twin(self) -> SurfaceActor:
        """The same triangles once more, with colours of their own; positions and faces are shared."""
        twin = SurfaceActor.__new__(SurfaceActor)
        twin._faces, twin._data, twin._subset = self._faces, vtkPolyData(), self._subset
        twin._data.SetPoints(self._data.GetPoints())
        twin._data.SetPolys(self._data.GetPolys())
        twin._begin(len(self._colors))
        return twin

    def show_faces_of(self, other: SurfaceActor) -> None:
        """Draws the faces that a twin draws."""
        self._subset = other._subset
        self._data.SetPolys(other._data.GetPolys())
        self._data.Modified()

    def set_span(self, span: tuple[float, float] | None) -> None:
        """Draws only columns of pixels from the first to before the second, counted from the left; None for all."""
        if (span is not None) != self._spanned:
            self._spanned = span is not None
            shaders = self.actor.GetShaderProperty()
            shaders.ClearFragmentShaderReplacement(_COLOR_CODE, True)
            code = _SPAN_SHADER if self._spanned else _GAME_SHADER
            shaders.AddFragmentShaderReplacement(_COLOR_CODE, True, code, False)
        if span is not None:
            self._uniforms.SetUniformf("obscuraLeft", span[0])
            self._uniforms.SetUniformf("obscuraRight", span[1])

    def set_visible_faces(self, visible: BoolArray | None) -> None:
        """Draws a subset of the faces; shape (m,), bool, or None for all of them."""
        if visible is None and not self._subset:
            return
        self._subset = visible is not None
        self._data.SetPolys(vtk_cells(self._faces if visible is None else self._faces[visible]))
        self._data.Modified()
