"""Rebakes against whole bakes: random edits of levels, one after the other, and how far each result is off.

Every edit is followed by one session, so that what it skips adds up as it does under an artist's hands; after each the
edited scene is baked whole with the same seeds and compared. What was compared can be kept in a folder, from which a
later run goes on: it opens the result as it was stored, as an artist would the next day.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from bake.bench.rebake_book import Book
from bake.bench.rebake_edits import KINDS, RandomEdits
from bake.bench.rebake_error import rebake_errors
from bake.bench.table import Measurements
from bake.devices import Device, resolve
from bake.pipeline import bake, settings_for
from bake.rebake.session import DEFAULT_BOUND, RebakeSession
from bake.rebake.types import Partial, RebakeOutcome
from bake.scene import load_scene
from bake.settings import BakeSettings
from bake.stages import StageClock
from bake.types import BakeResult, Scene

LARGEST, RMS = 2.0 / 255.0, 1e-3
"""Gates at the default bound: largest difference and root mean square, over each kind of values."""

EXACT = 1e-5
"""Gate with the bound at 0."""

COMPARED = ("vertices", "voxels", "trees", "shrub_scalars", "small_scalars", "points", "regions")

_T = TypeVar("_T")


def measure_rebakes(
    paths: Sequence[Path],
    options: Mapping[str, Any],
    *,
    edits: int,
    bound: float = DEFAULT_BOUND,
    seed: int = 1,
    keep: Path | None = None,
    seconds: float = float("inf"),
) -> tuple[list[Measurements], list[dict[str, Any]]]:
    """Distributions of the differences after random edits, one table a kind of view on them, and a row an edit.

    Args:
        paths: Scenes.
        options: Bake options by long name.
        edits: In each scene.
        bound: Most that may be skipped for a sample; the gates are those that belong to it.
        seed: Of the edits.
        keep: A folder where each comparison is written down at once, and from which a later run goes on.
        seconds: After so many no further edit is begun.
    """
    until = time.monotonic() + seconds
    rows: list[dict[str, Any]] = []
    for path in paths:
        rows += edit_rows(path, options, edits=edits, bound=bound, seed=seed, keep=keep, until=until)
    return summarised(rows, edits=edits * len(paths), bound=bound, seed=seed), rows


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
        result = _drained(bake(scene, settings, self._device, clock))
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


def _drained(steps: Generator[Any, None, _T]) -> _T:
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value


def summarised(rows: Sequence[Mapping[str, Any]], *, edits: int, bound: float, seed: int) -> list[Measurements]:
    """The tables: differences by scene and kind of values, and edits by kind."""
    limit, rms_limit = (LARGEST, RMS) if bound > 0.0 else (EXACT, EXACT)
    notes = [
        f"{len(rows)} of {edits} edits of seed {seed}, bound {bound:.5f}; after each the scene was baked whole, with "
        "the same seeds",
        f"gates: no value off by more than {limit:.2g}, root mean square at most {rms_limit:.2g}, after every edit",
    ]
    return [
        Measurements("rebake: differences", _by_values(rows, limit, rms_limit), notes, seeds={"edits": seed}),
        Measurements("rebake: kinds of edits", _by_kind(rows), [], seeds={"edits": seed}),
    ]


def _by_values(rows: Sequence[Mapping[str, Any]], limit: float, rms_limit: float) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []
    for scene in dict.fromkeys(row["scene"] for row in rows):
        for name in COMPARED:
            errors = [row["errors"][name] for row in rows if row["scene"] == scene and name in row["errors"]]
            if not errors:
                continue
            largest = np.array([error["largest"] for error in errors])
            rms = np.array([error["rms"] for error in errors])
            found.append(
                {
                    "scene": scene,
                    "values": name,
                    "edits": len(errors),
                    "equal": int(np.count_nonzero(largest == 0.0)),
                    "largest_median": float(np.median(largest)),
                    "largest_95": float(np.quantile(largest, 0.95)),
                    "largest": float(largest.max()),
                    "rms_median": float(np.median(rms)),
                    "rms": float(rms.max()),
                    "passed": bool(largest.max() <= limit and rms.max() <= rms_limit),
                }
            )
    return found


def _by_kind(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []
    for scene in dict.fromkeys(row["scene"] for row in rows):
        for kind in KINDS:
            own = [row for row in rows if row["scene"] == scene and row["kind"] == kind]
            if not own:
                continue
            part = [row for row in own if not row["full"]]
            changed = sum(row["rays_changed"] for row in part)
            found.append(
                {
                    "scene": scene,
                    "kind": kind,
                    "edits": len(own),
                    "in_full": len(own) - len(part),
                    "rebake_s": float(np.median([row["seconds"] for row in own])),
                    "whole_s": float(np.median([row["whole_seconds"] for row in own])),
                    "samples_checked": int(np.median([row["samples_checked"] + row["samples_whole"] for row in own])),
                    "rays_traced": int(np.median([row["rays_traced"] for row in own])),
                    "traced_per_changed": sum(row["rays_traced"] for row in part) / changed if changed else None,
                }
            )
    return found
