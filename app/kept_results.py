"""Former results, kept in the cache for as long as a step of the undo stack needs them."""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Iterable
from pathlib import Path

from app.session import is_running


class KeptResults:
    """A folder of kept results that belongs to this process.

    Args:
        cache: The window's cache folder.
    """

    def __init__(self, cache: Path) -> None:
        self._folder = cache / "undo" / str(os.getpid())
        self._count = 0

    def keep(self, result: Path) -> Path | None:
        """Keeps the result in a folder aside.

        Returns:
            Where it is kept; None if there is none.

        Raises:
            ObscuraError: it could not be kept.
        """
        from bake.results import is_result, keep_result

        if not is_result(result):
            return None
        self._count += 1
        target = self._folder / str(self._count)
        shutil.rmtree(target, ignore_errors=True)  # of a process of the same number, long ago
        keep_result(result, target)
        return target

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
        with contextlib.suppress(FileNotFoundError):
            for path in list(self._folder.iterdir()):
                if path not in keep and int(path.name) <= count:
                    shutil.rmtree(path, ignore_errors=True)
        with contextlib.suppress(OSError):
            self._folder.rmdir()

    def drop_orphans(self) -> None:
        """Removes what processes left that no longer run."""
        with contextlib.suppress(FileNotFoundError):
            for path in list(self._folder.parent.iterdir()):
                if path.name.isdigit() and not is_running(int(path.name)):
                    shutil.rmtree(path, ignore_errors=True)
