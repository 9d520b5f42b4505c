"""The window's own results: how much room they take, and which go when it gets tight."""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Collection
from pathlib import Path


def cached_results(cache: Path) -> list[Path]:
    """The results in a cache folder, those used last first."""
    from bake.results import is_result

    with contextlib.suppress(FileNotFoundError):
        found = [path for path in (cache / "results").iterdir() if path.is_dir() and is_result(path)]
        return sorted(found, key=_used, reverse=True)
    return []


def note_use(result: Path) -> None:
    """Remembers that a result was used now."""
    with contextlib.suppress(OSError):
        os.utime(result)


def size_of(folder: Path) -> int:
    """Bytes that a folder takes; a file that has several names counts once."""
    sizes: dict[tuple[int, int], int] = {}
    for path in folder.rglob("*"):
        with contextlib.suppress(OSError):
            status = path.stat()
            if path.is_file():
                sizes[(status.st_dev, status.st_ino)] = status.st_size
    return sum(sizes.values())


def trim(cache: Path, most_bytes: int, keep: Collection[Path] = ()) -> int:
    """Removes the results that were not used for longest until the others fit.

    Args:
        cache: The cache folder.
        most_bytes: What results may take together; those to keep count too.
        keep: Results that stay whatever they take.

    Returns:
        Number of results removed.
    """
    results = cached_results(cache)
    kept = {path.resolve() for path in keep}
    room = most_bytes - sum(size_of(path) for path in results if path.resolve() in kept)
    removed = 0
    for path in results:
        if path.resolve() in kept:
            continue
        room -= size_of(path)
        if room < 0:
            shutil.rmtree(path, ignore_errors=True)
            removed += 1
    return removed


def _used(path: Path) -> float:
    with contextlib.suppress(OSError):
        return path.stat().st_mtime
    return 0.0
