"""Run time against error as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bake.bench.front import Front

_COLOURS = ("#0b5394", "#d9822b", "#6a8f3c", "#7a5195", "#888888")


def plot_front(path: Path, front: Front) -> None:
    """Draws every bake of a scene: seconds to the right, error upwards, both logarithmic.

    Raises:
        OSError: it cannot be written.
    """
    from matplotlib.figure import Figure
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    figure = Figure(figsize=(7.2, 4.9), dpi=110)
    axes = figure.add_subplot()
    bakers = list(dict.fromkeys(row.baker for row in front.rows if row.bounded))
    for baker, colour in zip(bakers, _COLOURS, strict=False):
        rows = sorted((row for row in front.rows if row.baker == baker), key=lambda row: row.seconds)
        axes.scatter([row.seconds for row in rows], [row.rmse for row in rows], s=22, color=colour, label=baker)
        best, seconds, errors = float("inf"), [], []
        for row in rows:
            if row.rmse < best:
                best = row.rmse
                seconds.append(row.seconds)
                errors.append(row.rmse)
        axes.plot(seconds, errors, color=colour, linewidth=1.2, drawstyle="steps-post")
    for row in front.rows:
        if row.effort.startswith("preset "):
            axes.annotate(row.effort.removeprefix("preset "), (row.seconds, row.rmse), xytext=(5, 4),
                          textcoords="offset points", fontsize=8, color=_COLOURS[0])  # fmt: skip
    axes.axhline(front.floor + 1.0 / 255.0, color="#444444", linewidth=0.6, linestyle=":")
    axes.axhline(front.floor, color="#444444", linewidth=0.8, linestyle="--")
    axes.annotate(
        "best piecewise linear AO; dotted: 1/255 above",
        (1, front.floor), xycoords=("axes fraction", "data"), ha="right", va="top", fontsize=8, color="#444444",
    )  # fmt: skip
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("seconds from the mesh's file to the stored result")
    axes.set_ylabel("RMSE of the interpolated AO")
    axes.set_title(f"{front.scene}, greatest distance {front.distance:g} m", fontsize=10)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())
    axes.grid(True, which="both", linewidth=0.3)
    axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.14), ncol=2)
    figure.tight_layout()
    figure.savefig(path)
