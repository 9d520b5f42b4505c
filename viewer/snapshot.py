"""Pictures of a result without a window, drawn off screen.

`python -m viewer.snapshot RESULT FOLDER` writes them as JPEG files with an `index.json`. It is a program of its own
because a broken graphics driver may take its process down: whoever wants pictures runs this one, and goes on without
them if it fails. VTK_DEFAULT_OPENGL_WINDOW chooses between EGL and OSMesa.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bake.types import BakeResult, Role, UInt8Array
from viewer.actors import SurfaceActor
from viewer.camera import Camera
from viewer.fields import distance_field, distance_label
from viewer.viewpoints import viewpoints

SIZE = (1120, 700)
INDEX_FILE = "index.json"
_MOST_COLUMNS = 3
_SHADING = 0.3  # a little headlight, so that open surfaces keep their shape
_NOT_DRAWN = (Role.IGNORE, Role.LOD)  # a lower LOD lies inside the finest one


def pictured_columns(result: BakeResult) -> list[int]:
    """The AO columns worth a picture: all, or the shortest, a middle and the longest distance, in that order."""
    order = np.argsort(result.settings.column_distances).tolist()
    return order if len(order) <= _MOST_COLUMNS else [order[0], order[len(order) // 2], order[-1]]


def render(result: BakeResult, colors: Sequence[UInt8Array], cameras: Sequence[Camera]) -> list[list[UInt8Array]]:
    """Draws every camera with every colouring.

    Faces seen from behind are left out, unless they are two-sided: so one looks into a closed room from above.

    Args:
        result: What is drawn.
        colors: Vertex colours, each of shape (n, 3), uint8.
        cameras: From where, in metres from the world's origin.

    Returns:
        Per colouring and camera a picture, shape (height, width, 3), uint8.
    """
    import pyvista

    world = result.world
    hidden = np.array([role in _NOT_DRAWN for role in world.object_roles], np.bool_)[world.face_object]
    plotter: Any = pyvista.Plotter(off_screen=True, window_size=list(SIZE), lighting="none")
    try:
        plotter.add_light(pyvista.Light(light_type="headlight"))
        plotter.set_background("#c9d3de", top="#eef2f6")
        actors = []
        for two_sided in (False, True):
            faces = world.faces[~hidden & (world.face_two_sided == two_sided)]
            if len(faces):
                actor = SurfaceActor(world.positions, faces)
                actor.set_shading(_SHADING)
                actor.set_back_faces(two_sided)
                plotter.add_actor(actor.actor, reset_camera=False, render=False)
                actors.append(actor)
        pictures: list[list[UInt8Array]] = []
        for coloring in colors:
            for actor in actors:
                actor.set_colors(coloring)
            pictures.append([_shoot(plotter, camera) for camera in cameras])
    finally:
        plotter.close()
    return pictures


def _shoot(plotter: Any, camera: Camera) -> UInt8Array:
    view = plotter.camera
    view.position, view.focal_point, view.up = camera.eye.tolist(), camera.focal, camera.picture_up.tolist()
    view.view_angle = float(np.degrees(camera.view_angle))
    # The default would cut off what is near the eye wherever a backdrop is far away.
    plotter.renderer.SetNearClippingPlaneTolerance(1e-4)
    plotter.renderer.ResetCameraClippingRange()
    plotter.render()
    return np.asarray(plotter.screenshot(return_img=True))[..., :3]


def write_pictures(result: BakeResult, folder: Path) -> None:
    """Writes the pictures of a result and their index into an existing folder."""
    from PIL import Image

    views = viewpoints(result, SIZE[0] / SIZE[1])
    columns = pictured_columns(result)
    distances = result.settings.column_distances
    fields = [distance_field(result.field, distances, column) for column in columns]
    colors = [field.colors(field.color_map, field.low, field.high) for field in fields]
    pictures = render(result, colors, [view.camera for view in views])
    index: list[dict[str, str]] = []
    for number, view in enumerate(views):
        for column, row in zip(columns, pictures, strict=True):
            file = f"view{number}_{column}.jpg"
            Image.fromarray(row[number]).save(folder / file, quality=90)
            index.append({"view": view.name, "distance": distance_label(distances[column]), "file": file})
    (folder / INDEX_FILE).write_text(json.dumps(index), encoding="utf-8")


def main(arguments: Sequence[str]) -> int:
    """Runs the program: a result folder and a folder for the pictures."""
    from bake.results import load_result

    write_pictures(load_result(Path(arguments[0]), verify=False), Path(arguments[1]))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
