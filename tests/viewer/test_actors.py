"""What is drawn, read back from the picture."""

from __future__ import annotations

import numpy as np
import pytest
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow, vtkWindowToImageFilter

from viewer.actors import SurfaceActor
from viewer.colormaps import CIVIDIS, GREY, INVALID_COLOR
from viewer.markers import BoxActor, PointsActor
from viewer.tone import dither_thresholds, quantise

pytestmark = pytest.mark.gui
SIZE = 64


class _Picture:
    """A square view of x and y in [0, 1], without a window on screen."""

    def __init__(self) -> None:
        import vtkmodules.vtkRenderingOpenGL2  # noqa: F401

        self.renderer = vtkRenderer()
        self.window = vtkRenderWindow()
        self.window.SetOffScreenRendering(True)
        self.window.SetMultiSamples(0)
        self.window.SetSize(SIZE, SIZE)
        self.window.AddRenderer(self.renderer)
        camera = self.renderer.GetActiveCamera()
        camera.ParallelProjectionOn()
        camera.SetParallelScale(0.5)
        camera.SetFocalPoint(0.5, 0.5, 0.0)
        camera.SetPosition(0.5, 0.5, 1.0)
        camera.SetClippingRange(0.1, 2.0)

    def pixels(self) -> np.ndarray:
        """Shape (SIZE, SIZE, 3), row 0 at the bottom."""
        self.window.Render()
        grab = vtkWindowToImageFilter()
        grab.SetInput(self.window)
        grab.ReadFrontBufferOff()
        grab.ShouldRerenderOff()
        grab.Update()
        return vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars()).reshape(SIZE, SIZE, 3).astype(int)


@pytest.fixture
def picture():
    """A small off-screen view."""
    shown = _Picture()
    yield shown
    shown.window.Finalize()


def _quad(value: float = 0.5) -> tuple[SurfaceActor, np.ndarray]:
    positions = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    return SurfaceActor(positions, np.array([[0, 1, 2], [0, 2, 3]], np.int32)), np.full(4, value, np.float32)


def test_colors_are_drawn_exactly_without_shading(picture: _Picture) -> None:
    """Unlit, a pixel has the vertex colour to the last bit; shading darkens it."""
    surface, values = _quad(0.4)
    picture.renderer.AddActor(surface.actor)
    surface.set_shading(0.0)
    surface.set_colors(CIVIDIS.colors(values, 0.0, 1.0))
    assert np.all(picture.pixels() == CIVIDIS.table()[102].astype(int))


def test_game_storage_matches_the_reference(picture: _Picture) -> None:
    """The shader's 5 bits with dither are those of the NumPy reference, pixel by pixel."""
    surface, values = _quad(0.37)
    picture.renderer.AddActor(surface.actor)
    surface.set_shading(0.0)
    surface.set_game_values(values, np.zeros(4, bool), GREY, 0.0, 1.0)
    held = np.round(0.37 * 255) / 255  # vertex values travel as bytes
    codes = quantise(np.full((SIZE, SIZE), held), thresholds=dither_thresholds(SIZE, SIZE))
    expected = GREY.table()[np.round(codes / 31 * 255).astype(int)].astype(int)
    assert np.abs(picture.pixels() - expected).max() <= 1
    assert len(np.unique(codes)) == 2


def test_game_storage_shows_missing_values(picture: _Picture) -> None:
    """Missing values stay magenta in the game's view."""
    surface, values = _quad(np.nan)
    picture.renderer.AddActor(surface.actor)
    surface.set_shading(0.0)
    surface.set_game_values(values, np.zeros(4, bool), GREY, 0.0, 1.0)
    assert np.all(picture.pixels() == INVALID_COLOR)


def test_hidden_faces_are_not_drawn(picture: _Picture) -> None:
    """A face outside the subset leaves the background."""
    surface, values = _quad(1.0)
    picture.renderer.AddActor(surface.actor)
    surface.set_shading(0.0)
    surface.set_colors(GREY.colors(values, 0.0, 1.0))
    surface.set_visible_faces(np.array([True, False]))
    shown = (picture.pixels() == 255).all(axis=2).mean()
    assert 0.45 < shown < 0.55
    surface.set_visible_faces(None)
    assert (picture.pixels() == 255).all()


def test_back_faces_can_be_hidden(picture: _Picture) -> None:
    """Seen from behind, a culled face is not there."""
    positions = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    surface = SurfaceActor(positions, np.array([[2, 1, 0], [3, 2, 0]], np.int32))
    picture.renderer.AddActor(surface.actor)
    surface.set_shading(0.0)
    surface.set_back_faces(False)
    assert np.all(picture.pixels() == 0)
    surface.set_back_faces(True)
    assert np.all(picture.pixels() > 0)


def test_points_lie_over_the_surface(picture: _Picture) -> None:
    """A mark on the surface wins against it, in its own colour."""
    surface, values = _quad(0.0)
    points = PointsActor(size=6)
    for actor in (surface.actor, points.actor):
        picture.renderer.AddActor(actor)
    surface.set_shading(0.0)
    surface.set_colors(GREY.colors(values, 0.0, 1.0))
    points.set_points(np.array([[0.5, 0.5, 0.0]], np.float32), np.array([[255, 200, 0]], np.uint8))
    shown = (picture.pixels() == (255, 200, 0)).all(axis=2)
    assert 16 <= shown.sum() <= 64
    points.set_points(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint8))
    assert np.all(picture.pixels() == 0)


def test_box_is_drawn_and_hidden(picture: _Picture) -> None:
    """The selection's box appears in its colour and goes away."""
    box = BoxActor((1.0, 0.0, 0.0))
    picture.renderer.AddActor(box.actor)
    box.set_box(np.array([0.2, 0.2, -0.1]), np.array([0.8, 0.8, 0.1]))
    assert (picture.pixels() == (255, 0, 0)).all(axis=2).any()
    box.hide()
    assert not (picture.pixels() == (255, 0, 0)).all(axis=2).any()
