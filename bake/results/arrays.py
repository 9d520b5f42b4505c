"""The arrays of a result as `.npy` files named after their content.

A name holds the first digits of the file's SHA-256. A file therefore never changes once it is in place, two results
can lie side by side in one folder while one replaces the other, and what did not change is not written again.
"""

from __future__ import annotations

import hashlib
import io
import re
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.errors import ResultError
from bake.results.storage import sync

_DIGITS = 16
_CHUNK_BYTES = 1 << 24
_PARSING = threading.Lock()
"""Held while a file's header is parsed: Python 3.11 counts the depth of `ast` for all threads together, and raises a
SystemError where two of them parse at once."""
FILE_NAME = re.compile(rf"[a-z_]+-[0-9a-f]{{{_DIGITS}}}\.npy")


@dataclass(frozen=True, slots=True)
class ArraySpec:
    """One array of a `BakeResult`: where it belongs and what it must look like.

    Attributes:
        owner: Field of `BakeResult` (world, samples, tally, field or skipped), or a part of its decorators or its
            regions (see `parts` and `region_parts`).
        attribute: Field of the owner.
        dtype: Little-endian type as stored.
        row: Shape after the first axis; -1: any length.
        optional: Whether it may be None.
    """

    owner: str
    attribute: str
    dtype: str
    row: tuple[int, ...] = ()
    optional: bool = False

    @property
    def name(self) -> str:
        """Key in the manifest, e.g. `world.positions`."""
        return f"{self.owner}.{self.attribute}"


SPECS: tuple[ArraySpec, ...] = (
    ArraySpec("world", "origin", "<f8"),
    ArraySpec("world", "positions", "<f8", (3,)),
    ArraySpec("world", "normals", "<f4", (3,)),
    ArraySpec("world", "faces", "<i4", (3,)),
    ArraySpec("world", "face_object", "<i4"),
    ArraySpec("world", "face_casts", "|b1"),
    ArraySpec("world", "face_samples", "|b1"),
    ArraySpec("world", "face_two_sided", "|b1"),
    ArraySpec("world", "face_openness", "<f4"),
    ArraySpec("world", "first_vertex", "<i8"),
    ArraySpec("world", "first_face", "<i8"),
    ArraySpec("world", "vertex_uv", "<f4", (2,), optional=True),
    ArraySpec("world", "face_texture", "<i4", optional=True),
    ArraySpec("world", "texels", "<f4"),  # all of `World.textures` end to end; the manifest has their shapes
    ArraySpec("samples", "face", "<i4"),
    ArraySpec("samples", "barycentric", "<f4", (2,)),
    ArraySpec("samples", "area", "<f4"),
    ArraySpec("samples", "index", "<i4"),
    ArraySpec("samples", "face_seed", "<u4"),
    ArraySpec("tally", "ao", "<f4", (-1,)),
    ArraySpec("tally", "rays", "<u2"),
    ArraySpec("tally", "hits", "<u2"),
    ArraySpec("tally", "back_faces", "<u2"),
    ArraySpec("field", "ao", "<f4", (-1,)),
    ArraySpec("field", "state", "|u1"),
    ArraySpec("fog", "object", "<i4"),
    ArraySpec("fog", "minimum", "<f4", (3,)),
    ArraySpec("fog", "maximum", "<f4", (3,)),
    ArraySpec("fog", "given_density", "<f4"),
    ArraySpec("fog", "density", "<f4"),
    ArraySpec("volume", "origin", "<f8"),
    ArraySpec("volume", "top", "<i4", (-1, -1)),
    ArraySpec("volume", "brick_voxels", "<i4", (9, 9, 9)),
    ArraySpec("volume", "voxel", "<i4", (3,)),
    ArraySpec("volume", "sh", "<f4", (9, -1)),
    ArraySpec("volume", "valid", "|u1"),
    ArraySpec("models", "mesh", "<i4"),
    ArraySpec("models", "first_vertex", "<i8"),
    ArraySpec("models", "local_ao", "<f4", (-1,)),
    ArraySpec("fits", "object", "<i4"),
    ArraySpec("fits", "model", "<i4"),
    ArraySpec("fits", "centre", "<f8", (3,)),
    ArraySpec("fits", "coefficients", "<f4", (4, -1)),
    ArraySpec("fits", "rmse_global", "<f4", (-1,)),
    ArraySpec("fits", "rmse_product", "<f4", (-1,)),
    ArraySpec("fits", "rmse_volume", "<f4", (-1,)),
    ArraySpec("fits", "terms", "|u1", (-1,)),
    ArraySpec("shrub_scalars", "object", "<i4"),
    ArraySpec("shrub_scalars", "ao", "<f4", (-1,)),
    ArraySpec("shrub_scalars", "found", "|b1"),
    ArraySpec("small_scalars", "object", "<i4"),
    ArraySpec("small_scalars", "ao", "<f4", (-1,)),
    ArraySpec("small_scalars", "found", "|b1"),
    ArraySpec("region_graph", "minimum", "<f8", (3,)),
    ArraySpec("region_graph", "maximum", "<f8", (3,)),
    ArraySpec("region_graph", "seed", "<f8", (3,)),
    ArraySpec("region_graph", "link", "<i4", (2,)),
    ArraySpec("region_graph", "link_area", "<f8"),
    ArraySpec("region_graph", "link_centre", "<f8", (3,)),
    ArraySpec("region_points", "position", "<f4", (3,)),
    ArraySpec("region_points", "state", "|u1"),
    ArraySpec("region_points", "back_face_share", "<f4"),
    ArraySpec("region_points", "traced", "<i4"),
    ArraySpec("region_points", "sh", "<f4", (9, -1)),
    ArraySpec("region_points", "windowed", "|u1"),
    *(
        ArraySpec(owner, attribute, dtype, row)
        for owner in ("region_fits", "region_models")
        for attribute, dtype, row in (
            ("centre", "<f8", (3,)),
            ("coefficients", "<f4", (7, 9, -1)),
            ("terms", "|u1", ()),
            ("centre_kind", "|u1", ()),
            ("rmse", "<f4", (-1,)),
        )
    ),
    ArraySpec("regions", "mismatch_before", "<f4", (-1,)),
    ArraySpec("regions", "mismatch_after", "<f4", (-1,)),
    ArraySpec("regions", "absorbed_error", "<f4", (-1,)),
    ArraySpec("regions", "owner", "<i4"),
    ArraySpec("skipped", "samples", "<f4"),
    ArraySpec("skipped", "voxels", "<f4"),
    ArraySpec("skipped", "trees", "<f4"),
    ArraySpec("skipped", "points", "<f4"),
)


