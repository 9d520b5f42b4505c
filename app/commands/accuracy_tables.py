"""The tables of `bench accuracy`, with their pictures: bakers, ways to choose directions, tracers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.commands.console import note
from bake.errors import InputError

if TYPE_CHECKING:
    from bake.bench.front import FrontRow
    from bake.bench.table import Measurements

TABLES = ("samplers", "tracers", "front")


@dataclass(frozen=True, slots=True, kw_only=True)
class AccuracyRequest:
    """What to measure, and where pictures go.

    Attributes:
        scenes: Scene files; without any, the scenes that each table makes itself.
        options: Bake options by long name.
        tables: Names with commas between, or all.
        peers: An interpreter that has other bakers installed.
        scale: Metres in a unit of the scenes.
        plots: A folder for pictures.
        page: The page that the tables go on; pictures beside it are shown below them.
    """

    scenes: Sequence[Path]
    options: dict[str, Any]
    tables: str
    peers: Path | None
    scale: float
    plots: Path | None
    page: Path | None


def accuracy_tables(asked: AccuracyRequest) -> Iterable[Measurements]:
    """Each table as soon as it is measured.

    Raises:
        InputError: a table that there is not; before anything is measured.
    """
    wanted = [name.strip() for name in asked.tables.split(",") if name.strip()] or list(TABLES)
    unknown = [name for name in wanted if name not in TABLES]
    if unknown:
        raise InputError(f"no table {unknown[0]!r}", where="--tables", remedy=f"use some of {', '.join(TABLES)}")
    if asked.plots is not None:
        asked.plots.mkdir(parents=True, exist_ok=True)  # before minutes of measuring
    return _measured(asked, wanted)


def _measured(asked: AccuracyRequest, wanted: Sequence[str]) -> Iterator[Measurements]:
    if "samplers" in wanted:
        yield from _samplers(asked)
    if "tracers" in wanted:
        from bake.bench.tracers import measure_tracers

        yield measure_tracers(asked.scenes, asked.options, scale=asked.scale)
    if "front" in wanted:
        yield from _fronts(asked)


def _samplers(asked: AccuracyRequest) -> Iterator[Measurements]:
    from bake.bench.samplers import measure_samplers, samplers_table

    scenes = list(measure_samplers(asked.scenes, asked.options, scale=asked.scale))
    for group in [[scene] for scene in scenes] if asked.scenes else [scenes]:
        table = samplers_table(group)
        if asked.plots is not None:
            from app.commands.sampler_plot import plot_samplers

            picture = asked.plots / f"{table.name.replace(': ', '-').replace(' ', '-')}.png"
            plot_samplers(picture, group)
            table = _shown(table, picture, "error over rays", asked.page)
        yield table


def _fronts(asked: AccuracyRequest) -> Iterator[Measurements]:
    from bake.bench.front import measure_fronts
    from bake.bench.front_tables import tables

    fronts = measure_fronts(asked.scenes, asked.options, peers=asked.peers, scale=asked.scale, tell=_tell)
    for front in fronts:
        rows, leads = tables(front)
        if asked.plots is not None:
            from app.commands.front_plot import plot_front

            picture = asked.plots / f"front-{front.scene.replace(' ', '-')}.png"
            plot_front(picture, front)
            rows = _shown(rows, picture, f"RMSE over seconds, {front.scene}", asked.page)
        yield from (rows, leads)


def _tell(row: FrontRow) -> None:
    note(f"{row.scene}: {row.baker}, {row.effort}: {row.seconds:.3g} s, RMSE {row.rmse:.4f}")


def _shown(table: Measurements, picture: Path, what: str, page: Path | None) -> Measurements:
    """The table with its picture below, if that lies beside its page."""
    if page is None or page.parent.resolve() != picture.parent.resolve():
        return table
    return replace(table, notes=[*table.notes, f"![{what}]({picture.name})"])
