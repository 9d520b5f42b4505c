"""`.vao`: the raw vertex AO file of NVIDIA's OptiX Prime baking sample, little-endian.

    u64 instance count, u64 vertex count
    for each instance: u64 storage identifier, u64 first vertex, u64 vertex count
    float32 AO of each vertex, instance after instance

Instances are the result's objects in scene order, and their identifier is their number in that order; the sample
itself numbers by what its loaders know (0 for an OBJ, which it reads as one mesh).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bake.results.exported_ao import open_where_unbaked
from bake.results.storage import replacing
from bake.types import BakeResult


def write_vao(result: BakeResult, path: Path, column: int) -> None:
    """Writes the AO of one distance.

    Args:
        result: What was baked.
        path: The file.
        column: The AO column.

    Raises:
        StorageError: the file could not be written.
    """
    world = result.world
    instances = np.column_stack(
        [np.arange(world.object_count, dtype=np.int64), world.first_vertex[:-1], np.diff(world.first_vertex)]
    )
    with replacing(path) as file:
        file.write(np.array([world.object_count, world.vertex_count], "<u8").tobytes())
        file.write(instances.astype("<u8").tobytes())
        file.write(open_where_unbaked(result.field.ao[:, column]).astype("<f4").tobytes())
