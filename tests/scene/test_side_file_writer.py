"""Edits of side files: what is asked for changes, nothing else does."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bake.errors import SceneError, SettingsError, StorageError
from bake.scene.side_file_writer import apply_edit, edit_side_file, plan_edit, set_object_keys
from bake.scene.toml_text import statements, toml_value

SCENE = "level.glb"
TEXT = """# Lighting, please ask before you change this.
[bake]
distances = [
    2.0,   # near
    300.0, # far
]
alpha = 0.1

[[object]]   # all trees
match = "Level/Trees/*"
role = "tree"      # they let light through
transmission = 0.6

  [[object]]
  match = 'Level/"odd" # name = [x]'
  role = "small"

[[object]]
match = "Level/Wall"
role = "blocker"

[[region]]
name = "hall"
min = [0, 0, 0]
max = [8, 3, 12]
# the end
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """A scene with a side file; its geometry is of no matter here."""
    (tmp_path / "level.obscura.toml").write_text(TEXT)
    return tmp_path / SCENE


def _lines(text: str) -> list[str]:
    return text.splitlines()


def test_a_value_is_replaced_in_its_line(scene: Path) -> None:
    """Only the value changes; the comment behind it and all other lines stay."""
    edit = set_object_keys(scene, "Level/Trees/*", {"role": "shrub", "transmission": None, "density": 0.25})
    assert edit.path.name == "level.obscura.toml"
    assert edit.path.read_bytes() == edit.after
    before, after = _lines(TEXT), _lines(edit.path.read_text())
    assert after[10] == 'role = "shrub"      # they let light through'
    assert after[11] == "density = 0.25"
    assert before[:10] == after[:10]
    assert before[12:] == after[12:]


def test_an_edit_is_taken_back_to_the_byte(scene: Path) -> None:
    """Its reverse restores the file as it was."""
    edit = edit_side_file(
        scene, {"Level/Wall": {"role": None}, "Level/New": {"weld": False}}, {"alpha": None, "rays": 9}
    )
    assert tomllib.loads(edit.path.read_text())["bake"] == {"distances": [2.0, 300.0], "rays": 9}
    assert "Level/Wall" not in edit.path.read_text()
    apply_edit(edit.reversed())
    assert edit.path.read_text() == TEXT


def test_a_foreign_change_is_not_overwritten(scene: Path) -> None:
    """An edit that was planned before somebody else wrote is refused."""
    edit = plan_edit(scene, {"Level/Wall": {"role": "receiver"}})
    edit.path.write_text(TEXT + "# mine\n")
    with pytest.raises(StorageError, match="another program"):
        apply_edit(edit)
    assert edit.path.read_text().endswith("# mine\n")


def test_the_first_key_makes_the_file_and_undo_removes_it(tmp_path: Path) -> None:
    """Without a side file one is made for this scene alone."""
    edit = set_object_keys(tmp_path / SCENE, "Level/Wall#1", {"two_sided": True, "role": "static"})
    assert edit.path.name == "level.glb.obscura.toml"
    assert tomllib.loads(edit.path.read_text()) == {
        "object": [{"match": "Level/Wall#1", "two_sided": True, "role": "static"}]
    }
    apply_edit(edit.reversed())
    assert list(tmp_path.iterdir()) == []


def test_a_later_pattern_does_not_overrule_the_edit(scene: Path) -> None:
    """Where a glob further down says the same key, the new one goes behind it."""
    path = scene.with_name("level.obscura.toml")
    path.write_text(TEXT + '\n[[object]]\nmatch = "Level/W*"\nrole = "small"\n')
    set_object_keys(scene, "Level/Wall", {"role": "receiver"})
    assert tomllib.loads(path.read_text())["object"][-1] == {"match": "Level/Wall", "role": "receiver"}
    set_object_keys(scene, "Level/Wall", {"weld": True})
    assert tomllib.loads(path.read_text())["object"][-1] == {"match": "Level/Wall", "role": "receiver", "weld": True}


