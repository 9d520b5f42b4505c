from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.scene.glb_files import GltfFile, one_quad

Run = Callable[..., tuple[int, str, str]]
SIDE_FILE = "# by hand\n[bake]\ndistances = [0.5, 5.0]\n[[object]]\nmatch = 'lid'\ntwo_sided = true\n"


def covered_quad() -> GltfFile:
    """A square and, half a millimetre above, another one."""
    file = one_quad()
    file.document["nodes"][0]["name"] = "floor"
    file.node("lid", mesh=0, translation=[0.0, 0.0, 5e-4])
    return file


@pytest.fixture
def baked(run: Run, tmp_path: Path) -> Path:
    """A result whose scene has a side file."""
    scene = covered_quad().write(tmp_path)
    (tmp_path / "level.obscura.toml").write_text(SIDE_FILE)
    result = tmp_path / "result"
    assert run("bake", scene, "-o", result, "--device", "cpu", "--rays", "16")[0] == 0
    return result


def test_spots_are_listed(run: Run, baked: Path) -> None:
    """As a table, and as JSON with every field."""
    code, text, _ = run("spots", baked)
    assert code == 0
    assert "suspicious spots, AO at 0.5 m" in text
    assert all(row["seen"] is None for row in json.loads(run("spots", baked, "--json")[1])["spots"])
    code, text, _ = run("spots", baked, "--distance", "5", "--look", "--measure", "2", "--json")
    listed = json.loads(text)
    assert code == 0
    assert listed["distance"] == 5.0
    assert listed["found"] == len(listed["spots"])
    for row in listed["spots"]:
        assert row["vertex"].startswith(row["object"] + ":")
        assert 0.0 <= row["severity"] <= 1.0
        assert 0.0 <= row["seen"] <= 1.0


def test_spots_are_filtered(run: Run, baked: Path) -> None:
    """By object and by cause."""
    assert json.loads(run("spots", baked, "--object", "nowhere*", "--json")[1])["spots"] == []
    code, _, error = run("spots", baked, "--cause", "gremlins")
    assert code == 2
    assert "gremlins" in error
    assert run("spots", baked, "--distance", "-1")[0] == 2


def test_a_remedy_is_previewed_and_applied(run: Run, baked: Path) -> None:
    """What is offered has a value after; applying one writes the side file and keeps what was there."""
    code, text, _ = run("remedy", baked, "--vertex", "floor:0", "--json")
    assert code == 0
    first = json.loads(text)["remedies"][0]
    assert first["cause"] == "coplanar-twin"
    assert first["remedy"]["objects"] == {"lid": {"role": "receiver"}}
    assert first["after"] == pytest.approx([1.0, 1.0], abs=1e-3)
    code, text, _ = run("remedy", baked, "--vertex", "floor:0", "--apply", 1)
    assert code == 0
    side_file = baked.parent / "level.obscura.toml"
    assert side_file.read_text() == SIDE_FILE + 'role = "receiver"\n'
    code, _, error = run("remedy", baked, "--vertex", "floor:0")
    assert code == 2
    assert "has changed since it was baked" in error


def test_a_remedy_that_is_not_offered(run: Run, baked: Path) -> None:
    """One line, and nothing is written."""
    code, _, error = run("remedy", baked, "--vertex", "floor:0", "--apply", 99)
    assert code == 2
    assert "no remedy 99" in error
    assert (baked.parent / "level.obscura.toml").read_text() == SIDE_FILE
