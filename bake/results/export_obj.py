"""`.obj`: the mesh with AO as grey vertex colours, `v x y z r g b`.

The format has no standard for colours; its readers take the six-number form and expect sRGB, so AO, a linear factor,
is encoded as sRGB. Positions are world metres; every object with faces is one `o` group.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bake.results.exported_ao import open_where_unbaked
from bake.results.storage import replacing
from bake.types import BakeResult, Float64Array

_ROWS = 1 << 15  # formatted at a time


def write_obj(result: BakeResult, path: Path, column: int) -> None:
    """Writes the mesh with the AO of one distance.

    Args:
        result: What was baked.
        path: The file.
        column: The AO column.

    Raises:
        StorageError: the file could not be written.
    """
    world = result.world
    distance = result.settings.column_distances[column]
    with replacing(path) as file:
        file.write(f"# Obscura: ambient obscurance at {distance:g} m as sRGB grey\n".encode())
        for begin in range(0, world.vertex_count, _ROWS):
            part = slice(begin, begin + _ROWS)
            grey = linear_to_srgb(open_where_unbaked(result.field.ao[part, column]).astype(np.float64))
            rows = np.column_stack([world.positions[part] + world.origin, grey, grey, grey])
            file.write(("v %.9g %.9g %.9g %.6f %.6f %.6f\n" * len(rows) % tuple(rows.ravel().tolist())).encode())
        for index, name in enumerate(world.object_paths):
            first, last = world.first_face[index : index + 2].tolist()
            if first == last:
                continue
            file.write(f"o {'_'.join(name.split())}\n".encode())
            for begin in range(first, last, _ROWS):
                corners = world.faces[begin : min(begin + _ROWS, last)] + 1
                file.write(("f %d %d %d\n" * len(corners) % tuple(corners.ravel().tolist())).encode())


def linear_to_srgb(linear: Float64Array) -> Float64Array:
    """The sRGB transfer function (IEC 61966-2-1) on values in [0, 1]; same shape."""
    curve = 1.055 * np.power(np.maximum(linear, 0.0), 1 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, 12.92 * linear, curve)
