"""One writer at a time in a result folder; the system lets go of the lock when its owner dies."""

from __future__ import annotations

import contextlib
import errno
import logging
import os
import sys
import time
from collections.abc import Generator
from pathlib import Path

from bake.errors import StorageError

LOCK_FILE = ".obscura-lock"

_log = logging.getLogger(__name__)
_POLL_SECONDS = 0.05


@contextlib.contextmanager
def folder_lock(folder: Path, *, patience: float = 60.0) -> Generator[None]:
    """Holds the folder's lock file for the length of the block.

    Args:
        folder: An existing folder.
        patience: How long to wait for another writer, in seconds.

    Raises:
        StorageError: another writer held the lock all that time.
        OSError: the lock file cannot be created.
    """
    path = folder / LOCK_FILE
    deadline = time.monotonic() + patience
    while True:
        handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        if _try_lock(handle) and _is_same_file(handle, path):
            break
        os.close(handle)
        if time.monotonic() > deadline:
            raise StorageError(
                "another bake is writing to this result",
                where=str(folder),
                remedy="wait for it or choose another folder",
            )
        time.sleep(_POLL_SECONDS)
    try:
        yield
    finally:
        # Removed while still held: whoever waits on the old file sees that it has gone, and starts over.
        with contextlib.suppress(OSError):
            path.unlink()
        os.close(handle)


def _is_same_file(handle: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(handle), path.stat())
    except FileNotFoundError:
        return False


if sys.platform == "win32":
    import msvcrt

    def _try_lock(handle: int) -> bool:
        try:
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        return True

else:
    import fcntl

    def _try_lock(handle: int) -> bool:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            if error.errno in (errno.EWOULDBLOCK, errno.EINTR):
                return False
            # Some network file systems have no locks: the commit itself stays atomic, so go on.
            _log.warning("no file locks here (%s); do not write the same result from two bakes at once", error.strerror)
        return True
