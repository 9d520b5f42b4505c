"""Buildings cut from a block: boxes of air in boxes of solid, and the surface between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from assets.sample_level.mesh import Points, Solid, welded
from assets.sample_level.shapes import graded_between

SOLID = ""


@dataclass(frozen=True)
class Block:
    """A box that is solid, or filled with the air of a named space; later blocks overwrite earlier ones."""

    space: str
    low: tuple[float, float, float]
    high: tuple[float, float, float]


def surfaces(blocks: Sequence[Block], outside: str, coarse: float, fine: float) -> dict[tuple[str, str], Solid]:
    """The boundary between solid and air: closed, without overlaps, facing the air.

    Args:
        blocks: What is solid and what is not; all else is air of the space `outside`.
        outside: Name of the surrounding space.
        coarse: Edge of the tessellation away from corners [m].
        fine: Edge of the tessellation at corners [m].

    Returns:
        The surface by space and by "floor", "ceiling" or "walls".
    """
    lines = [_lines(blocks, axis, coarse, fine) for axis in range(3)]
    names = [SOLID, outside, *dict.fromkeys(b.space for b in blocks if b.space not in (SOLID, outside))]
    centres = [(line[1:] + line[:-1]) / 2 for line in lines]
    label = np.full([len(c) for c in centres], 1)
    for block in blocks:
        inside = [(c > lo) & (c < hi) for c, lo, hi in zip(centres, block.low, block.high, strict=True)]
        label[np.ix_(*inside)] = names.index(block.space)
    label = np.pad(label, 1, constant_values=1)
    found: dict[tuple[str, str], list[tuple[Points, bool]]] = {}
    for axis in range(3):
        for sign in (1, -1):
            air = np.roll(label, -sign, axis)
            side = "walls" if axis != 1 else "floor" if sign > 0 else "ceiling"
            for number, name in enumerate(names[1:], start=1):
                cells = np.argwhere((label == 0) & (air == number)) - 1
                if len(cells):
                    found.setdefault((name, side), []).append((_quads(cells, lines, axis, sign), sign > 0))
    return {key: _solid(found[key]) for key in sorted(found)}


def _lines(blocks: Sequence[Block], axis: int, coarse: float, fine: float) -> Points:
    # Rounded: 0.05 reached in two ways must not make a cell of no thickness.
    stops = sorted({round(v, 6) for block in blocks for v in (block.low[axis], block.high[axis])})
    return graded_between(stops, coarse, fine)


def _quads(cells: NDArray[np.intp], lines: list[Points], axis: int, sign: int) -> Points:
    """Corners of the cells' sides, shape (n, 4, 3), counter-clockwise about +axis; odd cells start one corner on."""
    u, v = (axis + 1) % 3, (axis + 2) % 3
    steps = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    corners = np.repeat(cells[:, None, :], 4, axis=1)
    corners[..., axis] += 1 if sign > 0 else 0
    corners[..., u] += steps[:, 0]
    corners[..., v] += steps[:, 1]
    points = np.stack([lines[i][corners[..., i]] for i in range(3)], axis=-1)
    odd = (cells[:, u] + cells[:, v]) % 2 == 1
    points[odd] = np.roll(points[odd], 1, axis=1)
    return points


def _solid(pieces: list[tuple[Points, bool]]) -> Solid:
    positions = np.concatenate([points.reshape(-1, 3) for points, _ in pieces])
    quads = np.arange(len(positions)).reshape(-1, 4)
    forward = np.concatenate([np.full(len(points), keep) for points, keep in pieces])
    quads = np.where(forward[:, None], quads, quads[:, ::-1])
    return welded(Solid(positions, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])))
