"""Steps of work in the window's thread: in order, one a turn."""

from __future__ import annotations

import pytest
from pytestqt.qtbot import QtBot

from app.turns import Turns

pytestmark = pytest.mark.gui


def test_steps_come_in_order_one_a_turn(qtbot: QtBot) -> None:
    """The first step is done at once, others wait for their turn, later series for the end of earlier ones."""
    turns, done = Turns(), list[int]()
    turns.add(lambda: done.append(1), lambda: done.append(2), lambda: done.append(3))
    turns.add(lambda: done.append(4))
    assert done == [1]
    assert turns.is_busy
    qtbot.waitUntil(lambda: not turns.is_busy)
    assert done == [1, 2, 3, 4]


def test_a_step_that_fails_does_not_stop_the_next(qtbot: QtBot) -> None:
    """Its error is told where the event loop tells errors."""
    turns, done = Turns(), list[int]()
    with pytest.raises(ZeroDivisionError):
        turns.add(lambda: 1 // 0, lambda: done.append(2))
    qtbot.waitUntil(lambda: not turns.is_busy)
    assert done == [2]


def test_nothing_comes_after_the_end(qtbot: QtBot) -> None:
    """What was to come is left out."""
    turns, done = Turns(), list[int]()
    turns.add(lambda: done.append(1), lambda: done.append(2))
    turns.close()
    qtbot.wait(20)
    assert done == [1]
