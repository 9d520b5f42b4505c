"""An explanation in the view: rays by what they count for, and samples by their weight."""

from __future__ import annotations

import numpy as np

from bake.explain.types import Explanation
from bake.types import Float32Array, Int32Array, UInt8Array
from viewer.colormaps import BLUE_WHITE_ORANGE, CIVIDIS
from viewer.overlays import OverlayPoints

Shapes = tuple[Float32Array, Int32Array, UInt8Array]

MOST_RAYS = 4096
OPEN_SHARE = 0.25
"""How far open rays are drawn, as a share of how far the farthest others are."""


def ray_lines(explanation: Explanation, column: int, *, occluder: int = -1, samples: int = 4) -> Shapes | None:
    """Rays of the heaviest samples as lines to what stopped them, from dark where they count little to light.

    Args:
        explanation: Of the spot.
        column: Whose ρ.
        occluder: Only rays that this object stops or dims; all with -1.
        samples: From how many samples, the heaviest first.
    """
    rays = explanation.rays.first(min(samples, len(explanation.rays.sample)))
    if not len(rays.sample):
        return None
    counts_for = rays.open_share[:, :, column]
    chosen = np.ones(rays.face.shape, np.bool_)
    if occluder >= 0:
        chosen = rays.object == occluder
        crossed = rays.crossings.ray[rays.crossings.object == occluder]
        chosen.reshape(-1)[crossed] = True
    row, ray = np.nonzero(chosen)
    step = max(1, -(-len(row) // MOST_RAYS))
    row, ray = row[::step], ray[::step]
    if not len(row):
        return None
    stopped = rays.face[row, ray] >= 0
    reach = np.minimum(rays.distance[row, ray], _reach(explanation, column))
    reach = np.where(stopped, reach, OPEN_SHARE * _reach(explanation, column))
    start = rays.origin[row]
    end = start + rays.direction[row, ray] * reach[:, None]
    positions = np.stack((start, end), axis=1).reshape(-1, 3).astype(np.float32)
    cells = np.arange(2 * len(row), dtype=np.int32).reshape(-1, 2)
    colors = np.repeat(CIVIDIS.colors(counts_for[row, ray].astype(np.float32), 0.0, 1.0), 2, axis=0)
    return positions, cells, colors


def sample_marks(explanation: Explanation) -> OverlayPoints:
    """The samples by weight: orange those that count for the value, blue those that count against it."""
    samples = explanation.samples
    order = np.argsort(np.abs(samples.weight), kind="stable")
    weight = samples.weight[order].astype(np.float32)
    reach = float(np.abs(weight).max()) if len(weight) else 1.0
    scaled = np.sign(weight) * np.sqrt(np.abs(weight) / max(reach, 1e-12))  # light ones stay visible beside heavy ones
    lifted = samples.position[order] + 2e-3 * samples.normal[order]
    return OverlayPoints(lifted.astype(np.float32), BLUE_WHITE_ORANGE.colors(scaled, -1.0, 1.0), len(weight))


def _reach(explanation: Explanation, column: int) -> float:
    """How far rays are drawn: three times the distance at which a blocker counts half."""
    return 3.0 * explanation.distances[column]
