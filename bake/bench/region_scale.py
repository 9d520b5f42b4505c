"""How long many regions take: the regularisation, and everything that a slider of the window sets off."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from bake.bench.table import Measurements
from bake.region_types import GRID, PARAMETERS, PointState, RegionGraph, RegionModels, RegionPoints, Regions
from bake.regions.crossings import find_crossings
from bake.regions.grid import grid_positions
from bake.regions.mismatch import boundary_mismatch
from bake.regions.regularise import regularise
from bake.settings import BakeSettings
from bake.types import Float64Array
from bake.walk import WalkOptions, lay_out, path_through, simulate

_ROUNDS = 5
_MANY, _SOME = (20, 10, 10), (10, 2, 10)
_EDGE = 4.0
_MANY_S, _SLIDER_S = 2.0, 0.1


def measure_scale() -> Measurements:
    """2,000 regions regularised; with 200, a change of β and one of the half-life, up to the figures of a walk."""
    many, some = _block_of_regions(_MANY), _block_of_regions(_SOME)
    rows: list[dict[str, Any]] = []
    for blocks, gate in ((many, _MANY_S), (some, _SLIDER_S)):
        crossings = find_crossings(blocks.graph, blocks.points)
        rows.append(_row("find crossings", blocks, partial(find_crossings, blocks.graph, blocks.points), None))
        work = partial(regularise, blocks.fitted, blocks.graph, beta=BakeSettings().region_beta, crossings=crossings)
        rows.append(_row("regularise", blocks, work, gate))
    path, options = path_through(_meander(some)), WalkOptions()
    course = lay_out(some, path, speed=options.speed, frame_rate=options.frame_rate)
    frames = len(course.frames)
    rows.append(
        {
            **_row("walk anew, laid out", some, lambda: simulate(some, path, options, course=course), _SLIDER_S),
            "frames": frames,
        }
    )
    rows.append({**_row("lay a walk out", some, lambda: _laid_out(some, options), None), "frames": frames})
    note = f"synthetic boxes of {_EDGE:g} m side by side; median of {_ROUNDS}"
    return Measurements("region scale", rows, [note], seeds={"models": 1})


def _laid_out(regions: Regions, options: WalkOptions) -> None:
    lay_out(regions, path_through(_meander(regions)), speed=options.speed, frame_rate=options.frame_rate)


def _row(what: str, regions: Regions, work: Callable[[], Any], gate: float | None) -> dict[str, Any]:
    taken: list[float] = []
    for _ in range(_ROUNDS):
        begin = time.process_time()
        work()
        taken.append(time.process_time() - begin)
    seconds = float(np.median(taken))
    row = {"what": what, "regions": len(regions.graph), "links": len(regions.graph.link), "CPU s": seconds}
    return row if gate is None else {**row, "gate s": gate, "passed": seconds <= gate}


def _meander(regions: Regions) -> Float64Array:
    """A way through a hundred regions."""
    middle = 0.5 * (regions.graph.minimum + regions.graph.maximum)
    lowest = middle[middle[:, 1] < _EDGE]
    order = np.lexsort((np.where((lowest[:, 0] // _EDGE) % 2 == 0, 1, -1) * lowest[:, 2], lowest[:, 0]))
    return lowest[order][:100]


def _block_of_regions(shape: tuple[int, int, int]) -> Regions:
    """Boxes in a block, each linked with up to six others, with models that differ at random."""
    random = np.random.default_rng(1)
    count = int(np.prod(shape))
    place = np.stack(np.unravel_index(np.arange(count), shape), axis=1).astype(np.float64)
    low, high = place * _EDGE, (place + 1.0) * _EDGE
    number = np.arange(count).reshape(shape)
    links = [np.stack([number[:-1].ravel(), number[1:].ravel()], axis=1)]
    links += [np.stack([number[:, :-1].ravel(), number[:, 1:].ravel()], axis=1)]
    links += [np.stack([number[:, :, :-1].ravel(), number[:, :, 1:].ravel()], axis=1)]
    link = np.concatenate(links).astype(np.int32)
    middle = 0.5 * (low + high)
    graph = RegionGraph(
        names=tuple(f"box {i}" for i in range(count)),
        minimum=low,
        maximum=high,
        seed=middle,
        link=link,
        link_area=random.uniform(0.5, _EDGE**2, len(link)),
        link_centre=middle[link].mean(axis=1),
        origin="automatic",
    )
    coefficients = random.normal(scale=0.02, size=(count, PARAMETERS, 9, 2))
    coefficients[:, 0, 0] += 1.5
    models = RegionModels(
        centre=middle,
        coefficients=coefficients.astype(np.float32),
        terms=np.full(count, 2**PARAMETERS - 1, np.uint8),
        centre_kind=np.zeros(count, np.uint8),
        rmse=np.zeros((count, 2), np.float32),
    )
    points = RegionPoints(
        position=grid_positions(graph).astype(np.float32),
        state=np.full(count * GRID**3, PointState.VALID, np.uint8),
        back_face_share=np.zeros(count * GRID**3, np.float32),
        traced=np.zeros(0, np.int32),
        sh=np.zeros((0, 9, 2), np.float32),
        windowed=np.zeros(0, np.uint8),
    )
    mismatch = boundary_mismatch(models, graph)
    owner = np.arange(count, dtype=np.int32)
    return Regions(graph, points, models, models, mismatch, mismatch, (), np.zeros((0, 2), np.float32), owner)
