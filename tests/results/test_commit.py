"""A kill, damage or a full disk never costs the last good result."""

from __future__ import annotations

import errno
import os
import random
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from synthetic_results import build_result, same_results

from bake.errors import ObscuraError, ResultError, StorageError
from bake.results import load_result, save_result
from bake.results.arrays import ArrayFile
from bake.results.lock import LOCK_FILE, folder_lock
from bake.types import BakeResult

_ROOT = Path(__file__).resolve().parents[2]
_SAVE_ON_REQUEST = """
import os, sys
from pathlib import Path
sys.path[:0] = [{root!r}, {here!r}]
from synthetic_results import build_result
from bake.results import save_result
results = [build_result(seed=seed, vertices_per_object=4000) for seed in (1, 2)]
for line in sys.stdin:
    child = os.fork()
    if not child:
        while True:
            for result in results:
                save_result(result, Path(sys.argv[1]))
    print(child, flush=True)
    os.waitpid(child, 0)
"""
_SAVE_LIMITED = """
import resource, sys
from pathlib import Path
sys.path[:0] = [{root!r}, {here!r}]
from synthetic_results import build_result
from bake.errors import StorageError
from bake.results import save_result
result = build_result(seed=2, vertices_per_object=4000)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]),) * 2)
try:
    save_result(result, Path(sys.argv[1]))
except StorageError as error:
    print(error)
    sys.exit(7)
"""


def _script(text: str, *arguments: object) -> list[str]:
    code = text.format(root=str(_ROOT), here=str(Path(__file__).parent))
    return [sys.executable, "-c", code, *map(str, arguments)]


@pytest.mark.skipif(os.name == "nt", reason="needs SIGKILL")
def test_kill_at_any_moment(tmp_path: Path) -> None:
    """After each of 20 kills at random moments the folder holds one of the two results, whole."""
    moments = random.Random(4)
    folder = tmp_path / "yard"
    good = [build_result(seed=seed, vertices_per_object=4000) for seed in (1, 2)]
    save_result(good[0], folder)
    with subprocess.Popen(
        _script(_SAVE_ON_REQUEST, folder), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
    ) as saver:
        assert saver.stdin is not None
        assert saver.stdout is not None
        for _ in range(20):
            saver.stdin.write("go\n")
            child = int(saver.stdout.readline())
            time.sleep(moments.uniform(0.0, 0.2))
            os.kill(child, signal.SIGKILL)
            loaded = load_result(folder)
            matches = [number for number, result in enumerate(good) if same_results(loaded, result)]
            assert len(matches) == 1
        saver.stdin.close()
    save_result(good[1], folder)
    referenced = len(list(folder.glob("*.npy")))
    assert referenced == len({path.name.split("-")[0] for path in folder.glob("*.npy")})
    assert {path.suffix for path in folder.iterdir()} == {".json", ".npy"}


def test_a_first_save_that_was_killed_can_be_repeated(tmp_path: Path, result: BakeResult) -> None:
    """What a killed first save leaves in a new folder does not block the next."""
    (tmp_path / LOCK_FILE).touch()
    (tmp_path / ".obscura-saving").mkdir()
    (tmp_path / ".obscura-saving" / "manifest.json").write_text("{")
    (tmp_path / "world_faces-0123456789abcdef.npy").write_bytes(b"half")
    with pytest.raises(ResultError):
        load_result(tmp_path)
    save_result(result, tmp_path)
    assert same_results(load_result(tmp_path), result)
    assert not list(tmp_path.glob(".obscura*"))
    assert not (tmp_path / "world_faces-0123456789abcdef.npy").exists()


@pytest.mark.parametrize("way", ["cut", "flip", "missing", "empty", "swapped"])
def test_a_damaged_array_is_named(tmp_path: Path, result: BakeResult, way: str) -> None:
    """Each kind of damage to an array file ends in an error that names the file."""
    save_result(result, tmp_path)
    path = next(tmp_path.glob("tally_ao-*.npy"))
    content = bytearray(path.read_bytes())
    if way == "missing":
        path.unlink()
    else:
        content[-1] ^= 1
        other = next(tmp_path.glob("field_ao-*.npy")).read_bytes()
        path.write_bytes({"cut": content[:-8], "flip": content, "empty": b"", "swapped": other}[way])
    with pytest.raises(ResultError, match=path.name):
        load_result(tmp_path)


def test_damage_that_shows_without_hashing(tmp_path: Path, result: BakeResult) -> None:
    """A cut or pickled array is refused even when hashes are not compared."""
    save_result(result, tmp_path)
    path = next(tmp_path.glob("tally_ao-*.npy"))
    path.write_bytes(path.read_bytes()[:-8])
    with pytest.raises(ResultError, match=path.name):
        load_result(tmp_path, verify=False)
    np.save(path, np.array([{"a": 1}], object), allow_pickle=True)
    with pytest.raises(ResultError, match=path.name):
        load_result(tmp_path, verify=False)


