"""The script that everybody writes first: EFFORT cosine-weighted random rays from each vertex, by Open3D."""

from __future__ import annotations

import sys
import time

import numpy as np


def main() -> int:
    """Bakes; the exit code is 3 where the library is missing."""
    try:
        import open3d as o3d
    except ImportError:
        return 3

    mesh_file, output, max_distance, effort = sys.argv[1], sys.argv[2], float(sys.argv[3]), int(sys.argv[4])
    begin = time.perf_counter()
    with np.load(mesh_file) as stored:
        positions, faces = stored["positions"], stored["faces"]
    mesh = o3d.t.geometry.TriangleMesh(positions.astype(np.float32), faces.astype(np.int32))
    normals = mesh.compute_vertex_normals().vertex.normals.numpy()
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(mesh)
    rng = np.random.default_rng(0)
    origins = (positions + 1e-3 * normals).astype(np.float32)
    open_rays = np.zeros(len(positions))
    for _ in range(effort):
        directions = rng.normal(size=normals.shape)
        directions = normals + directions / np.linalg.norm(directions, axis=1, keepdims=True)
        rays = np.concatenate([origins, directions], axis=1).astype(np.float32)
        distance = scene.cast_rays(o3d.core.Tensor(rays))["t_hit"].numpy() * np.linalg.norm(directions, axis=1)
        open_rays += distance >= max_distance
    np.save(output, open_rays / effort)
    print(time.perf_counter() - begin)
    return 0


if __name__ == "__main__":
    sys.exit(main())
