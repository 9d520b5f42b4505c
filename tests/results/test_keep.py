"""Results that are kept aside and put back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from synthetic_results import build_result

from bake.errors import ResultError, StorageError
from bake.results import is_result, keep_result, load_result, put_back, save_result, take_away
from bake.types import BakeResult


def _with_ao(value: float) -> BakeResult:
    result = build_result()
    return replace(result, field=replace(result.field, ao=np.full_like(result.field.ao, value)))


def _value(folder: Path) -> float:
    return float(load_result(folder, verify=True).field.ao[0, 0])


def test_results_go_back_and_forth(tmp_path: Path) -> None:
    """A kept result comes back whole after another was saved over it, and the other one after that."""
    folder, first, second = tmp_path / "result", tmp_path / "kept" / "a", tmp_path / "kept" / "b"
    save_result(_with_ao(0.25), folder)
    keep_result(folder, first)
    save_result(_with_ao(0.75), folder)
    keep_result(folder, second)
    for _ in range(2):
        put_back(first, folder)
        assert _value(folder) == 0.25
        put_back(second, folder)
        assert _value(folder) == 0.75
    assert len(list(folder.glob("field_ao-*"))) == 1
    assert _value(first) == 0.25


def test_the_first_bake_is_taken_away_and_comes_back(tmp_path: Path) -> None:
    """Where there was no result before, there is none afterwards."""
    folder = tmp_path / "result"
    save_result(_with_ao(0.5), folder)
    keep_result(folder, tmp_path / "kept")
    take_away(folder)
    assert not folder.exists()
    take_away(folder)
    put_back(tmp_path / "kept", folder)
    assert _value(folder) == 0.5


def test_only_results_are_kept_and_replaced(tmp_path: Path) -> None:
    """A folder of the user's is neither kept nor overwritten, and an earlier one is not kept over."""
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "notes.txt").write_text("mine")
    with pytest.raises(ResultError):
        keep_result(mine, tmp_path / "kept")
    assert not (tmp_path / "kept").exists()
    save_result(_with_ao(0.5), tmp_path / "result")
    keep_result(tmp_path / "result", tmp_path / "kept")
    with pytest.raises(StorageError):
        keep_result(tmp_path / "result", tmp_path / "kept")
    with pytest.raises(ResultError):
        put_back(tmp_path / "kept", mine)
    assert (mine / "notes.txt").read_text() == "mine"


def test_a_damaged_one_is_not_put_back(tmp_path: Path) -> None:
    """If a kept file is gone, the result in use stays."""
    folder, kept = tmp_path / "result", tmp_path / "kept"
    save_result(_with_ao(0.25), folder)
    keep_result(folder, kept)
    save_result(_with_ao(0.75), folder)
    next(kept.glob("field_ao-*")).unlink()
    with pytest.raises(ResultError, match="missing"):
        put_back(kept, folder)
    assert is_result(folder)
    assert _value(folder) == 0.75
