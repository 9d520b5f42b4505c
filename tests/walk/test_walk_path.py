"""Paths: by arc length, in pieces, and from files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bake.errors import InputError, SettingsError
from bake.walk import WalkOptions, path_in_pieces, path_through
from bake.walk.frames import frames_along
from bake.walk.path_file import read_path

NOWHERE = np.zeros(3)
BROKEN_FILES = {
    "a.json": "{",
    "b.json": '{"points": 3}',
    "c.json": "[[0, 0, 0], [1, 2]]",
    "d.json": '[[0, 0, 0], ["a", 1, 2]]',
    "e.json": "[[0, 0, 0], [1e999, 1, 2]]",
    "f.json": "[[1, 1, 1], [1, 1, 1]]",
    "g.json": "[]",
    "h.json": "[" * 100_000,
    "i.csv": "0,0,0\n1,1\n",
    "j.csv": "",
    "k.csv": "0,0,0\nnan,1,1\n",
    "l.json": '{"pieces": [[]]}',
    "m.json": "[[0, 0, 0], [true, 1, 2]]",
}


@settings(max_examples=30, deadline=None)
@given(
    st.lists(st.tuples(*[st.floats(-50, 50)] * 3), min_size=2, max_size=12),
    st.floats(0.2, 6.0),
    st.sampled_from([30.0, 60.0, 144.0]),
)
def test_frames_are_evenly_spaced(points: list[tuple[float, float, float]], speed: float, rate: float) -> None:
    """No frame is farther from the one before than the speed allows, and on straight parts none is nearer."""
    try:
        path = path_through(points)
    except InputError:
        assert len({*points}) == 1 or np.ptp(np.array(points), axis=0).max() < 1e-9
        return
    frames = frames_along(path, speed=speed, frame_rate=rate)
    moved = np.linalg.norm(np.diff(frames.position, axis=0), axis=1)
    assert (moved <= speed / rate * (1 + 1e-9) + 1e-9).all()
    assert np.allclose(frames.distance, np.arange(len(frames)) * speed / rate)
    assert np.allclose(frames.position[0], path.points[0])
    assert path.length - frames.distance[-1] < speed / rate + 1e-9


def test_a_teleport_takes_no_time() -> None:
    """The first frame of a new piece follows the last of the old one, and is marked."""
    path = path_in_pieces([[[0, 0, 0], [1, 0, 0]], [[50, 0, 0], [52, 0, 0]]])
    frames = frames_along(path, speed=1.0, frame_rate=4.0)
    assert path.length == 3.0
    assert len(frames) == 13
    assert np.flatnonzero(frames.teleported).tolist() == [0, 4]
    assert frames.position[:, 0].tolist() == [0, 0.25, 0.5, 0.75, 50, 50.25, 50.5, 50.75, 51, 51.25, 51.5, 51.75, 52]


def test_too_many_frames_are_refused() -> None:
    """A path across a planet ends in one clear line."""
    with pytest.raises(InputError, match="frames"):
        frames_along(path_through([[0, 0, 0], [1e9, 0, 0]]), speed=1.5, frame_rate=60.0)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.json", "[[11, 2, 3], [12, 2, 3], [12, 2, 4]]"),
        ("b.json", '{"points": [[11, 2, 3], [12, 2, 3], [12, 2, 4]]}'),
        ("c.csv", "11,2,3\n12, 2, 3\n12,2,4\n"),
        ("d.csv", "time_s,x,y,z,region\n0,11,2,3,a\n1,12,2,3,a\n2,12,2,4,b\n"),
    ],
)
def test_paths_from_files(tmp_path: Path, name: str, text: str) -> None:
    """JSON and CSV say the same path, in world metres."""
    (tmp_path / name).write_text(text)
    path = read_path(tmp_path / name, origin=np.array([10.0, 0.0, 0.0]))
    assert path.points.tolist() == [[1, 2, 3], [2, 2, 3], [2, 2, 4]]
    assert path.distance.tolist() == [0, 1, 2]


def test_pieces_from_files(tmp_path: Path) -> None:
    """Pieces of JSON and empty lines of CSV are teleports."""
    (tmp_path / "a.json").write_text('{"pieces": [[[0, 0, 0], [1, 0, 0]], [[5, 0, 0], [6, 0, 0]]]}')
    (tmp_path / "b.csv").write_text("0,0,0\n1,0,0\n\n\n5,0,0\n6,0,0\n\n")
    for name in ("a.json", "b.csv"):
        path = read_path(tmp_path / name, origin=NOWHERE)
        assert path.piece.tolist() == [0, 0, 1, 1]
        assert path.length == 2.0


@pytest.mark.parametrize("name", sorted(BROKEN_FILES))
def test_broken_files_are_refused(tmp_path: Path, name: str) -> None:
    """What is no path ends in one line that names the file."""
    (tmp_path / name).write_text(BROKEN_FILES[name])
    with pytest.raises(InputError) as caught:
        read_path(tmp_path / name, origin=NOWHERE)
    assert name in str(caught.value)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    """A path that is not there is named."""
    with pytest.raises(InputError, match=r"nowhere\.json"):
        read_path(tmp_path / "nowhere.json", origin=NOWHERE)


@pytest.mark.parametrize(
    "wrong",
    [{"speed": 0.0}, {"speed": float("nan")}, {"frame_rate": 0.5}, {"half_life": -1.0}, {"normal": (0.0, 0.0, 0.0)}],
)
def test_options_have_bounds(wrong: dict[str, float]) -> None:
    """An option that makes no sense is refused by its name."""
    with pytest.raises(SettingsError, match="--"):
        WalkOptions(**wrong)
