"""A walk in figures, for JSON and for the terminal."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from app.commands.progress import duration
from bake.types import BakeResult
from bake.walk import CHOSEN, STEP_BOUND, Pop, Variant

if TYPE_CHECKING:
    from bake.walk.result_walk import WalkOutcome

_MOST_POPS = 12  # on the terminal; JSON has them all
_AXES = ("+x", "-x", "+y", "-y", "+z", "-z")
_HEADINGS = (
    "variant",
    "worst step",
    "codes",
    "p99.9 step",
    "at boundary",
    "jump ratio",
    "variation",
    "lag s",
    "mean error",
    "max error",
    "pops",
)


def walk_summary(result: BakeResult, outcome: WalkOutcome) -> dict[str, Any]:
    """What `walk --json` prints; plain values that JSON can hold."""
    walk, path, truth = outcome.walk, outcome.path, outcome.truth
    options = walk.options
    names = _names(result)
    return {
        "length_m": path.length,
        "seconds": float(walk.time[-1]),
        "frames": len(walk),
        "speed_m_per_s": options.speed,
        "fps": options.frame_rate,
        "half_life_s": options.half_life,
        "normal": options.normals[CHOSEN].tolist(),
        "distance_m": result.settings.column_distances[options.column],
        "regions": len(names),
        "visited": None if outcome.visited is None else int(outcome.visited.sum()),
        "outside_share": float(1.0 - walk.inside.mean()),
        "truth": None
        if truth is None
        else {
            "places": len(truth.distance),
            "directions": truth.directions,
            "invalid_share": float(1.0 - truth.valid.mean()),
            "interpolation_error": _finite(float(truth.error[options.column])),
        },
        "variants": [
            {"variant": str(variant), **{key: _finite(value) for key, value in dataclasses.asdict(metrics).items()}}
            for variant, metrics in walk.metrics.items()
        ],
        "pops": [_pop(pop, names) for pop in walk.pops],
    }


def walk_text(result: BakeResult, outcome: WalkOutcome) -> str:
    """What `walk` prints: one table of variants, and the worst pops."""
    walk, names = outcome.walk, _names(result)
    options = walk.options
    distance = result.settings.column_distances[options.column]
    places = "given path" if outcome.visited is None else f"tour of {outcome.visited.sum():,} of {len(names):,} regions"
    lines = [
        f"{places}: {outcome.path.length:,.1f} m at {options.speed:g} m/s, {len(walk):,} frames at "
        f"{options.frame_rate:g} Hz, {duration(float(walk.time[-1]))}; AO at {distance:g} m, seven normals",
    ]
    if outcome.truth is not None:
        error = float(outcome.truth.error[options.column])
        lines.append(
            f"truth: {len(outcome.truth.distance):,} places of {outcome.truth.directions:,} rays, "
            f"interpolated with an error of {error:.4f} RMS"
        )
    outside = float(1.0 - walk.inside.mean())
    if outside > 0.0:
        lines.append(f"{100.0 * outside:.1f} % of the way lies in no region; there the nearest one counts")
    rows = [_HEADINGS, *(_row(variant, outcome) for variant in walk.metrics)]
    lines += ["", *_aligned(rows), ""]
    lines.append(
        f"a step of {STEP_BOUND:g} is one 8-bit sRGB code at white; variation and errors are against the truth"
    )
    if not walk.pops:
        return "\n".join([*lines, "no pops"])
    shown = [("time s", "from", "to", "step", "codes", "normal", "variant")]
    shown += [
        (
            f"{pop.time:.2f}",
            names[pop.before],
            names[pop.after],
            f"{pop.step:+.4f}",
            f"{pop.codes:.1f}",
            normal_name(pop.normal),
            str(pop.variant),
        )
        for pop in walk.pops[:_MOST_POPS]
    ]
    lines += ["", f"{len(walk.pops):,} pops, the worst first:", *_aligned(shown, text=(1, 2, 5, 6))]
    return "\n".join(lines)


def normal_name(column: int) -> str:
    """What a column of a walk's AO is called."""
    return _AXES[column] if column < CHOSEN else "chosen"


def _row(variant: Variant, outcome: WalkOutcome) -> tuple[str, ...]:
    m = outcome.walk.metrics[variant]
    values = (
        (m.worst_step, ".4f"),
        (m.worst_codes, ".1f"),
        (m.high_step, ".4f"),
        (m.worst_boundary_step, ".4f"),
        (m.jump_ratio, ".1f"),
        (m.excess_variation, ".2f"),
        (m.lag, ".2f"),
        (m.mean_error, ".4f"),
        (m.max_error, ".3f"),
    )
    cells = (format(value, form) if math.isfinite(value) else "" for value, form in values)
    return (str(variant), *cells, f"{m.pops:,}")


def _pop(pop: Pop, names: tuple[str, ...]) -> dict[str, Any]:
    return {
        "time_s": pop.time,
        "a": names[pop.before],
        "b": names[pop.after],
        "step": pop.step,
        "codes": pop.codes,
        "variant": str(pop.variant),
        "frame": pop.frame,
        "normal": normal_name(pop.normal),
    }


def _names(result: BakeResult) -> tuple[str, ...]:
    return () if result.regions is None else result.regions.graph.names


def _aligned(rows: list[tuple[str, ...]], *, text: tuple[int, ...] = (0,)) -> list[str]:
    """Rows in columns: texts to the left, numbers to the right."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return [
        "  ".join(
            c.ljust(w) if i in text else c.rjust(w) for i, (c, w) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
