"""Trees under each model of their AO, side by side, as a picture (after figure 2 of Sloan et al. 2013)."""

from __future__ import annotations

import io
import tempfile
from pathlib import Path

import numpy as np

from app.commands.pictures import draw_off_screen
from bake.bench.tree_figures import TreeFigure
from bake.errors import DeviceError
from bake.results.storage import replacing

_NAMES = {
    "global": "global only",
    "local × global": "local × global",
    "refined": "local × global,\nlocal refined",
    "volume": "gold, from the volume",
    "traced": "traced on the tree",
}

_MARGIN = 14  # pixels


def plot_tree(path: Path, figure: TreeFigure) -> None:
    """Draws a tree: a row a distance, a column a model, each with its error.

    Args:
        path: A picture, by suffix.
        figure: The tree.

    Raises:
        DeviceError: nothing on this machine can draw off screen.
        StorageError: the picture could not be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    names = list(figure.values)
    pictures = _pictures(figure)
    height, width = pictures.shape[2:4]
    size = (2.1 * len(names), (2.0 * height / width + 0.35) * len(figure.distances) + 0.6)
    sheet = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(sheet)
    sheet.suptitle(f"{figure.scene}: {figure.tree}", fontsize=10)
    grid = sheet.subplots(len(figure.distances), len(names), squeeze=False)
    for column, distance in enumerate(figure.distances):
        for number, name in enumerate(names):
            axes = grid[column][number]
            axes.imshow(pictures[number, column])
            axes.set_xticks([])
            axes.set_yticks([])
            for side in axes.spines.values():
                side.set_visible(False)
            if column == 0:
                axes.set_title(_NAMES.get(name, name), fontsize=9)
            if number == 0:
                axes.set_ylabel(f"D = {distance:g} m", fontsize=9)
            error = figure.errors.get(name)
            axes.set_xlabel("reference" if error is None else f"RMSE {error[column]:.3f}", fontsize=9)
    buffer = io.BytesIO()
    sheet.savefig(buffer, format=path.suffix.lstrip(".").lower() or "png", dpi=100)
    with replacing(path) as file:
        file.write(buffer.getvalue())


def _pictures(figure: TreeFigure) -> np.ndarray:
    """Per model and distance a picture, shape (models, k, height, width, 3), uint8."""
    from PIL import Image

    with tempfile.TemporaryDirectory(prefix="obscura-") as name:
        folder = Path(name)
        np.savez(
            folder / "tree.npz",
            positions=figure.positions,
            faces=figure.faces,
            up_axis=figure.up_axis,
            values=np.stack(list(figure.values.values())),
        )
        if not draw_off_screen(["-m", "viewer.tree_snapshot", str(folder / "tree.npz"), name]):
            raise DeviceError(
                "nothing here can draw off screen", where="--plots", remedy="install Mesa's EGL or OSMesa"
            )
        pictures = np.array(
            [
                [np.asarray(Image.open(folder / f"{model}_{column}.png")) for column in range(len(figure.distances))]
                for model in range(len(figure.values))
            ]
        )
    return pictures[(..., *_drawn(pictures), slice(None))]


def _drawn(pictures: np.ndarray) -> tuple[slice, slice]:
    """Rows and columns that hold more than background in any picture, with a margin."""
    drawn = (pictures != pictures[0, 0, 0, 0]).any(axis=(0, 1, 4))
    spans: list[slice] = []
    for axis in (1, 0):
        used = np.flatnonzero(drawn.any(axis=axis))
        low, high = (used[0], used[-1]) if len(used) else (0, drawn.shape[1 - axis])
        spans.append(slice(max(int(low) - _MARGIN, 0), int(high) + 1 + _MARGIN))
    return spans[0], spans[1]
