"""A walk's pops and figures as tables."""

from __future__ import annotations

import math

from bake.region_types import Regions
from bake.walk import CHOSEN, STEP_BOUND, Pop, Variant, Walk, WalkMetrics
from viewer.instance_rows import Column
from viewer.region_glyph import AXES
from viewer.walk_curves import TITLES

FIGURES: tuple[tuple[str, str], ...] = (
    ("step", f"Largest step of AO from frame to frame over seven normals; {STEP_BOUND} is one code at white"),
    ("codes", "The same in 8-bit sRGB codes under full ambient light"),
    ("pops", "Frames on which the figure visibly jumps"),
    ("lag", "Median seconds until nine tenths of a boundary's jump have arrived"),
    ("error", "Mean distance to the truth; only where that was traced"),
)
_MEANINGS = dict(FIGURES)


def facing(normal: int) -> str:
    """A normal of the walk by name."""
    return "needle" if normal == CHOSEN else AXES[normal]


def pop_columns(pops: tuple[Pop, ...], regions: Regions) -> list[Column]:
    """A row a pop, those of most codes first."""
    names = regions.graph.names
    places = [
        names[pop.before] if pop.before == pop.after else f"{names[pop.before]} → {names[pop.after]}" for pop in pops
    ]
    variants = [TITLES[pop.variant] for pop in pops]
    return [
        Column("Codes", [f"{pop.codes:.1f}" for pop in pops], [pop.codes for pop in pops], _MEANINGS["codes"]),
        Column("Time s", [f"{pop.time:.2f}" for pop in pops], [pop.time for pop in pops], "The first frame to show it"),
        Column("Boundary", places, places, "The regions on either side; a single one where none was crossed"),
        Column("Variant", variants, variants, "Where it was found"),
        Column("Facing", [facing(pop.normal) for pop in pops], [pop.normal for pop in pops], "Normal that jumps most"),
        Column("Step", [f"{pop.step:+.4f}" for pop in pops], [abs(pop.step) for pop in pops], "Change of AO"),
    ]


def figure_rows(walk: Walk) -> list[list[str]]:
    """A row a variant: its name, then what `FIGURES` lists."""
    order = [variant for variant in Variant if variant in walk.metrics]
    return [[TITLES[variant], *_figures(walk.metrics[variant], variant)] for variant in order]


def _figures(metrics: WalkMetrics, variant: Variant) -> list[str]:
    real = variant is Variant.TRUTH
    return [
        f"{metrics.worst_step:.4f}",
        f"{metrics.worst_codes:.1f}" if metrics.worst_codes < 10.0 else f"{metrics.worst_codes:.0f}",
        "–" if real else f"{metrics.pops:,}",
        "–" if real or math.isnan(metrics.lag) else f"{metrics.lag:.2f}",
        "–" if real or math.isnan(metrics.mean_error) else f"{metrics.mean_error:.3f}",
    ]
