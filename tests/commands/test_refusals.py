"""Bad input is refused in one line with exit code 2, and nothing is overwritten."""

from __future__ import annotations

import json
import os
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import QUICK, ROOT, Run
from small_gltf import QUAD, small_document, write_glb
from synthetic_results import build_result, same_results

from bake.results import load_result, save_result


def truncated(path: Path) -> None:
    """The last bytes are missing."""
    document, binary = small_document()
    write_glb(path, document, binary)
    path.write_bytes(path.read_bytes()[:-20])


def indices_out_of_range(path: Path) -> None:
    """A triangle's corner does not exist."""
    document, binary = small_document()
    view = document["bufferViews"][2]
    changed = bytearray(binary)
    struct.pack_into("<H", changed, view["byteOffset"], 999)
    write_glb(path, document, bytes(changed))


def nan_positions(path: Path) -> None:
    """All positions are NaN."""
    document, binary = small_document()
    write_glb(path, document, np.full_like(QUAD, np.nan).tobytes() + binary[QUAD.nbytes :])


def empty_scene(path: Path) -> None:
    """No node at all."""
    path.write_text(json.dumps({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}]}))


def with_extras(extras: dict[str, Any]) -> Callable[[Path], None]:
    """A crate that declares these extras."""

    def write(path: Path) -> None:
        document, binary = small_document()
        document["nodes"][1]["extras"] = {"obscura": extras}
        write_glb(path, document, binary)

    return write


def with_side_file(text: str) -> Callable[[Path], None]:
    """The level with a side file."""

    def write(path: Path) -> None:
        write_glb(path, *small_document())
        path.with_name(f"{path.name}.obscura.toml").write_text(text)

    return write


def good(path: Path) -> None:
    """Nothing wrong with the file."""
    write_glb(path, *small_document())


CASES: dict[str, tuple[Callable[[Path], object], tuple[str, ...], str]] = {
    "missing file": (lambda path: None, (), "missing"),
    "a folder": (lambda path: path.mkdir(), (), "level.glb"),
    "no glTF at all": (lambda path: path.write_bytes(b"\x00" * 50), (), "level.glb"),
    "truncated": (truncated, (), "truncated"),
    "indices out of range": (indices_out_of_range, (), "999"),
    "NaN positions": (nan_positions, (), "nan"),
    "empty scene": (empty_scene, (), "no triangles"),
    "unknown role": (with_extras({"role": "bush"}), (), "bush"),
    "unknown role in the side file": (with_side_file('[[object]]\nmatch = "*"\nrole = "bush"'), (), "bush"),
    "unknown key": (with_extras({"rolle": "tree"}), (), "role"),
    "unknown key in the side file": (with_side_file('[[object]]\nmatch = "*"\ntwosided = true'), (), "two_sided"),
    "unknown option in the side file": (with_side_file("[bake]\nrayz = 3"), (), "rays"),
    "malformed side file": (with_side_file("[bake"), (), "obscura.toml"),
    "rays 0": (good, ("--rays", "0"), "--rays"),
    "rays 0 in the side file": (with_side_file("[bake]\nrays = 0"), (), "rays"),
    "no distance": (good, ("--distances", ""), "--distances"),
    "a distance below zero": (good, ("--distances", "-2"), "--distances"),
    "unknown stage": (good, ("--skip", "foggy"), "fog"),
}


@pytest.mark.parametrize("case", CASES)
def test_a_bad_scene_or_option(tmp_path: Path, run: Run, case: str) -> None:
    """Each is one line that names the culprit; the result that was there is still there."""
    write, options, hint = CASES[case]
    scene, folder = tmp_path / "level.glb", tmp_path / "result"
    save_result(build_result(), folder)
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    write(scene)
    # As one word, or a value such as -2 would pass for an option.
    code, out, err = run("bake", scene, "-o", folder, *QUICK[:2], *(["=".join(options)] if options else []))
    assert (code, out, err.count("\n")) == (2, "", 1), err
    assert err.startswith("obscura: ")
    assert hint in err
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_a_result_that_is_none(tmp_path: Path, run: Run, level: Path) -> None:
    """A folder with other things, a file and a missing folder are refused by every command that reads or writes one."""
    photos = tmp_path / "photos"
    photos.mkdir()
    (photos / "cat.jpg").write_bytes(b"meow")
    (tmp_path / "file").write_bytes(b"text")
    commands = [
        ("bake", level, "-o", photos),
        ("bake", level, "-o", tmp_path / "file"),
        ("export", photos, tmp_path / "out.npz"),
        ("export", tmp_path / "file", tmp_path / "out.npz"),
        ("export", tmp_path / "missing", tmp_path / "out.npz"),
        ("report", photos, "-o", tmp_path / "out.html"),
        (photos,),
    ]
    for words in commands:
        code, out, err = run(*words)
        assert (code, out, err.count("\n")) == (2, "", 1), words
    assert [path.name for path in photos.iterdir()] == ["cat.jpg"]
    assert not list(tmp_path.glob("out.*"))


def test_a_damaged_result(run: Run, stored: Path, tmp_path: Path) -> None:
    """A damaged file is named by every reader."""
    path = next(stored.glob("field_ao-*.npy"))
    path.write_bytes(path.read_bytes()[:-1])
    for words in (("export", stored, tmp_path / "out.npz"), ("report", stored, "-o", tmp_path / "out.html")):
        code, _, err = run(*words)
        assert (code, err.count("\n")) == (2, 1)
        assert path.name in err


@pytest.mark.skipif(os.name == "nt", reason="needs setrlimit")
@pytest.mark.parametrize("limit", [0, 1500])
def test_no_space_left(tmp_path: Path, level: Path, limit: int) -> None:
    """A full disk, found before the bake or at its end, is refused like other bad input."""
    folder = tmp_path / "result"
    old = build_result()
    save_result(old, folder)
    code = (
        "import resource, runpy, sys;"
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({limit},) * 2);"
        f"sys.path.insert(0, {str(ROOT)!r}); sys.argv = ['main.py', *sys.argv[1:]];"
        f"runpy.run_path({str(ROOT / 'main.py')!r}, run_name='__main__')"
    )
    words = [sys.executable, "-B", "-c", code, "bake", str(level), "-o", str(folder), *QUICK]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout) == (2, ""), done.stderr
    assert done.stderr.splitlines()[-1] == f"obscura: {folder}: no space left; free some space or choose another place"
    assert same_results(load_result(folder), old)
    assert all(path.suffix in (".npy", ".json") for path in folder.iterdir())
