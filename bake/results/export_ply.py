"""`.ply`, binary little-endian: the mesh with AO as float vertex properties.

Vertices carry `x y z` (double, world metres), `ao` (float, the chosen distance), `ao_0`, `ao_1` … (float, one a
distance; a comment tells which) and `state` (uchar: 0 baked, 1 filled, 2 without a value of its own). Faces carry
their corners and `object` (int); comments name the objects.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bake.results.exported_ao import exported_state, open_where_unbaked
from bake.results.storage import replacing
from bake.types import BakeResult

_ROWS = 1 << 17  # written at a time


def write_ply(result: BakeResult, path: Path, column: int) -> None:
    """Writes the mesh in slices, without a second copy in memory.

    Args:
        result: What was baked.
        path: The file.
        column: The AO column that becomes `ao`.

    Raises:
        StorageError: the file could not be written.
    """
    world, field = result.world, result.field
    names = [f"ao_{index}" for index in range(field.ao.shape[1])]
    vertex_type = np.dtype(
        [("xyz", "<f8", 3), ("ao", "<f4"), ("aos", "<f4", len(names)), ("state", "u1")],
    )
    face_type = np.dtype([("corners", "u1"), ("vertex_indices", "<i4", 3), ("object", "<i4")])
    with replacing(path) as file:
        file.write(_header(result, names))
        for begin in range(0, world.vertex_count, _ROWS):
            part = slice(begin, begin + _ROWS)
            ao = open_where_unbaked(field.ao[part])
            vertices = np.empty(len(ao), vertex_type)
            vertices["xyz"] = world.positions[part] + world.origin
            vertices["ao"] = ao[:, column]
            vertices["aos"] = ao
            vertices["state"] = exported_state(field.state[part])
            file.write(vertices.tobytes())
        for begin in range(0, world.face_count, _ROWS):
            part = slice(begin, begin + _ROWS)
            faces = np.empty(len(world.faces[part]), face_type)
            faces["corners"] = 3
            faces["vertex_indices"] = world.faces[part]
            faces["object"] = world.face_object[part]
            file.write(faces.tobytes())


def _header(result: BakeResult, names: list[str]) -> bytes:
    world = result.world
    distances = zip(names, result.settings.column_distances, strict=True)
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        "comment Obscura: ambient obscurance, 1 open, 0 closed",
        *(f"comment {name} distance {distance!r} m" for name, distance in distances),
        *(f"comment object {index} {' '.join(name.split())}" for index, name in enumerate(world.object_paths)),
        f"element vertex {world.vertex_count}",
        *(f"property double {axis}" for axis in "xyz"),
        *(f"property float {name}" for name in ["ao", *names]),
        "property uchar state",
        f"element face {world.face_count}",
        "property list uchar int vertex_indices",
        "property int object",
        "end_header",
    ]
    return ("\n".join(lines) + "\n").encode()
