"""Decorators are stored with the result: every part that there is, and none that there is not."""

from __future__ import annotations

import dataclasses
import json
import tempfile
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_results import build_decorators, build_result, same_results

from bake.decorator_types import Decorators
from bake.errors import ResultError
from bake.results import is_current, load_result, save_result
from bake.results.manifest import _checksum
from bake.types import BakeResult

PARTS = tuple(item.name for item in dataclasses.fields(Decorators))


@st.composite
def decorated_results(draw: st.DrawFn) -> BakeResult:
    """Any selection of parts, one to five distances, several models of any size."""
    count = draw(st.integers(1, 5))
    result = build_result(seed=draw(st.integers(0, 99)), distances=tuple(float(i + 1) for i in range(count)))
    sizes = tuple(draw(st.lists(st.integers(0, 6), min_size=1, max_size=3)))
    trees = tuple(draw(st.lists(st.integers(0, 2), max_size=4)))
    decorators = build_decorators(result, trees=trees, model_sizes=sizes)
    left_out = draw(st.sets(st.sampled_from(PARTS)))
    if "models" in left_out:
        left_out |= {"fits"}
    empty = {name: () if name == "models" else None for name in left_out}
    return dataclasses.replace(result, decorators=dataclasses.replace(decorators, **empty))


@settings(max_examples=20, deadline=None)
@given(decorated_results())
def test_any_parts_round_trip(result: BakeResult) -> None:
    """What is stored comes back bit by bit, and parts that are None stay None."""
    with tempfile.TemporaryDirectory() as folder:
        save_result(result, Path(folder))
        assert same_results(load_result(Path(folder)), result)


def test_without_decorators_nothing_is_stored(tmp_path: Path, result: BakeResult) -> None:
    """None, and decorators without any part, are told apart."""
    for name, decorators in {"none": None, "empty": Decorators()}.items():
        saved = dataclasses.replace(result, decorators=decorators)
        save_result(saved, tmp_path / name)
        assert same_results(load_result(tmp_path / name), saved)
        assert not list((tmp_path / name).glob("fog_*"))


def test_arrays_of_decorators_go_with_them(tmp_path: Path, result: BakeResult) -> None:
    """A result without decorators that replaces one with them leaves none of their files behind."""
    save_result(dataclasses.replace(result, decorators=build_decorators(result)), tmp_path)
    assert list(tmp_path.glob("volume_sh-*.npy"))
    save_result(result, tmp_path)
    assert not list(tmp_path.glob("volume_*.npy"))
    assert load_result(tmp_path).decorators is None


def test_a_damaged_part_is_named(tmp_path: Path, result: BakeResult) -> None:
    """Damage of a decorator's array is noticed like that of any other."""
    save_result(dataclasses.replace(result, decorators=build_decorators(result)), tmp_path)
    path = next(tmp_path.glob("fits_coefficients-*.npy"))
    path.write_bytes(path.read_bytes()[:-4])
    with pytest.raises(ResultError, match="fits_coefficients"):
        load_result(tmp_path)


@pytest.mark.parametrize("part", ["fits", "small_scalars", "fog"])
def test_parts_that_do_not_fit_are_refused(tmp_path: Path, result: BakeResult, part: str) -> None:
    """An object that the world does not have is never indexed with."""
    decorators = build_decorators(result)
    wrong = dataclasses.replace(getattr(decorators, part), object=getattr(decorators, part).object + 99)
    decorators = dataclasses.replace(decorators, **{part: wrong})
    save_result(dataclasses.replace(result, decorators=decorators), tmp_path)
    with pytest.raises(ResultError, match="do not fit"):
        load_result(tmp_path)


def test_results_of_the_former_schema_still_load(tmp_path: Path, result: BakeResult) -> None:
    """They had no decorators; they are read as such, but a bake does not take them for its own."""
    save_result(result, tmp_path)
    path = tmp_path / "manifest.json"
    content = json.loads(path.read_text())
    del content["decorators"], content["checksum"]
    content["schema"] = 1
    content["checksum"] = _checksum(content)
    inputs = {"files": result.files, "settings": result.settings, "versions": result.versions}
    assert is_current(tmp_path, **inputs, device="cpu", tracer="embree")
    path.write_text(json.dumps(content))
    assert same_results(load_result(tmp_path), result)
    assert not is_current(tmp_path, **inputs, device="cpu", tracer="embree")
