"""`explain RESULT` on a small baked scene."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from bake.results import load_result
from tests.commands.conftest import QUICK, Run


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A baked pair of boxes on a ground plane."""
    from app import cli

    folder = tmp_path_factory.mktemp("explain")
    scene = folder / "level.obj"
    lines: list[str] = []
    for number, (name, low, high) in enumerate((("floor", (-2, -1, -2), (2, 0, 2)), ("crate", (0, 0, 0), (1, 1, 1)))):
        lines.append(f"o {name}")
        corners = [(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
        lines += [f"v {x} {y} {z}" for x, y, z in corners]
        quads = ((1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4))
        lines += ["f " + " ".join(str(i + 8 * number) for i in quad) for quad in quads]
    scene.write_text("\n".join(lines) + "\n")
    words = ["bake", str(scene), "-o", str(folder / "result"), "--ground", "+y", *QUICK]
    assert cli.main(words) == 0
    return folder / "result"


def test_json_keeps_the_contract(run: Run, result: Path) -> None:
    """One object: value, shares that add up to 1 - value, samples and causes."""
    code, out, _ = run("explain", result, "--vertex", "floor:3", "--without", "crate", "--json")
    assert code == 0
    told = json.loads(out)
    stored = load_result(result)
    vertex = int(stored.world.first_vertex[stored.world.object_paths.index("floor")]) + 3
    np.testing.assert_allclose(told["value"], stored.field.ao[vertex], atol=1e-6)
    np.testing.assert_allclose(np.sum([s["share"] for s in told["shares"]], axis=0), 1 - np.array(told["value"]))
    assert {"floor", "crate", "ground"} >= {s["object"] for s in told["shares"] if s["kind"] == "object"}
    assert told["samples"][0]["object"] == "floor"
    assert told["weight_sum"] == pytest.approx(1.0, abs=1e-6)
    assert told["without"][0]["object"] == "crate"
    assert {"cause", "confidence", "evidence", "remedy"} <= set(told["causes"][0])


def test_a_point_is_in_the_file_s_metres(run: Run, result: Path) -> None:
    """A point beside the crate snaps to the floor below it; its darkness is the crate's and the ground's doing."""
    code, out, _ = run("explain", result, "--point", "-0.1,0.05,0.5", "--json")
    assert code == 0
    told = json.loads(out)
    np.testing.assert_allclose(told["spot"]["position"], [-0.1, 0.0, 0.5], atol=1e-6)
    assert told["spot"]["moved_m"] == pytest.approx(0.05)
    assert told["shares"][0]["object"] == "crate"


def test_people_read_it(run: Run, result: Path) -> None:
    """The same in words: value, occluders, samples, what if, causes."""
    code, out, _ = run("explain", result, "--vertex", "crate:0", "--without", "floor")
    assert code == 0
    for word in ("crate:0", "AO", "made of", "heaviest samples", "if floor did not cast", "causes"):
        assert word in out


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        (("--vertex", "crat:1"), "did you mean 'crate'"),
        (("--vertex", "crate"), "OBJECT:NUMBER"),
        (("--vertex", "crate:99999"), "it has 0 to"),
        (("--vertex", "ground:0"), "its role is blocker"),
        (("--point", "1,2"), "X,Y,Z"),
        (("--point", "1,2,nan"), "X,Y,Z"),
        (("--vertex", "crate:0", "--without", "flor"), "did you mean 'floor'"),
        ((), "required"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(run: Run, result: Path, words: tuple[str, ...], hint: str) -> None:
    """Bad spots are the user's to mend: exit 2, one line, nothing on stdout."""
    code, out, err = run("explain", result, *words)
    assert code == 2
    assert out == ""
    assert hint in err
    assert err.count("\n") == 1