@pytest.mark.parametrize(
    ("objects", "bake", "error", "word"),
    [
        ({"a": {"rolle": "tree"}}, {}, SceneError, "role"),
        ({"a": {"role": "treee"}}, {}, SceneError, "tree"),
        ({"a": {"samples": 0}}, {}, SceneError, "4096"),
        ({}, {"alfa": 0.1}, SettingsError, "alpha"),
    ],
)
def test_what_no_side_file_may_say_is_refused(
    scene: Path, objects: dict[str, Any], bake: dict[str, Any], error: type[Exception], word: str
) -> None:
    """Unknown keys and values change nothing."""
    with pytest.raises(error, match=word):
        edit_side_file(scene, objects, bake)
    assert scene.with_name("level.obscura.toml").read_text() == TEXT


def test_a_form_that_cannot_be_edited_is_named(scene: Path) -> None:
    """Objects as an inline list are left alone, with a remedy."""
    path = scene.with_name("level.obscura.toml")
    path.write_text('object = [{match = "a", role = "tree"}]\n')
    with pytest.raises(SceneError, match=r"\[\[object\]\]"):
        set_object_keys(scene, "a", {"role": "small"})


def test_windows_line_ends_and_byte_order_mark_stay(scene: Path) -> None:
    """The file keeps its way of writing lines."""
    path = scene.with_name("level.obscura.toml")
    path.write_bytes(b"\xef\xbb\xbf" + b'[[object]]\r\nmatch = "a"\r\nrole = "tree"')
    set_object_keys(scene, "a", {"weld": True})
    assert path.read_bytes() == b'\xef\xbb\xbf[[object]]\r\nmatch = "a"\r\nrole = "tree"\r\nweld = true\r\n'


def test_statements_cover_keys_and_headers() -> None:
    """Strings, arrays and comments that look like statements are none."""
    found = [(item.table, item.key, item.is_header) for item in statements(TEXT)]
    assert found[:3] == [("bake", "", True), ("bake", "distances", False), ("bake", "alpha", False)]
    assert [table for table, _, is_header in found if is_header] == ["bake", "object", "object", "object", "region"]
    tricky = 'a = """\n[[object]]\nx = 1\n"""\n"b c" = { d = [1, "]"] } # e = 3\n[x."y.z"]\n'
    assert [(item.table, item.key) for item in statements(tricky)] == [("", "a"), ("", "b c"), ("x.y.z", "")]


_VALUES = st.one_of(
    st.fixed_dictionaries({}, optional={"role": st.sampled_from(["tree", "small", "static", None])}),
    st.fixed_dictionaries({"samples": st.one_of(st.none(), st.integers(1, 64))}),
    st.fixed_dictionaries({"weld": st.booleans(), "offset": st.one_of(st.none(), st.floats(0, 10))}),
)


@given(st.lists(st.tuples(st.text("abL/*#[]\"'\\é=\t", min_size=1, max_size=6), _VALUES), min_size=1, max_size=8))
def test_any_series_of_edits_says_what_was_asked(tmp_path_factory: Any, series: list[tuple[str, Any]]) -> None:
    """After each edit the last table of a match that has a key has the value set; comments never get lost."""
    folder = tmp_path_factory.mktemp("side")
    (folder / "level.obscura.toml").write_text(TEXT)
    edits = []
    for match, keys in series:
        edits.append(set_object_keys(folder / SCENE, match, keys))
        text = edits[-1].path.read_text()
        tables = tomllib.loads(text).get("object", [])
        for name, value in keys.items():
            said = [table[name] for table in tables if table["match"] == match and name in table]
            assert value is None or said[-1] == value
        assert all(comment in text for comment in ("# Lighting", "# near", "# all trees", "# the end"))
    for edit in reversed(edits):
        apply_edit(edit.reversed())
    assert (folder / "level.obscura.toml").read_text() == TEXT


@given(
    st.one_of(st.text(), st.booleans(), st.integers(-(2**62), 2**62), st.floats(allow_nan=False, allow_infinity=False))
)
def test_values_read_back(value: Any) -> None:
    """Whatever is written reads back as the same."""
    assert tomllib.loads(f"x = {toml_value(value)}")["x"] == value
