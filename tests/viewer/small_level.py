"""A level of a few hundred triangles in which everything occurs: open ground, a room, buried and flipped parts."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bake.pipeline import BakeRequest, run_bake

OPTIONS = {"rays": 16, "samples-per-face": "2:4", "tracer": "embree", "device": "cpu"}


def write_level(folder: Path) -> Path:
    """Writes the level as OBJ; returns its path."""
    lines: list[str] = []
    count = 0

    def add(name: str, positions: np.ndarray, faces: np.ndarray) -> None:
        nonlocal count
        lines.append(f"o {name}")
        lines.extend(f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in positions)
        lines.extend(f"f {a + count + 1} {b + count + 1} {c + count + 1}" for a, b, c in faces)
        count += len(positions)

    add("Ground", *_ground(12, 10.0))
    add("Room", *_box((0.0, 1.0, 0.0), (3.0, 2.0, 3.0), inward=True))
    add("Crate", *_box((4.0, 0.5, 1.0), (1.0, 1.0, 1.0)))
    add("Buried", *_box((-4.0, -0.2, -3.0), (1.0, 1.0, 1.0)))
    add("Flipped", *_box((-4.0, 1.5, 3.0), (1.0, 1.0, 1.0), inward=True))
    path = folder / "small.obj"
    path.write_text("\n".join(lines) + "\n")
    return path


def bake_level(scene: Path, result: Path) -> Path:
    """Bakes the level with the real pipeline; returns the result folder."""
    steps = run_bake(BakeRequest(scene, result, OPTIONS))
    for _ in steps:
        pass
    return result


def _ground(cells: int, size: float) -> tuple[np.ndarray, np.ndarray]:
    xs = np.linspace(-size / 2.0, size / 2.0, cells + 1)
    x, z = np.meshgrid(xs, xs, indexing="ij")
    y = 0.15 * np.sin(1.7 * x) * np.cos(1.3 * z)
    index = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = (index[i : cells + i, j : cells + j].ravel() for i, j in ((0, 0), (1, 0), (1, 1), (0, 1)))
    faces = np.concatenate((np.stack((a, c, b), 1), np.stack((a, d, c), 1)))
    return np.stack((x.ravel(), y.ravel(), z.ravel()), 1), faces


def _box(
    centre: tuple[float, float, float], size: tuple[float, float, float], *, inward: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    corners = np.array([[bit & 1, bit >> 1 & 1, bit >> 2 & 1] for bit in range(8)]) - 0.5
    quads = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
    faces = np.array([tri for a, b, c, d in quads for tri in ((a, b, c), (a, c, d))])
    return corners * np.array(size) + np.array(centre), faces[:, ::-1] if inward else faces
