"""Rebakes against whole bakes: random edits of levels, one after the other, and how far each result is off.

Every edit is followed by one session, so that what it skips adds up as it does under an artist's hands; after each the
edited scene is baked whole with the same seeds and compared. What was compared can be kept in a folder, from which a
later run goes on: it opens the result as it was stored, as an artist would the next day.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeVar

from bake.bench.rebake_book import Book
from bake.bench.rebake_edits import RandomEdits
from bake.bench.rebake_error import rebake_errors
from bake.bench.rebake_tables import rebake_tables
from bake.bench.table import Measurements
from bake.devices import Device, resolve
from bake.pipeline import bake, settings_for
from bake.rebake.session import DEFAULT_BOUND, RebakeSession
from bake.rebake.types import Partial, RebakeOutcome
from bake.scene import load_scene
from bake.settings import BakeSettings
from bake.stages import StageClock, drained
from bake.types import BakeResult, Scene

_T = TypeVar("_T")


def measure_rebakes(
    paths: Sequence[Path],
    options: Mapping[str, Any],
    *,
    edits: int,
    bound: float = DEFAULT_BOUND,
    seeds: Sequence[int] = (1,),
    keep: Path | None = None,
    seconds: float = float("inf"),
) -> tuple[list[Measurements], list[dict[str, Any]]]:
    """Distributions of the differences after random edits, one table a kind of view on them, and a row an edit.

    Args:
        paths: Scenes.
        options: Bake options by long name.
        edits: In a row, in each scene and for each seed.
        bound: Most that may be skipped for a sample; the gates are those that belong to it.
        seeds: Of the edits.
        keep: A folder where each comparison is written down at once, and from which a later run goes on.
        seconds: After so many no further edit is begun.
    """
    until = time.monotonic() + seconds
    rows: list[dict[str, Any]] = []
    for path in paths:
        for seed in seeds:
            rows += edit_rows(path, options, edits=edits, bound=bound, seed=seed, keep=keep, until=until)
    return rebake_tables(rows, edits=edits * len(paths) * len(seeds), bound=bound, seeds=seeds), rows


def edit_rows(
    path: Path,
    options: Mapping[str, Any],
    *,
    edits: int,
    bound: float,
    seed: int,
    keep: Path | None,
    until: float,
) -> list[dict[str, Any]]:
    """One row an edit of a scene: what it was, what the rebake cost and how far it is from a whole bake."""
    settings = settings_for(path, options)
    book = Book(keep, path, settings, bound=bound, seed=seed)
    if len(book.rows) >= edits:
        return book.rows[:edits]
    scene = load_scene(path, crease_angle=settings.crease_angle)
    device = resolve(settings.device)
    sequence, wholes = RandomEdits(scene, settings, seed), _Wholes(device)
    done, result = book.state()
    for _ in range(done):
        scene = sequence.next().scene
    if result is None:
        result = wholes.of(scene, settings)[0]
    with RebakeSession(result, scene, device, bound=bound) as session:
        while done < edits and time.monotonic() <= until:
            edit = sequence.next()
            begin = time.perf_counter()
            outcome, first = _followed(session, edit.scene, edit.settings)
            seconds = time.perf_counter() - begin
            done += 1
            if done <= len(book.rows):
                continue
            whole, whole_seconds = wholes.of(edit.scene, edit.settings)
            book.add(
                {
                    "scene": path.stem,
                    "seed": seed,
                    "edit": done - 1,
                    "kind": edit.kind,
                    "object": edit.object,
                    "seconds": seconds,
                    "first_seconds": first,
                    "whole_seconds": whole_seconds,
                    **_figures(outcome),
                    "errors": {name: asdict(error) for name, error in rebake_errors(outcome.result, whole).items()},
                }
            )
        book.put_state(done, session.result)
    return book.rows[:done]


class _Wholes:
    """Whole bakes; the last few are kept, for an undo goes back to one of them."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._known: list[tuple[Scene, BakeSettings, tuple[BakeResult, float]]] = []

    def of(self, scene: Scene, settings: BakeSettings) -> tuple[BakeResult, float]:
        """A whole bake, and the seconds that it took."""
        for known, said, found in self._known:
            if known is scene and said == settings:
                return found
        clock = StageClock()
        result = drained(bake(scene, settings, self._device, clock))
        self._known = [*self._known[-3:], (scene, settings, (result, clock.seconds))]
        return result, clock.seconds


def _figures(outcome: RebakeOutcome) -> dict[str, Any]:
    report = asdict(outcome.report)
    names = (
        "full", "samples", "samples_checked", "samples_whole", "samples_changed", "rays_tested", "rays_traced",
        "rays_changed", "rays_elsewhere", "vertices_changed", "voxels", "voxels_traced", "points", "points_traced",
        "bound",
    )  # fmt: skip
    return {name: report[name] for name in names}


def _followed(session: RebakeSession, scene: Scene, settings: BakeSettings) -> tuple[RebakeOutcome, float]:
    """What a rebake makes, and after how many seconds the first values were there."""
    begin, first = time.perf_counter(), float("nan")
    work = session.rebake(scene, settings)
    while True:
        try:
            step = next(work)
        except StopIteration as end:
            outcome: RebakeOutcome = end.value
            return outcome, first
        if isinstance(step, Partial) and first != first:
            first = time.perf_counter() - begin
