"""Stores a result so that a kill at any moment leaves the last good one readable.

The array files of old and new results never share a name unless they share their content (see `arrays`), so the new
ones can be put beside the old ones. Renaming the new manifest over the old one is the commit; only then do the old
array files go.
"""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Generator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from bake.errors import ResultError
from bake.results.arrays import FILE_NAME, SPECS, ArrayFile, file_sha256
from bake.results.lock import LOCK_FILE, folder_lock
from bake.results.manifest import MANIFEST_FILE, is_result, manifest_text, read_manifest
from bake.results.parts import owners_of
from bake.results.region_parts import region_owners
from bake.results.storage import probe_writable, storage_errors, sync, sync_folder
from bake.types import BakeResult

_STAGING = ".obscura-saving"
WRITERS = 8
"""Files that are written, and waited for, at a time."""


def check_destination(folder: Path) -> None:
    """Tells, before any work, whether `save_result` may write to `folder`.

    Raises:
        ResultError: it exists and is neither empty nor a result: nothing of the user's is ever overwritten.
        StorageError: it is not writable, or full.
    """
    if folder.exists() and not folder.is_dir():
        raise ResultError("is a file, not a result folder", where=str(folder), remedy="name another folder")
    with storage_errors(folder):
        is_taken = folder.is_dir() and not is_result(folder) and not _is_blank(folder)
    if is_taken:
        raise ResultError(
            "exists and is no result, so it is left alone", where=str(folder), remedy="name another or an empty folder"
        )
    probe_writable(folder)


def save_result(result: BakeResult, folder: Path) -> None:
    """Writes `result` to `folder`, in place of the result that may be there.

    Other writers to the same folder wait; readers see either the old or the new result, whole.

    Raises:
        ResultError: `folder` is something else than a result.
        StorageError: no space, no permission, or another writer that does not end; the old result is untouched.
    """
    check_destination(folder)
    is_new = not folder.exists()
    files = _array_files(result)
    text = manifest_text(result, {name: file.stored for name, file in files.items()})
    try:
        with storage_errors(folder):
            folder.mkdir(parents=True, exist_ok=True)
            with folder_lock(folder), staging_in(folder) as staging:
                with ThreadPoolExecutor(WRITERS, "store") as pool:  # the disk takes several files at once
                    for written in [pool.submit(_put, file, staging, folder) for file in files.values()]:
                        written.result()
                sync_folder(folder)
                with (staging / MANIFEST_FILE).open("xb") as manifest:
                    manifest.write(text.encode())
                    sync(manifest)
                (staging / MANIFEST_FILE).replace(folder / MANIFEST_FILE)
                sync_folder(folder)
    finally:
        if is_new:  # after a failure nothing is in it
            with contextlib.suppress(OSError):
                folder.rmdir()


def _array_files(result: BakeResult) -> dict[str, ArrayFile]:
    """All arrays, hashed side by side: hashing lets go of the interpreter lock."""
    textures = [texture.reshape(-1) for texture in result.world.textures]
    owners = owners_of(result) | region_owners(result.regions)

    def hashed(position: int) -> ArrayFile | None:
        spec = SPECS[position]
        if spec.attribute == "texels":
            values = np.concatenate(textures) if textures else np.zeros(0, np.float32)
        elif spec.owner in owners:
            values = getattr(owners[spec.owner], spec.attribute)
        else:
            values = None
        return None if values is None else ArrayFile.of(spec, values)

    with ThreadPoolExecutor() as pool:
        hashed_files = pool.map(hashed, range(len(SPECS)))
        return {spec.name: file for spec, file in zip(SPECS, hashed_files, strict=True) if file is not None}


def _put(file: ArrayFile, staging: Path, folder: Path) -> None:
    target = folder / file.stored.file
    if target.is_file() and file_sha256(target) == file.stored.sha256:
        return  # unchanged since the last bake; perhaps even the mapped file that the array comes from
    file.write(staging / file.stored.file)
    (staging / file.stored.file).replace(target)


@contextlib.contextmanager
def staging_in(folder: Path) -> Generator[Path]:
    """A folder for unfinished files; at the end, whatever happened, only what the manifest names remains."""
    staging = folder / _STAGING
    shutil.rmtree(staging, ignore_errors=True)  # of a writer that was killed: we hold the lock, so it is gone
    staging.mkdir()
    try:
        yield staging
    finally:
        shutil.rmtree(staging, ignore_errors=True)
        sweep(folder)


def sweep(folder: Path) -> None:
    """Removes the array files that the manifest does not name; whoever calls holds the lock."""
    try:
        kept = {stored.file for stored in read_manifest(folder).arrays.values()}
    except ResultError:
        if is_result(folder):
            return  # of another version, which knows its own files
        kept = set[str]()
    for path in folder.iterdir():
        if FILE_NAME.fullmatch(path.name) and path.name not in kept:
            with contextlib.suppress(OSError):  # Windows keeps files that a reader has mapped: the next sweep gets them
                path.unlink()


def _is_blank(folder: Path) -> bool:
    """Whether a folder without a manifest is empty, or holds nothing but what a killed writer left."""
    names = {path.name for path in folder.iterdir()}
    if not names:
        return True
    return LOCK_FILE in names and all(name in (LOCK_FILE, _STAGING) or FILE_NAME.fullmatch(name) for name in names)
