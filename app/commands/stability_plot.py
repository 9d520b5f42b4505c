"""The stability matrix as a picture: cases down, stages across, each cell as close to its gate as it is dark."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bake.bench.stability import Matrix

_DECADES = 6.0  # from a millionth of the gate to the gate
_DARK = 0.02  # shares of the gate whose cells take white letters
_FAILED, _NOTHING = "#c0392b", "#f2f2f2"


def plot_stability(path: Path, matrix: Matrix) -> None:
    """Draws the worst figure of every case and stage over its gate.

    Raises:
        OSError: it cannot be written.
    """
    from matplotlib import colormaps
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch, Rectangle

    stages, cases = matrix.stages, list(matrix.figures)
    figure = Figure(figsize=(3.4 + 0.72 * len(stages), 1.2 + 0.19 * len(cases)), dpi=100)
    axes = figure.add_subplot()
    colours, scale = colormaps["YlGnBu"].with_extremes(), Normalize(-_DECADES - 1.5, 2.0)
    for y, case in enumerate(cases):
        for x, stage in enumerate(stages):
            cell = matrix.cell(case, stage)
            colour: object = _NOTHING
            text, ink = "", "#222222"
            if cell is not None and not cell.passed:
                colour, ink = _FAILED, "white"
                text = f"{cell.value:.2g}" if math.isfinite(cell.value) else "NaN"
            elif cell is not None:
                share = max(cell.ratio, 10.0**-_DECADES)
                colour = colours(scale(-_DECADES - 1.0 if cell.ratio == 0.0 else math.log10(share)))
                text = "" if cell.ratio < 10.0**-_DECADES else f"{cell.ratio:.1g}"
                ink = "white" if cell.ratio > _DARK else ink
            axes.add_patch(Rectangle((x, y), 1.0, 1.0, facecolor=colour, edgecolor="white", linewidth=0.6))
            axes.text(x + 0.5, y + 0.53, text, ha="center", va="center", fontsize=6, color=ink)
    axes.set_xlim(0, len(stages))
    axes.set_ylim(len(cases), 0)
    axes.set_xticks([x + 0.5 for x in range(len(stages))], stages, fontsize=8)
    axes.set_yticks([y + 0.5 for y in range(len(cases))], cases, fontsize=7)
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    for spine in axes.spines.values():
        spine.set_visible(False)
    axes.legend(
        handles=[
            Patch(color=colours(scale(-_DECADES - 1.0)), label="nothing wrong"),
            Patch(color=colours(scale(-1.0)), label="figure over its gate, as written"),
            Patch(color=_FAILED, label="gate broken (value)"),
            Patch(color=_NOTHING, label="not in this case"),
        ],
        loc="upper center", bbox_to_anchor=(0.4, -0.005), ncol=4, fontsize=7, frameon=False,
    )  # fmt: skip
    figure.tight_layout()
    figure.savefig(path)
