"""Objects that the side file moves, turns, scales, copies and takes away."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bake.errors import SceneError
from bake.scene import flatten, load_scene
from bake.scene.content_hash import ContentHasher
from bake.scene.object_keys import check_keys
from bake.scene.placing import placed, rotation, rotation_degrees
from bake.scene.side_file_writer import apply_edit, edit_side_file, set_object_keys
from bake.settings import BakeSettings
from bake.types import Placing, Role, Scene
from tests.scene.glb_files import one_quad

ANGLES = st.floats(-180.0, 180.0)


@pytest.fixture
def level(tmp_path: Path) -> Path:
    """A level of two quads: `floor` at the origin and `Props/sign`, moved, turned and scaled by its node."""
    file = one_quad()
    file.document["nodes"][0]["name"] = "floor"
    turned = [0.0, 0.0, 0.7071067811865476, 0.7071067811865476]  # 90 degrees about z
    sign = file.node("sign", root=False, mesh=0, translation=[10.0, 0.0, 5.0], rotation=turned, scale=[2.0, 1.0, 1.0])
    file.node("Props", children=[sign])
    return file.write(tmp_path)


def _by_path(scene: Scene) -> dict[str, np.ndarray]:
    return {
        item.path: scene.meshes[item.mesh].positions @ item.transform[:3, :3].T + item.transform[:3, 3]
        for item in scene.objects
    }


def test_translation_moves_one_object(level: Path) -> None:
    """What is moved lies elsewhere by so many metres, the rest where it was, to the bit."""
    before = _by_path(load_scene(level))
    set_object_keys(level, "Props/sign", {"translate": [1.0, 2.0, -3.0]})
    after = _by_path(load_scene(level))
    np.testing.assert_allclose(after["Props/sign"] - before["Props/sign"], np.broadcast_to([1, 2, -3], (4, 3)))
    np.testing.assert_array_equal(after["floor"], before["floor"])


def test_turning_keeps_the_own_origin(level: Path) -> None:
    """A turn is about the node's place, by the world's axes; the scale goes along the object's own."""
    set_object_keys(level, "Props/sign", {"rotate": [0.0, 0.0, 90.0], "scale": [3.0, 1.0, 1.0]})
    scene = load_scene(level)
    corners = _by_path(scene)["Props/sign"]
    # Own x is 2 long in the file and points to +y there; three times that, turned on by 90 degrees, is 6 along -x.
    np.testing.assert_allclose(corners[:2], [[10, 0, 5], [4, 0, 5]], atol=1e-12)
    assert scene.objects[1].placing is not None
    assert scene.objects[1].placing.origin == (10.0, 0.0, 5.0)


def test_files_without_nodes_turn_about_the_middle(tmp_path: Path) -> None:
    """An OBJ's objects have no place of their own, so the centre of the box stays."""
    path = tmp_path / "level.obj"
    path.write_text("o sign\nv 10 0 0\nv 12 0 0\nv 12 0 4\nv 10 0 4\nf 1 2 3 4\n")
    set_object_keys(path, "sign", {"rotate": [0.0, 180.0, 0.0], "translate": [0.0, 5.0, 0.0]})
    corners = _by_path(load_scene(path))["sign"]
    np.testing.assert_allclose(corners.mean(axis=0), [11, 5, 2])
    np.testing.assert_allclose(corners[0], [12, 5, 4], atol=1e-12)


def test_the_content_hash_covers_the_place(level: Path) -> None:
    """A moved object is stale; taken back to the byte, it is not."""

    def hashes() -> dict[str, str]:
        scene = load_scene(level)
        return {item.path: ContentHasher(scene).object_hash(item) for item in scene.objects}

    before = hashes()
    edit = set_object_keys(level, "Props/sign", {"translate": [0.0, 0.0, 0.001]})
    moved = hashes()
    assert moved["Props/sign"] != before["Props/sign"]
    assert moved["floor"] == before["floor"]
    apply_edit(edit.reversed())
    assert hashes() == before


def test_a_copy_is_an_object_of_its_own(level: Path) -> None:
    """It begins where the file has the original, stands last, and is told apart by its path."""
    before = load_scene(level)
    set_object_keys(level, "Props/sign", {"translate": [0.0, 9.0, 0.0], "role": "ignore"})
    edit_side_file(level, {}, copies=[{"of": "Props/sign", "name": "sign_copy", "translate": [1.0, 0.0, 0.0]}])
    scene = load_scene(level)
    assert [item.path for item in scene.objects] == ["floor", "Props/sign", "Props/sign_copy"]
    copy = scene.objects[2]
    assert (copy.role, copy.copy_of, copy.node) == (Role.STATIC, "Props/sign", -1)
    np.testing.assert_array_equal(copy.transform[:3, 3], before.objects[1].transform[:3, 3] + [1.0, 0.0, 0.0])
    assert flatten(scene, BakeSettings()).object_count == 3


