"""Edits and rebakes through the real window: from the change to the picture that shows its values."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from app.parts.placing import PlacingPart
from app.parts.rebake import RebakePart
from app.style import styled
from app.window_bench.driver import Driver
from app.window_bench.measure import SLICE_MS, about_result, baked
from app.window_bench.memory import MEMORY_NOTES, edits_in_a_row
from app.window_bench.slices import Slice, TimedApplication
from bake.bench.table import Measurements
from bake.errors import ObscuraError
from bake.rebake.types import RebakeReport
from bake.results import load_result
from bake.scene import load_scene
from bake.settings import BakeSettings
from bake.types import Role
from viewer.gizmo import Motion

Row = dict[str, Any]

FIRST_S, FINAL_S, ALPHA_S, TIMES_FASTER, RAYS_SHARE = 0.4, 3.0, 0.3, 20.0, 3.0
ALPHA_VERTICES = 200_000
"""Vertices that the gate on α is meant for; with more of them it is wider by as much."""

_ROUNDS, _ALPHAS = 7, 5
_PARTS = (
    "edit written and asked for", "heard by the engine", "scene read", "first values found", "values in the window",
    "picture",
)  # fmt: skip
_PROP_FACES = (50, 5000)
_PROP_M = 4.0
_STEP_M = 0.3


def measure_edits(path: Path | None, options: Mapping[str, Any], *, edits: int = 0) -> Iterator[Measurements]:
    """One prop moved again and again, and α changed; the whole bake of the same scene in the same run and window.

    Args:
        path: A scene, of which a copy is used; None for a level of a million triangles that it makes itself.
        options: Bake options by long name.
        edits: After that so many edits in a row, by which memory may hardly grow; 0 for none.

    Raises:
        InputError: the scene or the options cannot be used.
        ObscuraError: there is no display, no prop to move, or the window did not answer.
    """
    with TemporaryDirectory(prefix="obscura-bench-") as name:
        folder = Path(name)
        result = baked_copy(path, options, folder)
        app = styled(TimedApplication())
        driver = Driver(app, result, folder)
        try:
            run = _Run(driver)
            rows = run.rows()
            memory = edits_in_a_row(driver, edits) if edits else []
        finally:
            driver.close()
        loaded = load_result(result)
        about, seeds = about_result(loaded, path), {"bake": loaded.settings.seed}
    notes = [
        about,
        "medians from the change to the picture that shows its values, side file, scene and engine included; drawing "
        "is subtracted and stands apart; the whole bake runs in the same window, until its result is in view",
        f"gates: first values {FIRST_S:g} s, final ones {FINAL_S:g} s and {TIMES_FASTER:g} times faster than the bake; "
        f"rays traced at most {RAYS_SHARE:g} times those whose value changed; α alone {ALPHA_S:g} s for each "
        f"{ALPHA_VERTICES:,} vertices; {0.001 * SLICE_MS:g} s for the window's thread",
    ]
    yield Measurements("window edits", rows, notes, seeds=seeds)
    if memory:
        yield Measurements("memory over edits", memory, [about, *MEMORY_NOTES], seeds=seeds)


def baked_copy(path: Path | None, options: Mapping[str, Any], folder: Path) -> Path:
    """Bakes a copy of a scene with its files, or the benchmark's own level; returns the result's folder."""
    if path is not None:
        copies = folder / "scene"
        for file in load_scene(path).files:
            if (path.parent / file).is_file():
                (copies / file).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(path.parent / file, copies / file)
        path = copies / path.name
    return baked(path, options, folder)


class _Run:
    def __init__(self, driver: Driver) -> None:
        self._driver = driver
        self._window = driver.window
        self._part = driver.window.part(RebakePart)
        self._rebaker = self._part.rebaker
        self._reports: list[RebakeReport] = []
        self._splits: list[tuple[float, ...]] = []
        self._stored: list[float] = []
        self._rebaker.done.connect(self._on_done)

    def rows(self) -> list[Row]:
        """All measurements."""
        window, driver = self._window, self._driver
        bake = self._bake()
        prop = self._choose_prop()
        window.bench.show_panel("Object")
        self._until(lambda: window.document.current is not None and window.document.current.scene is not None)
        driver.settle()
        window.actions_by_id["rebake-at-once"].trigger()
        driver.settle()
        first: list[tuple[float, float]] = []
        final: list[tuple[float, float]] = []
        slices: list[Slice] = []
        self._splits.clear()
        self._stored.clear()
        for number in range(_ROUNDS):
            step = _STEP_M if number % 2 == 0 else -_STEP_M
            driver.phase("moving", lambda step=step: self._moved(step, first, final))
            slices += driver.phases["moving"][:1]
        reports = self._reports[1:]
        alphas: list[tuple[float, float]] = []
        for number in range(_ALPHAS):
            driver.phase("smoothing", lambda number=number: self._smoothed(160 + 20 * number, alphas))
        driver.phase("keeping", self._kept_smoothing)
        thresholds: list[tuple[float, float]] = []
        for number in range(_ALPHAS):
            driver.phase("judging", lambda number=number: self._judged(0.2 - 0.02 * number, thresholds))
        traced, changed = (_middle(reports, name) for name in ("rays_traced", "rays_changed"))
        first_s, final_s, alpha_s = _median(first[1:]), _median(final[1:]), _median(alphas[1:])
        alpha_gate = ALPHA_S * max(1.0, self._vertices() / ALPHA_VERTICES)
        alpha_rays = self._reports[-1].rays_traced
        longest = 1000.0 * max(item.seconds for item in slices[1:])
        return [
            {"what": "whole bake", "own s": bake},
            {"what": f"first values, {prop} moved", **_seconds(first[1:]), **_gate(FIRST_S, first_s <= FIRST_S)},
            *self._split(),
            {"what": "final values", **_seconds(final[1:]), **_gate(FINAL_S, final_s <= FINAL_S)},
            {
                "what": "stored result",
                "wall s": float(np.median(self._stored[1:])),
                "worst wall s": max(self._stored[1:]),
                "rounds": len(self._stored) - 1,
            },
            {"what": "bake over final", "times": bake / final_s, **_gate(TIMES_FASTER, bake >= TIMES_FASTER * final_s)},
            {"what": "rays traced", "count": traced},
            {"what": "rays changed", "count": changed},
            {
                "what": "traced over changed",
                "times": traced / max(changed, 1),
                **_gate(RAYS_SHARE, traced <= RAYS_SHARE * changed),
            },
            {"what": "the very first move: first values", **_seconds(first[:1])},
            {"what": "the very first move: stored result", "wall s": self._stored[0]},
            {"what": "another α: values", **_seconds(alphas[1:]), **_gate(alpha_gate, alpha_s <= alpha_gate)},
            {"what": "another threshold: values", **_seconds(thresholds[1:])},
            {"what": "another α: rays traced", "count": alpha_rays, **_gate(0.0, alpha_rays == 0)},
            {
                "what": "longest slice of the window's thread while moving",
                "own s": 0.001 * longest,
                **_gate(0.001 * SLICE_MS, longest <= SLICE_MS),
            },
        ]

    def _split(self) -> list[Row]:
        """Where the time to the first values went, pictures drawn meanwhile included."""
        own = self._splits[1:]
        medians: list[float] = np.median(own, axis=0).tolist()
        rows = [{"what": f"… {name}", "wall s": median} for name, median in zip(_PARTS, medians, strict=True)]
        stages = [report.stages for report in self._reports[1 : 1 + len(own)]]
        names = dict.fromkeys(name for stage in stages for name in stage)
        seconds = {name: float(np.median([stage.get(name, 0.0) for stage in stages])) for name in names}
        text = ", ".join(f"{name} {value:.2f} s" for name, value in seconds.items())
        return [*rows, {"what": f"the engine's stages: {text}"}]

    def _on_done(self, done: Any) -> None:
        if done.report is not None:
            self._reports.append(done.report)

    def _bake(self) -> float:
        """Seconds of a whole bake with the result's settings but for the seed, until its values are in view."""
        document, window = self._window.document, self._window
        assert document.result is not None
        settings: BakeSettings = document.result.settings
        before, begin = document.result, time.perf_counter()
        window.controller.bake(settings.replaced(seed=settings.seed + 1))
        self._until(lambda: document.result is not before and document.result is not None)
        seconds = time.perf_counter() - begin
        self._driver.settle()
        return seconds

    def _choose_prop(self) -> str:
        """Selects an object of the size of a prop, near the middle of the level, and looks at it."""
        document = self._window.document
        world = document.world
        assert world is not None
        faces = np.diff(world.first_face)
        boxes = document.object_boxes(range(world.object_count))
        size = (boxes[:, 1] - boxes[:, 0]).max(axis=1)
        static = np.array([role is Role.STATIC for role in world.object_roles])
        fits = static & (faces >= _PROP_FACES[0]) & (faces <= _PROP_FACES[1]) & (size <= _PROP_M)
        if not fits.any():
            raise ObscuraError("the level has no prop to move", where="bench edits", remedy="use another level")
        middle = np.median(np.asarray(world.positions), axis=0)
        away = np.linalg.norm(boxes.mean(axis=1) - middle, axis=1)
        prop = int(np.argmin(np.where(fits, away, np.inf)))
        document.select(prop)
        self._window.actions_by_id["frame"].trigger()
        return f"{int(faces[prop]):,} triangles"

    def _moved(self, step: float, first: list[tuple[float, float]], final: list[tuple[float, float]]) -> None:
        timing = self._rebaker.timing
        part, done = self._window.part(PlacingPart), len(self._reports)
        begin, drawn_before = time.perf_counter(), self._driver.drawn()
        asked: list[float] = []

        def is_first() -> bool:
            return self._rebaker.timing is not timing and self._rebaker.timing.first >= 0.0

        def on_began() -> None:
            asked.append(time.perf_counter() - begin)

        self._rebaker.began.connect(on_began)
        answer = self._driver.ask(lambda: part.place_by(Motion((step, 0.0, 0.0))), is_first)
        self._rebaker.began.disconnect(on_began)
        first.append((answer.seconds, answer.drawing))
        now = self._rebaker.timing
        ends = (0.0, asked[0], *(asked[0] + then for then in (now.begun, now.read, now.sent, now.first)))
        shown = answer.seconds + answer.drawing
        self._splits.append((*np.diff((*ends, max(shown, ends[-1]))).tolist(),))
        if self._rebaker.timing.final < 0.0:
            self._driver.ask(lambda: None, lambda: self._rebaker.timing.final >= 0.0)
        drawing = self._driver.drawn() - drawn_before
        final.append((time.perf_counter() - begin - drawing, drawing))
        self._until(lambda: len(self._reports) > done and not self._rebaker.is_busy)
        self._stored.append(self._rebaker.timing.stored)

    def _smoothed(self, place: int, found: list[tuple[float, float]]) -> None:
        """From a move of the slider of α to its values in view; nothing is stored."""
        document, slider = self._window.document, self._part.panel.alpha.slider
        before = document.field
        answer = self._driver.ask(lambda: slider.setValue(place), lambda: document.field is not before)
        found.append((answer.seconds, answer.drawing))

    def _judged(self, threshold: float, found: list[tuple[float, float]]) -> None:
        """From another threshold of back faces to its values in view; nothing is stored."""
        document, controller = self._window.document, self._window.controller
        before = document.field

        def act() -> None:
            document.set_threshold(threshold)
            controller.solve_threshold()

        answer = self._driver.ask(act, lambda: document.field is not before)
        found.append((answer.seconds, answer.drawing))

    def _vertices(self) -> int:
        world = self._window.document.world
        return 0 if world is None else world.vertex_count

    def _kept_smoothing(self) -> None:
        """α of the slider put into the bake: a rebake without a ray."""
        done = len(self._reports)
        self._driver.ask(self._part.panel.alpha.keep.click, lambda: len(self._reports) > done)
        self._until(lambda: not self._rebaker.is_busy)

    def _until(self, condition: Callable[[], bool], patience_s: float = 1800.0) -> None:
        begin = time.perf_counter()
        while not condition():
            if time.perf_counter() - begin > patience_s:
                raise ObscuraError("the window did not answer", where="bench edits", remedy="run it on an idle machine")
            self._driver.wait(5)


def _gate(gate: float, passed: bool) -> Row:
    return {"gate": gate, "passed": passed}


def _middle(reports: list[RebakeReport], name: str) -> int:
    return int(np.median([getattr(report, name) for report in reports]))


def _median(pairs: list[tuple[float, float]]) -> float:
    return float(np.median([own for own, _ in pairs]))


def _seconds(pairs: list[tuple[float, float]]) -> Mapping[str, Any]:
    return {
        "own s": _median(pairs),
        "drawing s": float(np.median([drawing for _, drawing in pairs])),
        "worst own s": max(own for own, _ in pairs),
        "rounds": len(pairs),
    }