@dataclass(frozen=True, slots=True)
class StoredArray:
    """What the manifest says of one array file."""

    file: str
    sha256: str
    dtype: str
    shape: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class ArrayFile:
    """An array together with the bytes of its `.npy` header and the hash of the whole file."""

    stored: StoredArray
    header: bytes
    array: NDArray[Any]

    @staticmethod
    def of(spec: ArraySpec, values: NDArray[Any]) -> ArrayFile:
        """Hashes `values` as the file they will become."""
        array = np.ascontiguousarray(values, dtype=spec.dtype)
        buffer = io.BytesIO()
        np.lib.format.write_array_header_1_0(buffer, np.lib.format.header_data_from_array_1_0(array))
        header = buffer.getvalue()
        digest = hashlib.sha256(header)
        for chunk in _chunks(array):
            digest.update(chunk)
        sha256 = digest.hexdigest()
        file = f"{spec.owner}_{spec.attribute}-{sha256[:_DIGITS]}.npy"
        return ArrayFile(StoredArray(file, sha256, spec.dtype, array.shape), header, array)

    def write(self, path: Path) -> None:
        """Writes and syncs the file.

        Raises:
            OSError: as the system says.
        """
        with path.open("xb") as file:
            file.write(self.header)
            for chunk in _chunks(self.array):
                file.write(chunk)
            sync(file)


def _chunks(array: NDArray[Any]) -> Iterator[memoryview]:
    data = array.reshape(-1).view(np.uint8)
    for begin in range(0, data.size, _CHUNK_BYTES):
        yield data[begin : begin + _CHUNK_BYTES].data


def file_sha256(path: Path) -> str:
    """SHA-256 of a file in hex; lets other threads run meanwhile."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def read_array(folder: Path, spec: ArraySpec, stored: StoredArray, *, verify: bool) -> NDArray[Any]:
    """Maps one array file into memory, read-only.

    Raises:
        FileNotFoundError: there is no such file.
        ResultError: it is damaged; the message names it.
    """
    path = folder / stored.file
    try:
        if verify and file_sha256(path) != stored.sha256:
            raise ResultError("content differs from what the manifest recorded", where=str(path), remedy=_REMEDY)
        empty = 0 in stored.shape  # nothing there that could be mapped
        with _PARSING:
            array: NDArray[Any] = np.load(path, mmap_mode=None if empty else "r", allow_pickle=False)
    except FileNotFoundError:
        raise
    except (OSError, ValueError, EOFError) as error:
        raise ResultError("cannot be read or is cut short", where=str(path), remedy=_REMEDY) from error
    fits = len(spec.row) + 1 == array.ndim and all(
        want in (-1, have) for want, have in zip(spec.row, array.shape[1:], strict=True)
    )
    if array.dtype.str != spec.dtype or array.shape != stored.shape or not fits:
        raise ResultError(
            f"holds {array.dtype.str} {array.shape}, not {stored.dtype} {stored.shape}",
            where=str(path),
            remedy=_REMEDY,
        )
    return array.view(np.ndarray)


_REMEDY = "bake again"
