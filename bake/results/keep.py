"""Keeping a result aside and putting it back, so that a bake can be taken back.

Array files are never written twice under one name (see `arrays`), so a kept result shares its files with the one in use
where the file system has hard links: keeping costs no time and, until the next bake, no space.
"""

from __future__ import annotations

import contextlib
import os
import shutil
from pathlib import Path

from bake.errors import ResultError
from bake.results.lock import folder_lock
from bake.results.manifest import MANIFEST_FILE, read_manifest
from bake.results.save import check_destination, staging_in, sweep
from bake.results.storage import storage_errors, sync_folder


def keep_result(folder: Path, target: Path, *, copy: bool = True) -> None:
    """Keeps the result in `folder` aside.

    Args:
        folder: A result.
        target: A folder that does not exist yet.
        copy: Whether to copy where files cannot be shared, which takes time and space.

    Raises:
        ResultError: there is no result in `folder`, or a file of it is missing; nothing is left behind.
        StorageError: `target` exists, or could not be written.
    """
    with storage_errors(target):
        target.mkdir(parents=True)
        try:
            with folder_lock(folder):
                for stored in read_manifest(folder).arrays.values():
                    _link(folder / stored.file, target / stored.file, copy=copy)
                shutil.copyfile(folder / MANIFEST_FILE, target / MANIFEST_FILE)
        except BaseException:
            shutil.rmtree(target, ignore_errors=True)
            raise


def put_back(kept: Path, folder: Path) -> None:
    """Puts a result that was kept in the place of the one in `folder`; readers see either of the two, whole.

    Raises:
        ResultError: what was kept is damaged, or `folder` is something else than a result.
        StorageError: `folder` could not be written; what it holds is untouched.
    """
    check_destination(folder)
    arrays = read_manifest(kept).arrays
    with storage_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
        with folder_lock(folder), staging_in(folder) as staging:
            for stored in arrays.values():
                if not (folder / stored.file).is_file():
                    _link(kept / stored.file, staging / stored.file)
                    (staging / stored.file).replace(folder / stored.file)
            shutil.copyfile(kept / MANIFEST_FILE, staging / MANIFEST_FILE)
            (staging / MANIFEST_FILE).replace(folder / MANIFEST_FILE)
            sync_folder(folder)


def take_away(folder: Path) -> None:
    """Removes the result from a folder, and the folder if nothing else is in it; none is fine.

    Raises:
        StorageError: it could not be removed.
    """
    if not folder.is_dir():
        return
    with storage_errors(folder), folder_lock(folder):
        (folder / MANIFEST_FILE).unlink(missing_ok=True)
        sweep(folder)
    with contextlib.suppress(OSError):
        folder.rmdir()


def _link(source: Path, target: Path, *, copy: bool = True) -> None:
    if not source.is_file():
        raise ResultError("an array file is missing", where=str(source), remedy="bake again")
    try:
        os.link(source, target)
    except OSError:  # another disk, or a file system without hard links
        if not copy:
            raise
        shutil.copyfile(source, target)
