"""Picks against a plain intersection of all triangles."""

from __future__ import annotations

import numpy as np
import pytest

from bake.types import BakeResult
from viewer import picking
from viewer.picking import SurfacePicker


def _nearest_by_brute_force(positions, faces, origin, direction, *, cull=False):
    """Distance and face of the nearest hit by plain Möller–Trumbore over all faces."""
    a, b, c = (positions[faces[:, corner]] for corner in range(3))
    e1, e2 = b - a, c - a
    p = np.cross(direction, e2)
    det = np.einsum("ij,ij->i", e1, p)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = origin - a
        u = np.einsum("ij,ij->i", s, p) / det
        q = np.cross(s, e1)
        v = q @ direction / det
        t = np.einsum("ij,ij->i", e2, q) / det
    hit = (np.abs(det) > 1e-12) & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
    if cull:
        hit &= det > 0
    return (np.inf, -1) if not hit.any() else (t[hit].min(), int(np.flatnonzero(hit)[np.argmin(t[hit])]))


@pytest.mark.parametrize("cull", [False, True])
@pytest.mark.parametrize("chunk", [37, 40_000])
def test_pick_is_the_nearest_triangle(
    baked: BakeResult, monkeypatch: pytest.MonkeyPatch, chunk: int, cull: bool
) -> None:
    """The picked point is the nearest hit among all triangles, with and without chunks and culling."""
    monkeypatch.setattr(picking, "CHUNK_FACES", chunk)
    positions, faces = np.asarray(baked.world.positions), np.asarray(baked.world.faces)
    picker = SurfacePicker(positions, faces)
    picker.build()
    random = np.random.default_rng(7)
    hits = 0
    for _ in range(300):
        origin, direction = random.uniform(-6, 6, 3), random.normal(size=3)
        direction /= np.linalg.norm(direction)
        distance, face = _nearest_by_brute_force(positions, faces, origin, direction, cull=cull)
        found = picker.pick(origin, direction, cull_back_faces=cull)
        if found is None:
            # Through a shared edge either answer may come from rounding; a real hit is never missed by more.
            assert face == -1 or _touches_an_edge(positions, faces, face, origin + distance * direction)
            continue
        hits += 1
        point = np.array(found.position)
        assert abs(found.distance - distance) < 1e-4 or _touches_an_edge(positions, faces, found.face, point)
        np.testing.assert_allclose(np.array(found.barycentric) @ positions[faces[found.face]], point, atol=1e-9)
        np.testing.assert_allclose(origin + found.distance * direction, point, atol=1e-4)
    assert hits > 30


def _touches_an_edge(positions, faces, face, point) -> bool:
    corners = positions[faces[face]]
    ends = np.roll(corners, -1, axis=0)
    along = np.clip(((point - corners) * (ends - corners)).sum(1) / ((ends - corners) ** 2).sum(1), 0, 1)
    return bool(np.linalg.norm(corners + along[:, None] * (ends - corners) - point, axis=1).min() < 1e-3)


def test_subset_hides_the_rest(baked: BakeResult) -> None:
    """Faces outside the subset let the ray pass."""
    world = baked.world
    positions, faces = np.asarray(world.positions), np.asarray(world.faces)
    ground = world.object_paths.index("Ground")
    subset = np.flatnonzero(np.asarray(world.face_object) == ground)
    picker = SurfacePicker(positions, faces, subset)
    picker.build()
    origin = np.array([4.0, 9.0, 1.0]) - np.asarray(world.origin)
    found = picker.pick(origin, np.array([0.0, -1.0, 0.0]))
    assert found is not None
    assert world.face_object[found.face] == ground


def test_picker_is_built_step_by_step(monkeypatch: pytest.MonkeyPatch, baked: BakeResult) -> None:
    """Nothing is hit before the first step; the last one says that none is left."""
    monkeypatch.setattr(picking, "CHUNK_FACES", 100)
    world = baked.world
    picker = SurfacePicker(np.asarray(world.positions), np.asarray(world.faces))
    down = np.array([0.0, -1.0, 0.0])
    assert picker.pick(np.array([0.0, 50.0, 0.0]), down) is None
    steps = 1
    while picker.build_next():
        steps += 1
    assert steps == -(-world.face_count // 100)
    assert picker.is_ready


def test_moved_triangles_are_hit_where_they_are() -> None:
    """After some vertices moved, what stayed can be hit at once, and the rest after its chunks are built again."""
    grid = np.stack(np.meshgrid(np.arange(300.0), np.arange(300.0), indexing="ij"), axis=-1).reshape(-1, 2)
    positions = np.column_stack((grid, np.zeros(len(grid))))
    corner = np.arange(300 * 300).reshape(300, 300)[:-1, :-1].ravel()
    faces = np.concatenate(
        (np.stack((corner, corner + 300, corner + 1), 1), np.stack((corner + 301, corner + 1, corner + 300), 1))
    ).astype(np.int32)
    picker = SurfacePicker(positions, faces)
    picker.build()
    lifted = positions.copy()
    lifted[:900, 2] = 5.0
    moved = picker.moved(lifted)
    assert not moved.is_ready
    down = np.array((0.0, 0.0, -1.0))
    still = moved.pick(np.array((200.3, 200.3, 9.0)), down)
    assert still is not None
    assert still.position[2] == 0.0
    moved.build()
    found = moved.pick(np.array((1.3, 10.3, 9.0)), down)
    assert found is not None
    assert found.position[2] == 5.0
    assert moved.has_faces(faces.copy(), None)
    assert not moved.has_faces(faces, np.arange(len(faces)) > 3)
