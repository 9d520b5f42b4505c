"""Error over rays, for every way to choose directions, as a picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bake.bench.samplers import SamplerScene

_COLOURS = {
    "random": "#888888",
    "stratified jitter": "#d9822b",
    "R2, shifted": "#6a8f3c",
    "golden lattice, shifted": "#7a5195",
    "Sobol, shifted": "#c0392b",
    "Sobol, Owen-scrambled": "#0b5394",
}


def plot_samplers(path: Path, scenes: Sequence[SamplerScene]) -> None:
    """Draws a panel a scene: rays to the right, error upwards, both logarithmic; dotted: by radius and angle.

    Raises:
        OSError: it cannot be written.
    """
    from matplotlib.figure import Figure
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter, NullLocator

    from bake.bench.samplers import OURS, RAYS

    figure = Figure(figsize=(0.6 + 4.6 * len(scenes), 5.4), dpi=110)
    panels = figure.subplots(1, len(scenes), squeeze=False)[0]
    for axes, scene in zip(panels, scenes, strict=True):
        for curve in scene.curves:
            polar = curve.disc == "polar"
            axes.plot(
                RAYS, curve.rmse, color=_COLOURS.get(curve.sampler, "#000000"), marker=None if polar else "o",
                markersize=3.5, linewidth=2.0 if curve.named == OURS else 1.1, linestyle=":" if polar else "-",
                label=f"{curve.named} ({curve.slope:.2f})",
            )  # fmt: skip
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.xaxis.set_major_locator(FixedLocator(list(RAYS)))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.grid(True, which="both", linewidth=0.3)
        axes.set_xlabel("rays")
        axes.set_title(f"{scene.name}, obscurance at {scene.distance:g} m", fontsize=9)
        axes.legend(fontsize=7, title="slope in brackets", title_fontsize=7, loc="upper center", ncol=2,
                    bbox_to_anchor=(0.5, -0.13))  # fmt: skip
    panels[0].set_ylabel("RMSE of a sample's AO")
    figure.tight_layout()
    figure.savefig(path)
