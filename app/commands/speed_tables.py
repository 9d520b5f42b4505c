"""The tables of `bench speed` and `bench workloads`, and what may be said about them."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.commands.accuracy_tables import TABLES as ACCURACY
from bake.errors import InputError

if TYPE_CHECKING:
    from bake.bench.table import Measurements

_UNASKED = ("parity", "card", "scale", "overhead", "solving", "updates", "start")
TABLES = (*_UNASKED, "largest", "order", "tail")
"""The last three by name alone: the largest field by itself, where the table of scales takes too long in one run, and
what the tracer's order of rays and their length cost."""

_SMALLEST = 10_000


def add_speed_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options of both."""
    parser.add_argument(
        "--largest", type=int, default=1_000_000, metavar="N", help="triangles of the largest field (speed only)"
    )
    parser.add_argument(
        "--tables",
        default="",
        metavar="NAME,…",
        help=f"some of {', '.join(TABLES)} alone (speed), or of {', '.join(ACCURACY)} (accuracy)",
    )
    parser.add_argument(
        "--share",
        type=float,
        metavar="X",
        help="part of the points that is traced, times extrapolated and marked (workloads only); by default all on "
        "CUDA, and on the CPU 0.01 of the level and all of the sled",
    )


def speed_tables(
    scenes: Sequence[Path], options: dict[str, Any], *, tables: str, largest: int, plots: Path | None
) -> Iterable[Measurements]:
    """Each table as soon as it is measured.

    Args:
        scenes: For the overhead, in place of the fields that are made; for order and tail, besides one.
        options: Bake options by long name.
        tables: Names with commas between, or all.
        largest: Triangles of the largest field.
        plots: Where to draw seconds by stage.

    Raises:
        InputError: a table or a size that there is not; before anything is measured.
    """
    wanted = [name.strip() for name in tables.split(",") if name.strip()] or list(_UNASKED)
    unknown = [name for name in wanted if name not in TABLES]
    if unknown:
        raise InputError(f"no table {unknown[0]!r}", where="--tables", remedy=f"use some of {', '.join(TABLES)}")
    if largest < _SMALLEST:
        raise InputError(f"a largest field of {largest:,}", where="--largest", remedy=f"use {_SMALLEST:,} or more")
    if plots is not None:
        plots.mkdir(parents=True, exist_ok=True)  # before minutes of measuring
    return _measured(wanted, scenes, options, largest, plots)


def _measured(
    wanted: Sequence[str], scenes: Sequence[Path], options: dict[str, Any], largest: int, plots: Path | None
) -> Iterable[Measurements]:
    if "parity" in wanted:
        from bake.bench.scaling_parity import measure_parity

        yield measure_parity(options)
    if "card" in wanted:
        from bake.bench.scaling_card import measure_card

        yield measure_card(options)
    if "scale" in wanted:
        from bake.bench.scaling import measure_scaling

        measured = measure_scaling(options, largest=largest)
        if plots is not None:
            from app.commands.speed_plot import plot_speed

            plot_speed(plots / "speed-by-stage.png", measured[0].rows)
        yield from measured
    if "overhead" in wanted:
        from bake.bench.overhead import measure_overhead

        yield measure_overhead(scenes, options)
    if "solving" in wanted or "updates" in wanted:
        from bake.bench.solving import measure_solving, measure_updates

        if "solving" in wanted:
            yield measure_solving()
        if "updates" in wanted:
            yield measure_updates()
    if "start" in wanted:
        from bake.bench.scaling_start import measure_start

        yield measure_start(options)
    if "largest" in wanted:
        from bake.bench.scaling import measure_largest

        yield from measure_largest(options, largest=largest)
    if "order" in wanted:
        from bake.bench.ray_order import measure_order

        yield measure_order(scenes, options)
    if "tail" in wanted:
        from bake.bench.tail_clip import measure_tail

        yield measure_tail(scenes, options)
