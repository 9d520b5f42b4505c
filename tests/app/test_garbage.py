"""The garbage collector looks at what is new, and what a process sets aside is bounded."""

from __future__ import annotations

import gc
from collections.abc import Iterator

import pytest

from app import garbage


@pytest.fixture
def collector(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """As if no window had been made, and as it was afterwards."""
    monkeypatch.setattr(garbage, "_done", 0)
    thresholds = gc.get_threshold()
    yield
    gc.unfreeze()
    gc.set_threshold(*thresholds)


@pytest.mark.usefixtures("collector")
def test_what_is_there_is_set_aside_twice_at_most() -> None:
    """After that all that comes is collected as ever, however many windows are made."""
    gc.unfreeze()
    garbage.set_aside()
    aside = gc.get_freeze_count()
    assert aside > 0
    kept = [[number] for number in range(1000)]
    garbage.set_aside()
    assert gc.get_freeze_count() >= aside + len(kept)
    more = [[number] for number in range(1000)]
    before = gc.get_freeze_count()
    garbage.set_aside()
    assert gc.get_freeze_count() <= before
    assert len(more) == len(kept)
