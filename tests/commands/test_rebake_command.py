"""`rebake` end to end: the JSON contract, selections, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

from conftest import QUICK, Run
from synthetic_results import same_results

from bake.results import load_result


def test_json_contract(tmp_path: Path, run: Run, level: Path) -> None:
    """`rebake --json` prints the fields of `bake` and a report; a role in the side file is followed."""
    assert run("bake", level, "-o", tmp_path / "a", *QUICK)[0] == 0
    before = load_result(tmp_path / "a")
    path = before.world.object_paths[-1]
    level.with_name("level.glb.obscura.toml").write_text(f'[[object]]\nmatch = "{path}"\nrole = "receiver"\n')
    code, out, _ = run("rebake", tmp_path / "a", "-o", tmp_path / "b", "--bound", "0", "--json")
    assert (code, out.count("\n")) == (0, 1)
    said = json.loads(out)
    assert said["rebake"]["changed"] == [path]
    assert {"result", "seconds", "rays", "stages", "vertices", "samples", "warnings"} <= set(said)
    assert same_results(load_result(tmp_path / "a"), before)
    assert run("bake", level, "-o", tmp_path / "c", *QUICK)[0] == 0
    whole, rebaked = load_result(tmp_path / "c"), load_result(tmp_path / "b")
    assert abs(rebaked.field.ao - whole.field.ao)[whole.field.state == 0].max() <= 1e-5


def test_an_unchanged_scene_traces_nothing(tmp_path: Path, run: Run, level: Path) -> None:
    """A rebake of an unchanged scene replaces the result by an equal one, without a ray."""
    assert run("bake", level, "-o", tmp_path / "a", *QUICK)[0] == 0
    code, out, _ = run("rebake", tmp_path / "a")
    assert code == 0
    assert "nothing" in out
    assert json.loads(run("rebake", tmp_path / "a", "--json")[1])["rays"] == 0


def test_refusals(tmp_path: Path, run: Run, level: Path) -> None:
    """A wrong bound, a pattern without a match and a folder that is no result end with code 2 and one line."""
    assert run("bake", level, "-o", tmp_path / "a", *QUICK)[0] == 0
    for words in (
        ("rebake", tmp_path / "a", "--bound", "many"),
        ("rebake", tmp_path / "a", "--objects", "Nowhere/*"),
        ("rebake", tmp_path / "none"),
        ("rebake", tmp_path / "a", "--scene", tmp_path / "none.glb"),
    ):
        code, _, error = run(*words)
        assert (code, error.count("\n")) == (2, 1), words
