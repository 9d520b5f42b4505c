"""Regions as a picture: the fit error of each, and what the regularisation does to every boundary."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bake.region_types import Regions
from bake.results.storage import replacing

_COLOURS = ("#2471a3", "#c0392b", "#1e8449", "#7d3c98")
_LEAST = 1e-5


def plot_regions(path: Path, regions: Regions, *, distances: Sequence[float], title: str) -> None:
    """Draws the errors of all regions, sorted, before and after the regularisation, and all boundaries likewise.

    Args:
        path: A picture, by suffix.
        regions: Of a bake.
        distances: Of the AO columns, metres.
        title: Where they are.

    Raises:
        StorageError: it could not be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13.0, 4.6), layout="constrained")
    FigureCanvasAgg(figure)
    errors, steps, pairs = figure.subplots(1, 3)
    figure.suptitle(f"{title}: {len(regions.graph):,} regions, {len(regions.graph.link):,} boundaries", fontsize=12)
    for column, distance in enumerate(distances):
        colour, label = _COLOURS[column % len(_COLOURS)], f"{distance:g} m"
        fitted, late = regions.fitted.rmse[:, column], regions.regularised.rmse[:, column]
        _draw_sorted(errors, fitted, colour, "-", f"{label}, fitted")
        _draw_sorted(errors, late, colour, ":", f"{label}, regularised")
        before, after = regions.mismatch_before[:, column], regions.mismatch_after[:, column]
        _draw_sorted(steps, before, colour, "-", f"{label}, before")
        _draw_sorted(steps, after, colour, ":", f"{label}, after")
        low, high = np.maximum(before, _LEAST), np.maximum(after, _LEAST)
        pairs.plot(low, high, ".", color=colour, markersize=4, alpha=0.6, label=label)
    errors.set_xlabel("region, by error")
    errors.set_ylabel("RMSE of AO at its points")
    steps.set_xlabel("boundary, by step")
    steps.set_ylabel("step of AO at the middle of the boundary")
    ends = (_LEAST, 1.2)
    pairs.plot(ends, ends, color="#808080", linewidth=0.8)
    pairs.set(xscale="log", yscale="log", xlim=ends, ylim=ends)
    pairs.set_xlabel("step before the regularisation")
    pairs.set_ylabel("step after")
    for axes in (errors, steps, pairs):
        axes.grid(alpha=0.25)
        axes.legend(fontsize=8, frameon=False)
    buffer = io.BytesIO()
    figure.savefig(buffer, format=path.suffix.lstrip(".").lower() or "png", dpi=90)
    with replacing(path) as file:
        file.write(buffer.getvalue())


def _draw_sorted(axes: Any, values: np.ndarray, colour: str, style: str, label: str) -> None:
    known = np.sort(values[np.isfinite(values)])[::-1]
    axes.plot(np.arange(len(known)), known, color=colour, linestyle=style, linewidth=1.2, label=label)
    axes.set_ylim(bottom=0.0)
    axes.margins(x=0.01)
