"""What the benchmark does in the window, and how long each takes: views, readouts, explanations, models of regions."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from PyQt6.QtCore import QPointF

from app.parts.explain import PANEL, ExplainPart
from app.region_part import RegionsPart
from app.window_bench.driver import Answer, Driver
from viewer.fields import Quantity
from viewer.inspections import Inspection
from viewer.region_view import RegionColor

Row = dict[str, Any]

VIEW_MS, HOVER_MS, EXPLAIN_MS, SLIDER_MS = 100.0, 16.0, 300.0, 100.0
_ROUNDS, _HOVERS, _CLICKS, _SLIDES = 3, 60, 12, 11
_MARGIN = 0.15
"""Share of the view at each side that is left out: the legend lies there."""


def switch_views(driver: Driver) -> list[Row]:
    """A row a view: from the action to the picture."""
    window, document = driver.window, driver.window.document
    kinds = [kind for kind in Inspection if kind is not Inspection.TUG]  # that one waits for a solve
    names = ["geometry", "blend", "next-distance", "game", "shading", *(f"inspect-{kind.value}" for kind in kinds)]
    answers: dict[str, list[Answer]] = {name: [] for name in names}
    for _ in range(_ROUNDS):
        for name in names:
            before = document.display

            def there(before: object = before) -> bool:
                made = document.display.quantity is not Quantity.INSPECTION or document.inspection is not None
                return document.display is not before and made

            answers[name].append(driver.ask(window.actions_by_id[name].trigger, there))
            driver.wait(30)
            if name in ("game", "shading"):  # back again
                driver.ask(window.actions_by_id[name].trigger, lambda: True)
    return [timed_row(f"view: {name.removeprefix('inspect-')}", found, VIEW_MS) for name, found in answers.items()]


def hover(driver: Driver) -> list[Row]:
    """From a move of the mouse to the readout."""
    strip, answers = driver.window.strip, list[Answer]()
    driver.ask(driver.window.actions_by_id["blend"].trigger, lambda: True)
    for place in _places(driver, _HOVERS):
        before = strip.text()
        answers.append(
            driver.ask(lambda place=place: driver.move_to(place), lambda before=before: strip.text() != before)
        )
        driver.wait(40)
    return [timed_row("hover readout", answers, HOVER_MS)]


def explain(driver: Driver) -> list[Row]:
    """From a click to the explanation with its rays: the first, and all others."""
    window, part = driver.window, driver.window.part(ExplainPart)
    window.bench.show_panel(PANEL)
    driver.settle()
    answers: list[Answer] = []
    for place in _places(driver, _CLICKS + 1):
        before = part.explained
        answers.append(
            driver.ask(lambda place=place: driver.click(place), lambda before=before: _is_new(part.explained, before))
        )
        driver.settle()
    return [timed_row("explanation, first", answers[:1], None), timed_row("explanation", answers[1:], EXPLAIN_MS)]


def slide(driver: Driver) -> list[Row]:
    """From a move of β's slider to boxes and links in their new colours; none without regions."""
    part = driver.window.part(RegionsPart)
    state = part.state
    if state.regions is None:
        return []
    count = len(state.regions.graph)
    driver.window.bench.show_panel("Regions")
    driver.settle()
    state.set_view(state.view.replaced(boxes=RegionColor.MISMATCH, links=True))
    driver.settle()
    slider, answers = part.panel.models.slider, list[Answer]()
    for position in np.random.default_rng(1).permutation(np.arange(20, 190, 10))[:_SLIDES].tolist():
        before = state.regions
        answers.append(
            driver.ask(
                lambda position=position: slider.setValue(position),
                lambda before=before: _is_new(state.regions, before),
            )
        )
        driver.wait(100)
    return [timed_row(f"β of {count} regions", answers[1:], SLIDER_MS)]


def timed_row(what: str, answers: Iterable[Answer], gate: float | None) -> Row:
    """Medians of answers, and whether that of our own work keeps to the gate, in milliseconds."""
    found = list(answers)
    milliseconds = 1000.0 * float(np.median([answer.seconds for answer in found]))
    row: Row = {
        "what": what,
        "own ms": milliseconds,
        "drawing ms": 1000.0 * float(np.median([answer.drawing for answer in found])),
        "worst own ms": 1000.0 * max(answer.seconds for answer in found),
        "times": len(found),
    }
    return row if gate is None else {**row, "gate ms": gate, "passed": milliseconds <= gate}


def _is_new(value: object, before: object) -> bool:
    return value is not None and value is not before


def _places(driver: Driver, count: int) -> list[QPointF]:
    """Random places of the view with surface under them, each on another face than the one before."""
    viewport, random = driver.window.area.main, np.random.default_rng(7)
    width, height = viewport.view.width(), viewport.view.height()
    found: list[QPointF] = []
    faces = [-1]
    for x, y in random.uniform(_MARGIN, 1.0 - _MARGIN, (100 * count, 2)):
        place = QPointF(float(round(x * width)), float(round(y * height)))
        pick = viewport.pick_at(place)
        if pick is not None and pick.face != faces[-1]:
            found.append(place)
            faces.append(pick.face)
        if len(found) == count:
            break
    return found


TASKS: tuple[tuple[str, Callable[[Driver], list[Row]]], ...] = (
    ("views", switch_views),
    ("hovering", hover),
    ("explaining", explain),
    ("sliding", slide),
)
"""What is done, in this order."""
