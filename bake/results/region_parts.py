"""Which stored arrays dynamic regions own, and what the manifest says of them.

"regions": {"names": [...], "origin": "automatic", "absorbed": [["closet", "hall"], ...]}, or null without regions
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.errors import ResultError
from bake.region_types import (
    GRID,
    PARAMETERS,
    CentreKind,
    PointState,
    RegionGraph,
    RegionModels,
    RegionPoints,
    Regions,
)
from bake.results.parts import within
from bake.types import BakeResult

REGION_PARTS = ("region_graph", "region_points", "region_fits", "region_models", "regions")
_HARMONICS = 9


def region_owners(regions: Regions | None) -> dict[str, Any]:
    """Owner of arrays by name; none without regions."""
    if regions is None:
        return {}
    parts = (regions.graph, regions.points, regions.fitted, regions.regularised, regions)
    return dict(zip(REGION_PARTS, parts, strict=True))


def regions_json(regions: Regions | None) -> dict[str, Any] | None:
    """What is no array of the regions."""
    if regions is None:
        return None
    graph = regions.graph
    return {"names": list(graph.names), "origin": graph.origin, "absorbed": [list(pair) for pair in regions.absorbed]}


def checked_regions(said: Any) -> Mapping[str, Any] | None:
    """What `regions_json` wrote.

    Raises:
        KeyError, TypeError, ValueError: something else.
    """
    if said is None:
        return None
    names, absorbed = [str(name) for name in said["names"]], [(str(a), str(b)) for a, b in said["absorbed"]]
    if len(set(names)) != len(names) or not {name for pair in absorbed for name in pair} <= set(names):
        raise ValueError("regions")
    return {"names": tuple(names), "origin": str(said["origin"]), "absorbed": tuple(absorbed)}


def regions_of(said: Mapping[str, Any] | None, arrays: Mapping[str, Mapping[str, NDArray[Any]]]) -> Regions | None:
    """The regions from what the manifest says of them and their arrays by owner and attribute.

    Raises:
        KeyError, TypeError: they do not fit each other.
    """
    if said is None:
        return None
    parts: list[dict[str, Any]] = [dict(arrays[name]) for name in REGION_PARTS]
    graph, points, fits, models, own = parts
    return Regions(
        graph=RegionGraph(**graph, names=said["names"], origin=said["origin"]),
        points=RegionPoints(**points),
        fitted=RegionModels(**fits),
        regularised=RegionModels(**models),
        absorbed=said["absorbed"],
        **own,
    )


def check_regions(folder: Path, result: BakeResult) -> None:
    """Array lengths and index ranges of the regions.

    Raises:
        ResultError: they do not fit each other or the settings.
    """
    regions = result.regions
    if regions is None:
        return
    graph, points = regions.graph, regions.points
    count, links, grid, columns = len(graph), len(graph.link), len(graph) * GRID**3, result.settings.distance_count
    ends = np.asarray(graph.link)
    agrees = (
        all(len(array) == count for array in (graph.minimum, graph.maximum, graph.seed, regions.owner))
        and len(graph.link_area) == len(graph.link_centre) == links
        and within(ends, count)
        and bool((ends[:, 0] < ends[:, 1]).all())
        and all(len(array) == grid for array in (points.position, points.state, points.back_face_share))
        and within(points.state, len(PointState))
        and within(points.traced, grid)
        and bool((np.diff(points.traced) > 0).all())
        and points.sh.shape == (len(points.traced), _HARMONICS, columns)
        and len(points.windowed) == len(points.traced)
        and all(_fits(models, count, columns) for models in (regions.fitted, regions.regularised))
        and regions.mismatch_before.shape == regions.mismatch_after.shape == (links, columns)
        and regions.absorbed_error.shape == (len(regions.absorbed), columns)
        and within(regions.owner, count)
        and bool((regions.owner[regions.owner] == regions.owner).all())
    )
    if not agrees:
        raise ResultError("its regions do not fit each other", where=str(folder), remedy="bake again")


def _fits(models: RegionModels, count: int, columns: int) -> bool:
    return (
        len(models.centre) == len(models.terms) == len(models.centre_kind) == count
        and models.coefficients.shape == (count, PARAMETERS, _HARMONICS, columns)
        and models.rmse.shape == (count, columns)
        and within(models.centre_kind, len(CentreKind))
    )
