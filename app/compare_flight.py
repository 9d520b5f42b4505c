"""Flying to a vertex: its object is selected, it becomes the clicked point, and nothing stands before it."""

from __future__ import annotations

import numpy as np

from app.region_flight import free_eye, looking
from app.window_parts import Workbench
from viewer.picking import Pick

_TOO_NEAR = 0.4
_LEAST = 2.0


def fly_to_vertex(bench: Workbench, owner: int, vertex: int) -> None:
    """Selects the object and looks at one of its vertices from where its surface faces.

    Args:
        bench: Of the window.
        owner: The object.
        vertex: The vertex; below 0, the object is only framed.
    """
    world, viewport = bench.document.world, bench.area.main
    if world is None or not 0 <= owner < world.object_count:
        return
    bench.document.select(owner)
    bounds = bench.document.object_bounds(owner)
    if vertex < 0 or bounds is None:
        if bounds is not None:
            viewport.frame(*bounds)
        return
    point = np.asarray(world.positions[vertex], np.float64)
    normal = np.asarray(world.normals[vertex], np.float64)
    length = float(np.linalg.norm(normal))
    outward = normal / length if length > 0.5 else viewport.camera.up
    distance = min(max(0.6 * float(np.linalg.norm(bounds[1] - bounds[0])), _LEAST), 20.0)
    first, last = (int(world.first_face[owner + end]) for end in (0, 1))
    faces = np.asarray(world.faces[first:last])
    touching = np.flatnonzero((faces == vertex).any(axis=1))
    if len(touching):
        face = int(touching[0])
        weights = tuple(float(corner == vertex) for corner in faces[face])
        bench.readouts.click(Pick(first + face, weights, tuple(point.tolist()), distance))  # type: ignore[arg-type]
    side = outward + 0.5 * viewport.camera.up + 0.35 * viewport.camera.right
    wanted = point + side / float(np.linalg.norm(side)) * distance
    eye = free_eye(bench.picker, point + 0.02 * distance * outward, wanted)
    if float(np.linalg.norm(eye - point)) < _TOO_NEAR * distance:
        eye = wanted
    viewport.navigation.fly_to(looking(viewport.camera, eye, point))
