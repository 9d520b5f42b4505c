"""A walk as a picture: all variants over time, pops marked, and a closer look at the worst."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bake.results.storage import replacing
from bake.types import Float32Array
from bake.walk import CHOSEN, STEP_BOUND, Variant, Walk
from bake.walk.steps import steps

COLOURS = {
    Variant.TRUTH: "#202020",
    Variant.RAW: "#c0392b",
    Variant.REGULARISED: "#e08e0b",
    Variant.BLENDED: "#2471a3",
    Variant.SPATIAL: "#1e8449",
    Variant.SPATIAL_BLENDED: "#7d3c98",
}
_CLOSE_S = 2.0
_CLOSE_UPS = 3
_LEAST_STEP = 1e-6


def plot_walk(path: Path, walk: Walk, *, names: Sequence[str], distance: float, title: str) -> None:
    """Draws a walk.

    From above: AO about the chosen normal; how far any of seven normals steps from frame to frame; and the moments
    around the worst pops, about the normals that show them.

    Args:
        path: A picture, by suffix.
        walk: The walk.
        names: Of the regions.
        distance: That of the AO, metres.
        title: Where the walk was.

    Raises:
        StorageError: it could not be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13.0, 9.5), layout="constrained")
    FigureCanvasAgg(figure)
    close = _close_ups(walk)
    grid = figure.add_gridspec(3, max(len(close), 1), height_ratios=[1.2, 1.0, 1.2])
    x, y, z = walk.options.normals[CHOSEN]
    options = walk.options
    figure.suptitle(
        f"{title}: {walk.distance[-1]:,.0f} m at {options.speed:g} m/s and "
        f"{options.frame_rate:g} Hz, half-life {options.half_life:g} s, AO at {distance:g} m",
        fontsize=12,
    )
    top = figure.add_subplot(grid[0, :])
    _draw_ao(top, walk, CHOSEN, slice(0, len(walk)))
    _mark_pops(top, walk)
    top.set_ylabel(f"AO about ({x:.2g}, {y:.2g}, {z:.2g})")
    top.set_ylim(-0.02, 1.06)
    top.legend(ncols=len(walk.ao) + 1, fontsize=8, loc="upper center", bbox_to_anchor=(0.5, 1.14), frameon=False)
    _draw_steps(figure.add_subplot(grid[1, :], sharex=top), walk)
    for number, frame in enumerate(close):
        _draw_close_up(figure.add_subplot(grid[2, number]), walk, frame, names)
    buffer = io.BytesIO()
    figure.savefig(buffer, format=path.suffix.lstrip(".").lower() or "png", dpi=110)
    with replacing(path) as file:
        file.write(buffer.getvalue())


def _draw_ao(axes: Any, walk: Walk, normal: int, frames: slice) -> None:
    for variant, colour in COLOURS.items():
        if variant in walk.ao:
            wide = variant is Variant.TRUTH
            axes.plot(
                walk.time[frames],
                _broken(walk, walk.ao[variant][:, normal])[frames],
                color=colour,
                label=str(variant),
                linewidth=1.8 if wide else 1.0,
                alpha=0.55 if wide else 0.95,
                zorder=1 if wide else 2,
            )
    axes.margins(x=0.0)
    axes.grid(alpha=0.25)


def _mark_pops(axes: Any, walk: Walk) -> None:
    """A triangle above the curves for each pop, in its variant's colour."""
    for row, variant in enumerate(COLOURS):
        times = [pop.time for pop in walk.pops if pop.variant is variant]
        if times:
            heights = np.full(len(times), 1.005 + 0.01 * row)
            axes.plot(times, heights, "v", color=COLOURS[variant], markersize=4, zorder=3, clip_on=False)


def _draw_steps(axes: Any, walk: Walk) -> None:
    for variant, colour in COLOURS.items():
        if variant in walk.ao:
            largest = np.abs(np.nan_to_num(steps(walk.ao[variant], walk.teleported))).max(axis=1)
            largest[largest < _LEAST_STEP] = np.nan
            real = variant is Variant.TRUTH
            axes.plot(
                walk.time, largest, color=colour, linewidth=0.8, alpha=0.3 if real else 0.8, zorder=1 + (not real)
            )
    axes.axhline(STEP_BOUND, color="#202020", linewidth=0.9, linestyle="--")
    axes.annotate("one 8-bit code at white", (1.0, STEP_BOUND), (-4, 3), axes.get_yaxis_transform(), "offset points",
                  ha="right", fontsize=8, bbox={"fc": "white", "ec": "none", "alpha": 0.8, "pad": 1.0})  # fmt: skip
    axes.margins(x=0.0)
    axes.set_yscale("log")
    axes.set_ylim(1e-5, 1.0)
    axes.set_ylabel("AO step a frame\n(largest of 7 normals)")
    axes.set_xlabel("time, s")
    axes.grid(alpha=0.25)


def _draw_close_up(axes: Any, walk: Walk, frame: int, names: Sequence[str]) -> None:
    from app.commands.walk_summary import normal_name

    pop = next(pop for pop in walk.pops if pop.frame == frame)
    reach = round(_CLOSE_S * walk.options.frame_rate)
    part = slice(max(0, frame - reach), min(len(walk), frame + reach + 1))
    _draw_ao(axes, walk, pop.normal, part)
    changes = np.flatnonzero(np.diff(walk.region[part])) + part.start + 1
    for change in changes:
        axes.axvline(walk.time[change], color="#808080", linewidth=0.7, linestyle=":")
    axes.locator_params(axis="x", nbins=6)
    axes.set_title(f"{names[pop.before]} → {names[pop.after]}, normal {normal_name(pop.normal)}", fontsize=9)
    axes.set_xlabel("time, s")
    axes.set_ylabel("AO")


def _close_ups(walk: Walk) -> list[int]:
    """Frames of the worst pops, at least some seconds apart, in the order of time."""
    chosen: list[int] = []
    apart = 2.0 * _CLOSE_S * walk.options.frame_rate
    for pop in walk.pops:
        if all(abs(pop.frame - other) > apart for other in chosen):
            chosen.append(pop.frame)
        if len(chosen) == _CLOSE_UPS:
            break
    return sorted(chosen)


def _broken(walk: Walk, values: Float32Array) -> Float32Array:
    """The same, without a line across teleports."""
    values = values.copy()
    values[walk.teleported & (np.arange(len(walk)) > 0)] = np.nan
    return values
