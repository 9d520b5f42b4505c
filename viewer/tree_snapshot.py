"""Pictures of one tree under each model of its AO, drawn off screen.

`python -m viewer.tree_snapshot TREE.npz FOLDER` writes `MODEL_COLUMN.png` files. A program of its own for the reason
given in `viewer/snapshot.py`. The archive holds `positions`, `faces`, `up_axis` and `values`, shape (models, n, k).
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bake.types import Float32Array, Float64Array, Int32Array, UInt8Array
from viewer.actors import SurfaceActor
from viewer.camera import Camera
from viewer.colormaps import GREY

SIZE = (420, 480)
_BACKGROUND = "#8fa0b3"  # neither end of the grey map
_ELEVATION, _AZIMUTH = math.radians(12.0), math.radians(35.0)


def render_tree(positions: Float64Array, faces: Int32Array, values: Float32Array, up_axis: int) -> list[UInt8Array]:
    """Draws a tree from the side, once for each column of values.

    Args:
        positions: Shape (n, 3).
        faces: Shape (m, 3).
        values: Shape (n, c), AO: black at 0, white at 1.
        up_axis: 1 for +Y up, 2 for +Z up.

    Returns:
        Pictures, shape (height, width, 3), uint8.
    """
    import pyvista

    plotter: Any = pyvista.Plotter(off_screen=True, window_size=list(SIZE), lighting="none")
    try:
        plotter.set_background(_BACKGROUND)
        actor = SurfaceActor(positions, faces)
        actor.set_shading(0.0)
        actor.set_back_faces(True)
        plotter.add_actor(actor.actor, reset_camera=False, render=False)
        camera = Camera(up_axis=up_axis, azimuth=_AZIMUTH, elevation=_ELEVATION)
        camera = camera.framed(positions.min(axis=0), positions.max(axis=0), SIZE[0] / SIZE[1])
        view = plotter.camera
        view.position, view.focal_point, view.up = camera.eye.tolist(), camera.focal, camera.picture_up.tolist()
        view.view_angle = math.degrees(camera.view_angle)
        plotter.renderer.ResetCameraClippingRange()
        pictures: list[UInt8Array] = []
        for column in range(values.shape[1]):
            actor.set_colors(GREY.colors(values[:, column], 0.0, 1.0))
            plotter.render()
            pictures.append(np.asarray(plotter.screenshot(return_img=True))[..., :3])
    finally:
        plotter.close()
    return pictures


def main(arguments: Sequence[str]) -> int:
    """Runs the program: an archive and a folder for the pictures."""
    from PIL import Image

    with np.load(arguments[0], allow_pickle=False) as archive:
        positions, faces, up_axis = archive["positions"], archive["faces"], int(archive["up_axis"])
        values = archive["values"]
    models, count, columns = values.shape
    flat = values.transpose(1, 0, 2).reshape(count, models * columns)
    for number, picture in enumerate(render_tree(positions, faces, flat, up_axis)):
        model, column = divmod(number, columns)
        Image.fromarray(picture).save(Path(arguments[1]) / f"{model}_{column}.png")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
