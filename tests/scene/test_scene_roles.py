from __future__ import annotations

from pathlib import Path

import pytest

from bake.errors import SceneError
from bake.scene import hash_files, load_scene, read_bake_options
from bake.types import RegionBox, Role
from tests.scene.glb_files import GltfFile, one_quad


def forest() -> GltfFile:
    """Objects `ground`, `Level/Trees/oak#1`, `Level/Trees/oak#2`, `Level/Trees/fir` and `Level/House [old]`."""
    file = one_quad()
    file.document["nodes"][0]["name"] = "ground"
    trees = [file.node(name, root=False, mesh=0) for name in ("oak", "oak", "fir")]
    house = file.node("House [old]", root=False, mesh=0)
    file.node("Level", children=[file.node("Trees", root=False, children=trees), house])
    return file


def load(folder: Path, side_file: str, file: GltfFile | None = None):
    """Loads the forest with a side file."""
    (folder / "level.obscura.toml").write_text(side_file, encoding="utf-8")
    return load_scene((file or forest()).write(folder))


def roles(scene) -> dict[str, Role]:
    """Roles by path."""
    return {item.path: item.role for item in scene.objects}


def test_patterns_match_paths(tmp_path: Path) -> None:
    """A glob matches numbered and unnumbered paths, and `*` crosses slashes."""
    scene = load(tmp_path, '[[object]]\nmatch = "Level/Trees/*"\nrole = "tree"\ntransmission = 0.25\n')
    assert [path for path, role in roles(scene).items() if role is Role.TREE] == [
        "Level/Trees/oak#1",
        "Level/Trees/oak#2",
        "Level/Trees/fir",
    ]
    assert scene.objects[1].keys.transmission == 0.25


@pytest.mark.parametrize(
    ("pattern", "count"),
    [("Level/Trees/oak", 2), ("Level/Trees/oak#2", 1), ("*", 5), ("Level/House [old]", 1), ("*/fi?", 1)],
)
def test_pattern_forms(tmp_path: Path, pattern: str, count: int) -> None:
    """A path without its number stands for all repeats, and brackets in names match literally."""
    scene = load(tmp_path, f'[[object]]\nmatch = "{pattern}"\nrole = "ignore"\n')
    assert sum(role is Role.IGNORE for role in roles(scene).values()) == count


def test_later_rules_win_key_by_key(tmp_path: Path) -> None:
    """A later rule overrides what it says and leaves the rest."""
    scene = load(
        tmp_path,
        '[[object]]\nmatch = "*"\nrole = "blocker"\noffset = 0.5\n[[object]]\nmatch = "ground"\nrole = "receiver"\n',
    )
    assert scene.objects[0].role is Role.RECEIVER
    assert scene.objects[0].keys.offset == 0.5
    assert scene.objects[1].role is Role.BLOCKER


def test_side_file_wins_over_extras(tmp_path: Path) -> None:
    """What the side file says beats what the scene file says."""
    file = forest()
    file.document["nodes"][0]["extras"] = {"obscura": {"role": "tree", "samples": 9}}
    scene = load(tmp_path, '[[object]]\nmatch = "ground"\nrole = "static"\n', file)
    assert scene.objects[0].role is Role.STATIC
    assert scene.objects[0].keys.samples == 9


def test_a_pattern_without_match_is_a_finding(tmp_path: Path) -> None:
    """A pattern that matches nothing is reported with the side file's name."""
    findings = load(tmp_path, '[[object]]\nmatch = "Nowhere/*"\nrole = "tree"\n').findings
    assert [(f.object, f.what) for f in findings] == [("level.obscura.toml", "pattern-without-match")]


def test_all_keys_are_read(tmp_path: Path) -> None:
    """Every key of the contract reaches the object."""
    scene = load(
        tmp_path,
        '[[object]]\nmatch = "ground"\nrole = "lod"\nof = "Level/Trees"\ntwo_sided = true\noffset = 0.1\nsamples = 3\n'
        "alpha = 0.5\ndensity = 2\ntransmission = 1\nweld = false\n",
    )
    keys = scene.objects[0].keys
    assert (keys.of, keys.two_sided, keys.offset, keys.samples) == ("Level/Trees", True, 0.1, 3)
    assert (keys.alpha, keys.density, keys.transmission, keys.weld) == (0.5, 2.0, 1.0, False)


