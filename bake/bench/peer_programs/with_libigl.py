"""libigl's ambient occlusion at the vertices with EFFORT rays. It knows no greatest distance."""

from __future__ import annotations

import sys
import time

import numpy as np


def main() -> int:
    """Bakes; the exit code is 3 where the library is missing."""
    try:
        import igl
    except ImportError:
        return 3

    mesh_file, output, effort = sys.argv[1], sys.argv[2], int(sys.argv[4])
    begin = time.perf_counter()
    with np.load(mesh_file) as stored:
        positions, faces = stored["positions"], stored["faces"]
    normals = igl.per_vertex_normals(positions, faces)
    if isinstance(normals, tuple):
        normals = normals[0]
    occluded = igl.ambient_occlusion(positions, faces, positions, np.nan_to_num(normals), effort)
    np.save(output, 1.0 - np.asarray(occluded, np.float64).ravel())
    print(time.perf_counter() - begin)
    return 0


if __name__ == "__main__":
    sys.exit(main())
