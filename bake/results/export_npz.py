"""`.npz`: all numbers of a result for any tool that reads NumPy files.

`positions` (n, 3) float64 world [m]; `faces` (m, 3) int32; `ao` (n, k) float32, 1 open, one column a distance;
`distances` (k,) float64 [m]; `vertex_state` (n,) uint8: 0 baked, 1 filled from neighbours, 2 without a value of its
own; `object` (m,) int32 per face; `object_names` (o,) text; and of the s samples `samples_face` (s,) int32,
`samples_bary` (s, 3) float32, `samples_ao` (s, k) float32, `samples_backface` (s,) float32, the share of hits that
were back faces. Instances are flattened, in scene order. Decorators that the result has follow, see
`exported_decorators.decorator_arrays`.
"""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.results.exported_ao import exported_state, open_where_unbaked
from bake.results.exported_decorators import decorator_arrays
from bake.results.storage import replacing
from bake.types import BakeResult


def write_npz(result: BakeResult, path: Path, _column: int) -> None:
    """Writes the archive; the same result gives the same bytes.

    Raises:
        StorageError: the file could not be written.
    """
    world, samples = result.world, result.samples
    rest = 1.0 - samples.barycentric.sum(axis=1, keepdims=True)
    arrays: dict[str, NDArray[Any]] = {
        "positions": world.positions + world.origin,
        "faces": world.faces,
        "ao": open_where_unbaked(result.field.ao),
        "distances": np.array(result.settings.column_distances, np.float64),
        "vertex_state": exported_state(result.field.state),
        "object": world.face_object,
        "object_names": np.array(world.object_paths, dtype=np.str_),
        "samples_face": samples.face,
        "samples_bary": np.concatenate([samples.barycentric, rest], axis=1).astype(np.float32),
        "samples_ao": result.tally.ao,
        "samples_backface": result.tally.back_face_share(),
        **decorator_arrays(result),
    }
    with replacing(path) as file, zipfile.ZipFile(file, "w") as archive:
        for name, array in arrays.items():
            entry = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
            with archive.open(entry, "w", force_zip64=True) as member:
                np.lib.format.write_array(member, np.ascontiguousarray(array), allow_pickle=False)