def test_a_copy_of_a_copy_and_rules_for_it(level: Path) -> None:
    """Copies may be copied, and patterns match them as they match every object."""
    copies = [{"of": "Props/sign", "name": "b"}, {"of": "Props/b", "name": "c", "role": "blocker"}]
    edit_side_file(level, {"Props/*": {"offset": 0.5}}, copies=copies)
    scene = load_scene(level)
    assert [item.path for item in scene.objects][2:] == ["Props/b", "Props/c"]
    assert [item.keys.offset for item in scene.objects] == [None, 0.5, 0.5, 0.5]
    assert scene.objects[3].role is Role.BLOCKER
    np.testing.assert_array_equal(scene.objects[3].transform, scene.objects[1].transform)


def test_edits_of_a_copy_go_where_it_is_made(level: Path) -> None:
    """Its own keys win over rules, and are the ones that an edit changes."""
    edit_side_file(level, {"Props/*": {"role": "tree"}}, copies=[{"of": "Props/sign", "name": "b", "role": "static"}])
    assert load_scene(level).objects[2].role is Role.STATIC
    edit = set_object_keys(level, "Props/b", {"role": "small", "translate": [0.0, 1.0, 0.0]})
    assert edit.after is not None
    assert edit.after.count(b"[[object]]") == 1
    copy = load_scene(level).objects[2]
    assert copy.role is Role.SMALL
    assert copy.placing is not None
    assert copy.placing.translate == (0.0, 1.0, 0.0)


def test_a_copy_is_taken_away_with_what_is_said_of_it(level: Path) -> None:
    """Its table goes, and the rules of exactly its path; what was there before stays to the byte."""
    first = edit_side_file(level, {"Props/sign": {"offset": 0.1}})
    edit_side_file(level, {"Props/b": {"offset": 0.2}}, copies=[{"of": "Props/sign", "name": "b"}])
    edit_side_file(level, {}, without=["Props/b"])
    assert first.after is not None
    assert first.path.read_bytes().rstrip() == first.after.rstrip()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[[copy]]\nof = "Props/sing"\nname = "b"\n', ["Props/sing", "Props/sign"]),
        ('[[copy]]\nof = "Props/sign"\nname = "sign"\n', ["Props/sign", "another name"]),
        ('[[copy]]\nof = "Props/sign"\nname = "a/b"\n', ["name"]),
        ('[[copy]]\nname = "b"\n', ["of"]),
        ('[[copy]]\nof = "Props/sign"\nname = "b"\nmove = 1\n', ["move"]),
        ('[[object]]\nmatch = "floor"\ntranslat = [0, 0, 1]\n', ["translate"]),
    ],
)
def test_copies_that_make_no_sense_are_refused(level: Path, text: str, words: list[str]) -> None:
    """The message names the table and what is wrong with it."""
    level.with_name(level.name + ".obscura.toml").write_text(text)
    with pytest.raises(SceneError) as caught:
        load_scene(level)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("translate", [1, 2]), ("translate", [1, 2, "3"]), ("translate", 1.0), ("translate", [0, 0, 1e10]),
        ("translate", [0, 0, float("nan")]), ("rotate", [True, 0, 0]), ("rotate", {"x": 1}), ("scale", 0),
        ("scale", -1.0), ("scale", [1, 1, 0]), ("scale", [1]), ("scale", float("inf")), ("scale", "2"),
    ],
)  # fmt: skip
def test_places_that_are_none_are_refused(name: str, value: object) -> None:
    """Three finite numbers within bounds, or one positive scale; all else is named."""
    with pytest.raises(SceneError, match=name):
        check_keys({name: value}, "here")


def test_one_factor_scales_all_axes() -> None:
    """A single number stands for three."""
    assert check_keys({"scale": 2, "rotate": [0, 90, 0]}, "here") == {"scale": (2.0, 2.0, 2.0), "rotate": (0, 90, 0)}


@given(st.tuples(ANGLES, ANGLES, ANGLES))
def test_angles_say_the_same_turn(angles: tuple[float, float, float]) -> None:
    """A turn read back as angles is the same turn, also where two axes coincide."""
    turn = rotation(angles)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(rotation(rotation_degrees(turn)), turn, atol=1e-6)


@given(st.tuples(ANGLES, ANGLES, ANGLES), st.floats(0.1, 10.0))
def test_the_pivot_goes_where_it_is_told(angles: tuple[float, float, float], scale: float) -> None:
    """The own origin only moves by `translate`, whatever the turn and the scale."""
    transform = np.eye(4)
    transform[:3, :3] = rotation((30.0, 40.0, 50.0)) * [1.0, 2.0, 0.5]
    transform[:3, 3] = (100.0, -20.0, 3.0)
    inside = np.array((0.5, 1.0, -2.0))
    pivot = tuple((transform[:3, :3] @ inside + transform[:3, 3]).tolist())
    placing = Placing((1.0, 2.0, 3.0), angles, (scale, 1.0, 1.0), pivot)
    result = placed(transform, placing)
    np.testing.assert_allclose(result[:3, :3] @ inside + result[:3, 3], placing.origin, atol=1e-9)


def test_nothing_said_is_nothing_changed() -> None:
    """Without keys, the transform is the file's own, to the bit."""
    transform = np.random.default_rng(1).normal(size=(4, 4))
    assert placed(transform, Placing(pivot=(1.0, 2.0, 3.0))) is transform