def test_a_damaged_manifest_is_named(tmp_path: Path, result: BakeResult) -> None:
    """One changed digit in the manifest is noticed."""
    save_result(result, tmp_path)
    path = tmp_path / "manifest.json"
    path.write_text(path.read_text().replace('"rays_skipped": 7', '"rays_skipped": 8'))
    with pytest.raises(ResultError, match=r"manifest\.json"):
        load_result(tmp_path)


def test_a_damaged_array_is_mended_by_saving(tmp_path: Path, result: BakeResult) -> None:
    """Saving does not trust a file for its name."""
    save_result(result, tmp_path)
    next(tmp_path.glob("world_faces-*.npy")).write_bytes(b"broken")
    save_result(result, tmp_path)
    assert same_results(load_result(tmp_path), result)


def test_a_manifest_cannot_point_outside(tmp_path: Path, result: BakeResult) -> None:
    """A file name with a path in it is refused, even with a fitting checksum."""
    from bake.results import manifest as module

    save_result(result, tmp_path)
    path = tmp_path / "manifest.json"
    content = module._read_json(path)
    content["arrays"]["field.ao"]["file"] = "../secret.npy"
    del content["checksum"]
    content["checksum"] = module._checksum(content)
    path.write_text(module.json.dumps(content))
    with pytest.raises(ResultError, match="secret"):
        load_result(tmp_path)


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EDQUOT])
@pytest.mark.parametrize("fails_at", [0, 3, 20])
def test_no_space_left(
    tmp_path: Path, result: BakeResult, monkeypatch: pytest.MonkeyPatch, code: int, fails_at: int
) -> None:
    """A disk that fills up during any of the writes leaves the old result and no rest."""
    save_result(result, tmp_path / "yard")
    before = {path.name: path.read_bytes() for path in (tmp_path / "yard").iterdir()}
    written = 0
    write = ArrayFile.write

    def full(self: ArrayFile, path: Path) -> None:
        nonlocal written
        if written >= fails_at or self.stored.file.startswith("field_state"):
            path.write_bytes(b"half")
            raise OSError(code, os.strerror(code))
        written += 1
        write(self, path)

    monkeypatch.setattr(ArrayFile, "write", full)
    with pytest.raises(StorageError, match="no space left") as caught:
        save_result(build_result(seed=5, objects=4), tmp_path / "yard")
    assert caught.value.exit_code == 2
    assert {path.name: path.read_bytes() for path in (tmp_path / "yard").iterdir()} == before
    with pytest.raises(StorageError):
        save_result(result, tmp_path / "new")
    assert not (tmp_path / "new").exists()


@pytest.mark.skipif(os.name == "nt", reason="needs setrlimit")
@pytest.mark.parametrize("limit", [0, 20_000])
def test_a_real_write_limit(tmp_path: Path, result: BakeResult, limit: int) -> None:
    """The system's own refusal to write, before the work and in its midst, is reported in one sentence."""
    save_result(result, tmp_path)
    done = subprocess.run(_script(_SAVE_LIMITED, tmp_path, limit), capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout.count("\n")) == (7, 1), done.stderr
    assert "no space left" in done.stdout
    assert same_results(load_result(tmp_path), result)
    assert not list(tmp_path.glob(".obscura*"))


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root may write anywhere")
def test_a_read_only_folder(tmp_path: Path, result: BakeResult) -> None:
    """A folder without write permission is refused before any work."""
    tmp_path.chmod(0o500)
    with pytest.raises(StorageError, match="not writable"):
        save_result(result, tmp_path / "yard")


def test_an_interrupt_leaves_nothing(tmp_path: Path, result: BakeResult, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl+C during a save keeps the old result and cleans up."""
    save_result(result, tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    def interrupted(self: ArrayFile, path: Path) -> None:
        path.write_bytes(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr(ArrayFile, "write", interrupted)
    with pytest.raises(KeyboardInterrupt):
        save_result(build_result(seed=5), tmp_path)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_readers_and_writers_at_once(tmp_path: Path) -> None:
    """Two writers and a reader on one folder: the reader always sees one whole result."""
    results = [build_result(seed=seed, vertices_per_object=200) for seed in (1, 2)]
    save_result(results[0], tmp_path)
    failures: list[ObscuraError] = []
    stop = threading.Event()

    def write(result: BakeResult) -> None:
        while not stop.is_set():
            try:
                save_result(result, tmp_path)
            except ObscuraError as error:
                failures.append(error)

    writers = [threading.Thread(target=write, args=(result,)) for result in results]
    for writer in writers:
        writer.start()
    try:
        for _ in range(30):
            loaded = load_result(tmp_path)
            assert any(same_results(loaded, result) for result in results)
    finally:
        stop.set()
        for writer in writers:
            writer.join()
    assert failures == []


def test_a_second_writer_gives_up(tmp_path: Path) -> None:
    """A writer that never ends is reported, not waited for without end."""
    with (
        folder_lock(tmp_path),
        pytest.raises(StorageError, match="another bake"),
        folder_lock(tmp_path, patience=0.1),
    ):
        pass
    assert list(tmp_path.iterdir()) == []
