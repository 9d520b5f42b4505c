"""Progress on stderr, and how a bake is driven."""

from __future__ import annotations

import io
import os
import signal
from collections.abc import Generator

import pytest

from app.commands import progress as module
from app.commands.progress import ProgressLine, describe, drive, duration
from bake.errors import Cancelled, DeviceError
from bake.types import Progress


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self) -> bool:
        """Yes."""
        return True


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """A clock that stands still until its only element is changed."""
    now = [100.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    return now


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.04, "0.0 s"), (9.94, "9.9 s"), (9.96, "10 s"), (59.4, "59 s"), (59.6, "1 min 0 s"), (7500, "2 h 5 min")],
)
def test_duration(seconds: float, text: str) -> None:
    """Times are as long as they need to be."""
    assert duration(seconds) == text


def test_what_a_line_says() -> None:
    """Stage, share, rate and the time that is left, as far as they are known."""
    assert describe(Progress("load", 0, 0)) == "load …"
    assert describe(Progress("trace", 0, 1000, 0.0, 0.0)) == "trace 0 %"
    assert describe(Progress("trace", 250, 1000, 10.0, 3.1e6)) == "trace 25 %, 3.1 Mrays/s, 30 s left"
    assert describe(Progress("trace", 1000, 1000, 10.0, 3.1e6)) == "trace 100 %, 3.1 Mrays/s"


def test_plain_lines_once_a_second(clock: list[float]) -> None:
    """Without a terminal there is at most a line a second, and none in the first."""
    stream = io.StringIO()
    line = ProgressLine(stream)
    for step in range(31):
        clock[0] = 100.0 + step / 10
        line.show(Progress("trace", step, 30))
    line.clear()
    assert stream.getvalue().splitlines() == ["trace 33 %", "trace 66 %", "trace 100 %"]


def test_a_terminal_line_is_redrawn(clock: list[float]) -> None:
    """On a terminal one line is drawn over and over and taken away at the end."""
    stream = Terminal()
    line = ProgressLine(stream)
    for step in range(4):
        clock[0] = 100.0 + step / 5
        line.show(Progress("trace", step, 3))
    line.clear()
    assert "\n" not in stream.getvalue()
    assert stream.getvalue().endswith("\r\x1b[K")
    assert stream.getvalue().count("trace") == 3


def steps(log: list[str], *stages: str) -> Generator[Progress, None, int]:
    """A bake of the given stages that notes how it ends."""
    try:
        for stage in stages:
            yield Progress(stage, 0, 0)
        log.append("finished")
        return 42
    except GeneratorExit:
        log.append("closed")
        raise


def test_the_value_comes_back() -> None:
    """A finished bake gives its outcome, and the signal handler is as before."""
    before = signal.getsignal(signal.SIGINT)
    assert drive(steps([], "load", "trace"), ProgressLine(io.StringIO())) == 42
    assert signal.getsignal(signal.SIGINT) is before


def test_an_error_passes_through() -> None:
    """What goes wrong in the bake is not swallowed."""

    def broken() -> Generator[Progress, None, int]:
        yield Progress("trace", 0, 0)
        raise DeviceError("gone")

    with pytest.raises(DeviceError):
        drive(broken(), ProgressLine(io.StringIO()))


@pytest.mark.skipif(os.name == "nt", reason="needs signals")
def test_ctrl_c_closes_the_bake() -> None:
    """Ctrl+C takes effect at the next sign of life, and cleans up."""
    log: list[str] = []

    def interrupted() -> Generator[Progress, None, int]:
        yield Progress("load", 0, 0)
        os.kill(os.getpid(), signal.SIGINT)
        return (yield from steps(log, "trace", "solve"))

    with pytest.raises(Cancelled):
        drive(interrupted(), ProgressLine(io.StringIO()))
    assert log == ["closed"]


@pytest.mark.skipif(os.name == "nt", reason="needs signals")
def test_ctrl_c_while_storing_is_too_late() -> None:
    """A result that is already being stored is stored."""
    log: list[str] = []

    def interrupted() -> Generator[Progress, None, int]:
        yield Progress("store", 0, 0)
        os.kill(os.getpid(), signal.SIGINT)
        return (yield from steps(log, "store"))

    assert drive(interrupted(), ProgressLine(io.StringIO())) == 42
    assert log == ["finished"]