def test_bake_options_and_regions(tmp_path: Path) -> None:
    """The bake table is handed on as it is, and regions become boxes."""
    text = '[bake]\ndistances = [1.0, 50.0]\n[[region]]\nname = "hall"\nmin = [0, 0, 0]\nmax = [8, 3.5, 12]\n'
    scene = load(tmp_path, text)
    assert scene.bake_options == {"distances": [1.0, 50.0]}
    assert scene.regions == (RegionBox("hall", (0.0, 0.0, 0.0), (8.0, 3.5, 12.0)),)
    assert read_bake_options(scene.path) == ({"distances": [1.0, 50.0]}, "level.obscura.toml")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[[object]]\nmatch = "*"\nrole = "tre"', "unknown role 'tre'.*did you mean 'tree'"),
        ('[[object]]\nmatch = "*"\nrole = 5', "unknown role 5"),
        ('[[object]]\nmatch = "*"\ntwosided = true', "unknown key 'twosided'.*did you mean 'two_sided'"),
        ('[[object]]\nrole = "tree"', "no match"),
        ('[[object]]\nmatch = "*"\nsamples = 0', "samples is '0'"),
        ('[[object]]\nmatch = "*"\ntransmission = 1.5', "transmission is '1.5'.*from 0 to 1"),
        ('[[object]]\nmatch = "*"\ntwo_sided = 1', "two_sided is '1'.*true or false"),
        ('[[object]]\nmatch = "*"\noffset = nan', "offset is 'nan'"),
        (f'[[object]]\nmatch = "*"\noffset = 1{"0" * 400}', "offset is"),
        ('[[object]]\nmatch = "*"\nrole = "lod"', "nothing says of what"),
        ('[[object]]\nmatch = "ground"\nrole = "lod"\nof = "Level/Treees"', "does not exist"),
        ('[objects]\nmatch = "*"', "unknown table.*did you mean 'object'"),
        ('[object]\nmatch = "*"', r"no list of tables.*\[\[object\]\]"),
        ("bake = 3", "bake is no table"),
        ("[[region]]\nname = 'a'\nmin = [0, 0]\nmax = [1, 1, 1]", "min is"),
        ("[[region]]\nname = 'a'\nmin = [0, 0, 2]\nmax = [1, 1, 1]", "not below max"),
        ("[[region]]\nmin = [0, 0, 0]\nmax = [1, 1, 1]", "no name"),
        ("[[region]]\nname = 'a'\nmaximum = [1, 1, 1]", "unknown key 'maximum'"),
        ("[[region]]\nname='a'\nmin=[0,0,0]\nmax=[1,1,1]\n[[region]]\nname='a'\nmin=[0,0,0]\nmax=[1,1,1]", "second"),
        ("role = ", "no TOML"),
    ],
)
def test_wrong_side_files_are_refused(tmp_path: Path, text: str, message: str) -> None:
    """Every mistake in a side file is one line that names the file and the remedy."""
    with pytest.raises(SceneError, match=message) as caught:
        load(tmp_path, text)
    assert "level.obscura.toml" in str(caught.value) or "Level" in str(caught.value) or "ground" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("extras", [{"obscura": {"rôle": "tree"}}, {"obscura": {"role": "treee"}}, {"obscura": "tree"}])
def test_wrong_extras_are_refused(tmp_path: Path, extras: dict) -> None:
    """Extras with an unknown key or role are refused by node path."""
    file = one_quad(extras=extras)
    with pytest.raises(SceneError, match="quad"):
        load_scene(file.write(tmp_path))


def test_other_extras_are_none_of_our_business(tmp_path: Path) -> None:
    """Extras of other tools, of any type, are left alone."""
    for extras in (5, "text", [1], {"blender": {"role": "x"}}):
        assert load_scene(one_quad(extras=extras).write(tmp_path)).objects[0].role is Role.STATIC


def test_two_side_files_are_ambiguous(tmp_path: Path) -> None:
    """Both spellings of the side file's name are read, but not both at once."""
    path = one_quad().write(tmp_path)
    (tmp_path / "level.glb.obscura.toml").write_text('[[object]]\nmatch = "*"\nrole = "ignore"\n')
    assert load_scene(path).objects[0].role is Role.IGNORE
    (tmp_path / "level.obscura.toml").write_text("")
    with pytest.raises(SceneError, match="two side files"):
        load_scene(path)


def test_files_tell_a_changed_scene(tmp_path: Path) -> None:
    """Hashes are equal exactly while no file changes, appears or vanishes."""
    path = one_quad().write(tmp_path)
    scene = load_scene(path)
    assert hash_files(path, scene.files) == scene.files
    (tmp_path / "level.obscura.toml").write_text("")
    assert hash_files(path, scene.files) != scene.files
    (tmp_path / "level.obscura.toml").unlink()
    path.write_bytes(path.read_bytes() + b"\0")
    assert hash_files(path, scene.files) != scene.files
    path.unlink()
    assert hash_files(path, scene.files)["level.glb"] == ""
