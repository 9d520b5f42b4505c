"""Former results, kept in the cache for as long as a step of the undo stack needs them."""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Iterable
from pathlib import Path

from app.result_cache import size_of
from app.session import is_running

_FOLDER = ".obscura-undo"
_MOST_COPIED = 50_000_000
_MANIFEST = "manifest.json"


class KeptResults:
    """Folders of kept results that belong to this process.

    A result on another disk than the cache is kept beside itself, so that it shares its files.

    Args:
        cache: The window's cache folder.
    """

    def __init__(self, cache: Path) -> None:
        self._cache = cache / "undo"
        self._folders: set[Path] = set()
        self._count = 0
        self._last: tuple[Path, Path] | None = None  # a result, and where it is kept

    def keep(self, result: Path) -> Path | None:
        """Keeps the result in a folder aside, in no time.

        Returns:
            Where it is kept; None if there is none.

        Raises:
            ObscuraError: it could not be kept, or not without copying much.
        """
        from bake.results import is_result, keep_result

        again = self._kept_last(result)
        if not again and not is_result(result):
            return None
        self._count += 1
        folder = self._folder_for(result)
        self._folders.add(folder)
        target = folder / str(self._count)
        shutil.rmtree(target, ignore_errors=True)  # of a process of the same number, long ago
        if again is None or not _linked(again, target):
            keep_result(result, target, copy=size_of(result) <= _MOST_COPIED)
        self._last = (result, target)
        return target

    def _kept_last(self, result: Path) -> Path | None:
        """Where what lies in a folder was kept, if it is what was kept last: its manifest need not be understood."""
        if self._last is not None and self._last[0] == result:
            with contextlib.suppress(OSError):
                there, kept = ((folder / _MANIFEST).read_bytes() for folder in self._last)
                return self._last[1] if there == kept else None
        return None

    def _folder_for(self, result: Path) -> Path:
        self._cache.mkdir(parents=True, exist_ok=True)
        same_disk = self._cache.stat().st_dev == result.stat().st_dev
        return (self._cache if same_disk else result.parent / _FOLDER) / str(os.getpid())

    @staticmethod
    def restore(kept: Path | None, result: Path) -> None:
        """Puts a kept result back; None takes away what is there.

        Raises:
            ObscuraError: it could not be put back; what is there stays.
        """
        from bake.results import put_back, take_away

        if kept is None:
            take_away(result)
        else:
            put_back(kept, result)

    @property
    def count(self) -> int:
        """How many results have been kept so far."""
        return self._count

    def drop_others(self, used: Iterable[Path], count: int) -> None:
        """Removes what no step needs any more, of the first `count` results that were kept."""
        keep = set(used)
        for folder in tuple(self._folders):
            with contextlib.suppress(FileNotFoundError):
                for path in list(folder.iterdir()):
                    if path not in keep and int(path.name) <= count:
                        shutil.rmtree(path, ignore_errors=True)
            for empty in (folder, folder.parent):
                if empty != self._cache:
                    with contextlib.suppress(OSError):
                        empty.rmdir()

    def drop_orphans(self, near: Path | None = None) -> None:
        """Removes what processes left that no longer run, in the cache and beside a result."""
        for root in (self._cache, *(() if near is None else (near.parent / _FOLDER,))):
            with contextlib.suppress(FileNotFoundError):
                for path in list(root.iterdir()):
                    if path.name.isdigit() and not is_running(int(path.name)):
                        shutil.rmtree(path, ignore_errors=True)


def _linked(kept: Path, target: Path) -> bool:
    """Keeps once more what is kept already; not if it is being removed meanwhile, or cannot be linked."""
    try:
        target.mkdir(parents=True)
        for file in sorted(kept.iterdir(), key=lambda file: file.name == _MANIFEST):  # the manifest at the end
            os.link(file, target / file.name)
    except OSError:
        shutil.rmtree(target, ignore_errors=True)
        return False
    return (target / _MANIFEST).is_file()
