"""Pictures of trees under the models of their AO."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from app.commands import pictures
from app.commands.tree_plot import plot_tree
from bake.bench.tree_figures import TreeFigure
from bake.errors import DeviceError
from tests.worlds import icosphere


def figure() -> TreeFigure:
    """A ball, black under one model and white under the other."""
    positions, faces = icosphere(1)
    shape = (len(positions), 2)
    values = {"global": np.zeros(shape, np.float32), "traced": np.ones(shape, np.float32)}
    return TreeFigure("level", "Trees/ball", 1, (2.0, 300.0), positions, faces, values, {"global": np.array([1.0, 1])})


def test_every_model_and_distance_is_drawn(tmp_path: Path) -> None:
    """The sheet has black and white balls on its background, and little else than balls."""
    image = pytest.importorskip("PIL.Image")
    if not pictures.draw_off_screen(["-c", "import pyvista as p; p.Plotter(off_screen=True).screenshot()"]):
        pytest.skip("nothing here can draw off screen")
    plot_tree(tmp_path / "tree.png", figure())
    sheet = np.asarray(image.open(tmp_path / "tree.png").convert("L"))
    left, right = np.array_split(sheet, 2, axis=1)
    assert (left < 5).mean() > 0.2
    assert (right > 250).mean() > (left > 250).mean() + 0.2


def test_without_a_way_to_draw_it_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One line, and no file."""
    monkeypatch.setattr(pictures, "_WAYS", ())
    with pytest.raises(DeviceError, match="off screen"):
        plot_tree(tmp_path / "tree.png", figure())
    assert not list(tmp_path.iterdir())
