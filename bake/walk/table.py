"""A walk as a table, a row a frame."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bake.results.storage import replacing
from bake.types import Float64Array
from bake.walk.types import CHOSEN, Variant, Walk

COLUMNS = ("time_s", "x", "y", "z", "region", "raw", "regularised", "blended", "spatial", "truth")
_VARIANTS = (Variant.RAW, Variant.REGULARISED, Variant.BLENDED, Variant.SPATIAL, Variant.TRUTH)


def write_csv(path: Path, walk: Walk, names: Sequence[str], *, origin: Float64Array) -> None:
    """Writes frames about the chosen normal: time, place in world metres, region, and the AO of the variants.

    Cells of the truth are empty where it is not known.

    Args:
        path: Replaced as a whole, or not at all.
        walk: The walk.
        names: Of the regions.
        origin: `World.origin`, shape (3,).

    Raises:
        StorageError: it could not be written.
    """
    nothing = np.full(len(walk), np.nan, np.float32)
    columns = [walk.ao[variant][:, CHOSEN] if variant in walk.ao else nothing for variant in _VARIANTS]
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    places = (walk.position + origin).tolist()
    for time, place, region, *values in zip(
        walk.time.tolist(), places, walk.region.tolist(), *(column.tolist() for column in columns), strict=True
    ):
        numbers = ["" if value != value else f"{value:.6f}" for value in values]
        writer.writerow([f"{time:.6f}", *(f"{axis:.5f}" for axis in place), names[region], *numbers])
    with replacing(path) as file:
        file.write(text.getvalue().encode())
