"""Triangles chosen by an outline of the picture: those that are seen in it, and no others."""

from __future__ import annotations

import math

import numpy as np

from viewer.camera import Camera
from viewer.picture import picture_matrix
from viewer.seen_faces import FacesInPicture, inside_polygon

CAMERA = Camera(focal=(0.0, 0.0, 0.0), azimuth=math.pi / 2.0, elevation=0.0, distance=10.0)
MATRIX = np.array(picture_matrix(CAMERA, 1.0)).reshape(4, 4)
ALL = np.array([(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)])


def seen_faces(positions, faces, drawn, matrix, outline, *, front_only):  # type: ignore[no-untyped-def]
    """Triangles of a picture that are seen inside one outline."""
    return FacesInPicture(positions, faces, drawn, matrix, front_only=front_only).inside(outline)


def _sheet(cells: int, z: float, *, half: float = 3.0, back: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """A square across the view axis, of two triangles a cell, facing the eye at +z."""
    xs = np.linspace(-half, half, cells + 1)
    x, y = np.meshgrid(xs, xs, indexing="ij")
    index = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = (index[i : cells + i, j : cells + j].ravel() for i, j in ((0, 0), (1, 0), (1, 1), (0, 1)))
    faces = np.concatenate((np.stack((a, b, c), 1), np.stack((a, c, d), 1))).astype(np.int32)
    return np.stack((x.ravel(), y.ravel(), np.full(x.size, z)), 1), faces[:, ::-1] if back else faces


def _both(*sheets: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray, list[int]]:
    positions, faces, begins, count = [], [], [], 0
    for own, corners in sheets:
        begins.append(sum(map(len, faces)))
        faces.append(corners + count)
        positions.append(own)
        count += len(own)
    return np.concatenate(positions), np.concatenate(faces).astype(np.int32), begins


def test_what_is_behind_is_not_seen() -> None:
    """A fine sheet behind a coarse one is hidden, whichever of the two is made of larger triangles."""
    positions, faces, (_, second) = _both(_sheet(1, 1.0), _sheet(40, -1.0, half=2.0))
    assert seen_faces(positions, faces, None, MATRIX, ALL, front_only=True).tolist() == [0, 1]
    positions, faces, (_, second) = _both(_sheet(40, 1.0), _sheet(1, -1.0, half=2.0))
    found = seen_faces(positions, faces, None, MATRIX, ALL, front_only=True)
    assert len(found) == second
    assert (found < second).all()


def test_hidden_and_turned_triangles_are_passed_through() -> None:
    """What is not drawn hides nothing; seen from behind, a triangle counts only if both sides are drawn."""
    positions, faces, (_, second) = _both(_sheet(4, 1.0), _sheet(4, -1.0))
    drawn = np.arange(len(faces)) >= second
    assert (seen_faces(positions, faces, drawn, MATRIX, ALL, front_only=True) >= second).all()
    positions, faces = _sheet(4, 0.0, back=True)
    assert len(seen_faces(positions, faces, None, MATRIX, ALL, front_only=True)) == 0
    assert len(seen_faces(positions, faces, None, MATRIX, ALL, front_only=False)) == len(faces)


def test_only_what_lies_in_the_outline() -> None:
    """The left half of the picture has the left half of the sheet; behind the eye there is nothing."""
    positions, faces = _sheet(20, 0.0)
    left = np.array([(-0.9, -0.9), (-0.001, -0.9), (-0.001, 0.9), (-0.9, 0.9)])
    found = seen_faces(positions, faces, None, MATRIX, left, front_only=True)
    assert set(found) == set(np.flatnonzero(positions[faces, 0].mean(axis=1) < 0.0))
    positions[:, 2] = 30.0
    assert len(seen_faces(positions, faces, None, MATRIX, ALL, front_only=False)) == 0


def test_inside_of_an_outline_with_a_bay() -> None:
    """A lasso need not be convex."""
    outline = np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (2.0, 1.0), (0.0, 4.0)])
    points = np.array([(1.0, 1.0), (2.0, 2.0), (3.5, 2.0), (-1.0, 1.0), (2.0, 0.5)])
    assert inside_polygon(points, outline).tolist() == [True, False, True, False, True]
