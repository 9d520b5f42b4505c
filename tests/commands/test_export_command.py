"""`export` through the command line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from conftest import QUICK, Run
from small_gltf import accessor, split_glb

from bake.results import load_result


@pytest.mark.parametrize("suffix", ["npz", "ply", "obj", "vao"])
def test_each_format(tmp_path: Path, run: Run, stored: Path, suffix: str) -> None:
    """Every format that needs no scene is written from the stored result alone."""
    path = tmp_path / f"out.{suffix}"
    code, out, err = run("export", stored, path)
    assert (code, err) == (0, "")
    assert str(path) in out
    assert json.loads(run("export", stored, path, "--json")[1])["bytes"] == path.stat().st_size > 0


def test_a_baked_glb(tmp_path: Path, run: Run, level: Path) -> None:
    """A level goes in as GLB and comes out as the same GLB with its baked AO."""
    folder, path = tmp_path / "result", tmp_path / "out.glb"
    assert run("bake", level, "-o", folder, *QUICK)[0] == 0
    code, _, err = run("export", folder, path)
    assert code == 0
    assert "only its mean AO" in err
    document, binary, _ = split_glb(path)
    result = load_result(folder)
    attributes = document["meshes"][document["nodes"][1]["mesh"]]["primitives"][0]["attributes"]
    np.testing.assert_array_equal(accessor(document, binary, attributes["_AO"]), result.field.ao[:4])
    assert binary[: split_glb(level)[0]["buffers"][0]["byteLength"]] == split_glb(level)[1]


def test_made_normals_with_another_crease_angle(tmp_path: Path, run: Run) -> None:
    """A level without normals exports whatever crease angle it was baked with."""
    from small_gltf import small_document, write_glb

    level = write_glb(tmp_path / "bare.glb", *small_document(normals=False))
    folder = tmp_path / "result"
    assert run("bake", level, "-o", folder, "--crease-angle", "10", *QUICK)[0] == 0
    assert run("export", folder, tmp_path / "out.glb")[0] == 0


def test_refused_exports(tmp_path: Path, run: Run, stored: Path) -> None:
    """Unknown formats and distances, and a scene that is gone, are one line each, and write nothing."""
    cases = [(stored, "out.fbx"), (stored, "out.npz", "--distance", "7"), (stored, "out.glb"), (stored, "no/out.npz")]
    for folder, name, *rest in cases:
        code, out, err = run("export", folder, tmp_path / name, *rest)
        assert (code, out, err.count("\n")) == (2, "", 1), err
    assert not list(tmp_path.glob("out.*"))
