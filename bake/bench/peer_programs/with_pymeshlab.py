"""MeshLab's ambient occlusion at the vertices with EFFORT rays. It knows no greatest distance."""

from __future__ import annotations

import sys
import time

import numpy as np


def main() -> int:
    """Bakes; the exit code is 3 where the library is missing."""
    try:
        import pymeshlab
    except ImportError:
        return 3

    mesh_file, output, effort = sys.argv[1], sys.argv[2], int(sys.argv[4])
    begin = time.perf_counter()
    with np.load(mesh_file) as stored:
        positions, faces = stored["positions"], stored["faces"]
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(positions, faces))
    meshes.compute_scalar_ambient_occlusion(rays=effort)
    open_rays = meshes.current_mesh().vertex_scalar_array()
    np.save(output, open_rays / max(open_rays.max(), 1e-30))  # it counts without saying out of how many
    print(time.perf_counter() - begin)
    return 0


if __name__ == "__main__":
    sys.exit(main())
