"""Writing files so that a reader never meets half of one, and telling the user why a write failed."""

from __future__ import annotations

import contextlib
import errno
import os
import tempfile
from collections.abc import Generator
from pathlib import Path
from typing import BinaryIO

from bake.errors import StorageError

_PROBE_BYTES = 4096  # one block: a full disk still lets an empty file be created


@contextlib.contextmanager
def storage_errors(where: Path) -> Generator[None]:
    """Turns the system's write errors into one sentence that names `where`.

    Raises:
        StorageError: for any `OSError` inside the block.
    """
    try:
        yield
    except OSError as error:
        what, remedy = _explain(error)
        raise StorageError(what, where=str(where), remedy=remedy) from error


def _explain(error: OSError) -> tuple[str, str]:
    if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
        return "no space left", "free some space or choose another place"
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        return "not writable", "change its permissions or choose another place"
    if error.errno in (errno.ENOENT, errno.ENOTDIR):
        return "its folder does not exist", "create it or choose another place"
    if error.errno == errno.EISDIR:
        return "is a folder", "name a file"
    reason = (error.strerror or type(error).__name__).lower()
    return f"could not be written ({reason})", "choose another place"


def probe_writable(folder: Path) -> None:
    """Writes and drops one block in the nearest existing ancestor of `folder`.

    Raises:
        StorageError: it is not writable, or full.
    """
    existing = folder
    while not existing.exists() and existing != existing.parent:
        existing = existing.parent
    with storage_errors(folder), tempfile.TemporaryFile(dir=existing, prefix=".obscura-") as file:
        file.write(bytes(_PROBE_BYTES))
        sync(file)


def sync(file: BinaryIO | tempfile._TemporaryFileWrapper[bytes]) -> None:  # pyright: ignore[reportPrivateUsage]
    """Makes what was written to `file` survive a power cut."""
    file.flush()
    os.fsync(file.fileno())


def sync_folder(folder: Path) -> None:
    """Makes renames inside `folder` survive a power cut; nothing to do on Windows."""
    if os.name == "nt":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextlib.contextmanager
def replacing(path: Path) -> Generator[BinaryIO]:
    """A binary file that takes the place of `path` once the block has ended well; else `path` stays as it was.

    Raises:
        StorageError: it could not be written; nothing is left behind.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    with storage_errors(path):
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, "is a folder")
        try:
            with temporary.open("wb") as file:
                yield file
                sync(file)
            temporary.replace(path)
            sync_folder(path.parent)
        finally:
            temporary.unlink(missing_ok=True)
