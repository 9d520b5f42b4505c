"""Small worlds with known answers, built without files."""

from __future__ import annotations

import numpy as np

from bake.types import ObjectKeys, Role, World


def make_world(
    *objects: tuple[np.ndarray, np.ndarray],
    normals: np.ndarray | None = None,
    two_sided: bool | np.ndarray = False,
    openness: float | np.ndarray = 0.0,
    casts: np.ndarray | bool = True,
    samples: np.ndarray | bool = True,
    roles: tuple[Role, ...] | None = None,
    keys: tuple[ObjectKeys, ...] | None = None,
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> World:
    """A world of (positions, faces) objects; scalars spread over all faces."""
    first_vertex = np.cumsum([0, *(len(p) for p, _ in objects)]).astype(np.int64)
    first_face = np.cumsum([0, *(len(f) for _, f in objects)]).astype(np.int64)
    positions = np.concatenate([np.asarray(p, np.float64).reshape(-1, 3) for p, _ in objects])
    faces = np.concatenate(
        [np.asarray(f, np.int32).reshape(-1, 3) + np.int32(v) for (_, f), v in zip(objects, first_vertex, strict=False)]
    ).astype(np.int32)
    count = len(faces)
    return World(
        origin=np.asarray(origin, np.float64),
        positions=positions,
        normals=np.zeros((len(positions), 3), np.float32) if normals is None else normals.astype(np.float32),
        faces=faces,
        face_object=np.repeat(np.arange(len(objects), dtype=np.int32), np.diff(first_face)),
        face_casts=np.broadcast_to(np.asarray(casts, bool), count).copy(),
        face_samples=np.broadcast_to(np.asarray(samples, bool), count).copy(),
        face_two_sided=np.broadcast_to(np.asarray(two_sided, bool), count).copy(),
        face_openness=np.broadcast_to(np.asarray(openness, np.float32), count).copy(),
        first_vertex=first_vertex,
        first_face=first_face,
        object_paths=tuple(f"object_{i}" for i in range(len(objects))),
        object_roles=roles or (Role.STATIC,) * len(objects),
        object_keys=keys or (ObjectKeys(),) * len(objects),
        object_hash=tuple(f"{i:064x}" for i in range(len(objects))),
    )


def quad(size: float = 2.0, y: float = 0.0, *, up: bool = True, centre: tuple[float, float] = (0.0, 0.0)):
    """A horizontal square of edge `size` facing up (+y) or down."""
    h = size / 2.0
    positions = np.array([[-h, y, -h], [h, y, -h], [h, y, h], [-h, y, h]]) + np.array([centre[0], 0.0, centre[1]])
    faces = np.array([[0, 2, 1], [0, 3, 2]]) if up else np.array([[0, 1, 2], [0, 2, 3]])
    return positions, faces


def box(size: tuple[float, float, float] = (1.0, 1.0, 1.0), *, inward: bool = False, centre=(0.0, 0.0, 0.0)):
    """A closed box of 8 vertices and 12 faces, facing outward or inward."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    faces = np.array(
        [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
         [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    )  # fmt: skip
    return corners * np.asarray(size) + np.asarray(centre), faces[:, ::-1] if inward else faces


def icosphere(subdivisions: int = 2, radius: float = 1.0, *, inward: bool = False, centre=(0.0, 0.0, 0.0)):
    """A closed sphere of 20 × 4^subdivisions faces; its normals are its positions."""
    g = (1 + 5**0.5) / 2
    p = [[-1, g, 0], [1, g, 0], [-1, -g, 0], [1, -g, 0], [0, -1, g], [0, 1, g],
         [0, -1, -g], [0, 1, -g], [g, 0, -1], [g, 0, 1], [-g, 0, -1], [-g, 0, 1]]  # fmt: skip
    f = [[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6],
         [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10],
         [8, 6, 7], [9, 8, 1]]  # fmt: skip
    positions, faces = np.array(p, float), np.array(f)
    for _ in range(subdivisions):
        edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        middle = inverse.reshape(-1, 3) + len(positions)
        positions = np.concatenate([positions, positions[unique].mean(1)])
        a, b, c = faces.T
        ab, bc, ca = middle.T
        faces = np.concatenate([np.stack(t, 1) for t in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))])
    positions = positions / np.linalg.norm(positions, axis=1, keepdims=True) * radius + np.asarray(centre)
    return positions, faces[:, ::-1] if inward else faces


def disc(radius: float, y: float, *, segments: int = 256, up: bool = False):
    """A horizontal disc made of a fan."""
    angle = 2.0 * np.pi * np.arange(segments) / segments
    # A regular polygon of the disc's own area.
    r = radius * np.sqrt((2 * np.pi / segments) / np.sin(2 * np.pi / segments))
    rim = np.stack([r * np.cos(angle), np.full(segments, y), r * np.sin(angle)], axis=1)
    positions = np.concatenate([[[0.0, y, 0.0]], rim])
    i = np.arange(segments)
    faces = np.stack([np.zeros(segments, int), i + 1, (i + 1) % segments + 1], axis=1)
    return positions, faces[:, ::-1] if up else faces
