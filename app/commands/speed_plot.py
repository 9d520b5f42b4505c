"""Seconds by stage over triangles as a picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bake.bench.table import Row

_COLOURS = ("#888888", "#6a8f3c", "#7a5195", "#2a9d8f", "#0b5394", "#d9822b", "#b5651d", "#222222")


def plot_speed(path: Path, rows: Sequence[Row]) -> None:
    """Draws the seconds of every stage: triangles to the right, seconds upwards, both logarithmic.

    Args:
        path: A .png file.
        rows: Those of the table "speed by triangles"; without two of them there is nothing to draw, and no file.

    Raises:
        OSError: it cannot be written.
    """
    from matplotlib.figure import Figure

    from bake.bench.scaling import STAGES, STORE, TOTAL

    rows = [row for row in rows if "triangles" in row]
    if len(rows) < 2:
        return
    triangles = [float(row["triangles"]) for row in rows]
    figure = Figure(figsize=(7.2, 4.4), dpi=110)
    axes = figure.add_subplot()
    for stage, colour in zip((*STAGES, STORE, TOTAL), _COLOURS, strict=True):
        seconds = [float(row[stage]) for row in rows]
        width = 2.0 if stage == TOTAL else 1.2
        axes.plot(triangles, seconds, marker="o", markersize=4, linewidth=width, color=colour, label=stage[:-2])
    ends = [triangles[0], triangles[-1]]
    last = float(rows[-1][TOTAL])
    axes.plot(ends, [last * ends[0] / ends[1], last], color="#444444", linewidth=0.8, linestyle="--", label="linear")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("triangles")
    axes.set_ylabel("seconds")
    axes.set_title(
        f"{rows[-1]['tracer']}, {rows[-1]['Mrays'] * 1e6 / rows[-1]['samples']:.0f} rays a sample", fontsize=10
    )
    axes.grid(True, which="major", linewidth=0.3)
    axes.legend(fontsize=8, ncols=2)
    figure.tight_layout()
    figure.savefig(path)
