"""A picture of how far rebakes are from whole bakes: one curve a kind of values, one panel a scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

_FLOOR = 1e-8
_NAMES = {
    "vertices": "vertices",
    "voxels": "tree volume",
    "trees": "tree fits",
    "shrub_scalars": "shrubs",
    "small_scalars": "small decorators",
    "points": "region points",
    "regions": "region models",
}


def plot_rebakes(path: Path, rows: Sequence[Mapping[str, Any]], *, largest: float, rms: float) -> None:
    """Draws, for each scene, the share of edits whose largest difference (full) and RMS (dashed) stay below a value.

    Args:
        path: A .png file.
        rows: One an edit, as `bake.bench.rebake.edit_rows` makes them.
        largest, rms: The gates.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    figure = Figure(figsize=(4.6 * len(scenes), 3.6))
    FigureCanvasAgg(figure)
    panels = figure.subplots(1, len(scenes), sharey=True, squeeze=False)
    for axes, scene in zip(panels[0], scenes, strict=True):
        own = [row for row in rows if row["scene"] == scene]
        for number, (name, label) in enumerate(_NAMES.items()):
            errors = [row["errors"][name] for row in own if name in row["errors"]]
            if not errors:
                continue
            for key, style in (("largest", "-"), ("rms", "--")):
                values = np.sort(np.maximum([error[key] for error in errors], _FLOOR))
                share = 100.0 * np.arange(1, len(values) + 1) / len(values)
                axes.step(
                    values, share, style, where="post", color=f"C{number}", label=label if key == "largest" else None
                )
        for gate, style, text in ((largest, "-", "2/255"), (rms, "--", "gate of the RMS")):
            axes.axvline(gate, color="0.4", linestyle=style, linewidth=0.8)
            axes.annotate(text, (gate, 4.0), rotation=90, ha="right", va="bottom", fontsize=7, color="0.4")
        axes.set_xscale("log")
        axes.set_xlim(_FLOOR * 0.8, 3e-2)
        axes.set_ylim(0.0, 102.0)
        axes.set_title(f"{scene}: {len(own)} edits", fontsize=10)
        axes.set_xlabel("difference from a whole bake, AO (equal ones at the left edge)", fontsize=8)
        axes.grid(alpha=0.3)
        axes.legend(fontsize=7, loc="upper left")
    panels[0][0].set_ylabel("edits up to this difference, %")
    figure.tight_layout()
    figure.savefig(path, dpi=120)
