"""From what the scene and the settings say to regions that are linked and know their free space."""

from __future__ import annotations

import time
from collections.abc import Generator
from pathlib import Path

import numpy as np

from bake.errors import SceneError
from bake.region_types import GRID, RegionGraph
from bake.regions.boundaries import measure_openings
from bake.regions.free_space import FreeSpace
from bake.regions.links import meeting_pairs
from bake.regions.rays import Nearest
from bake.regions.region_file import FileLink, RegionFile, from_boxes, read_region_file
from bake.regions.space import RegionSpace
from bake.regions.validity import reachable
from bake.settings import BakeSettings
from bake.types import BoolArray, Finding, Float64Array, Int32Array, Progress, Scene, World

THINNEST = 64.0 * 2.0**-24
"""Thinnest box edge in units of its farthest coordinate: grid points are float32, and eight must differ."""


def regions_asked_for(scene: Scene, settings: BakeSettings) -> str:
    """Where regions come from: "" (none), "automatic", "scene", or the path of a file that exists or not.

    A relative path is taken from the scene's folder; where it leads to nothing there, from the working folder.
    """
    if settings.regions == "none" or (settings.regions == "scene" and not scene.regions):
        return ""
    if settings.regions in ("scene", "auto"):
        return {"scene": "scene", "auto": "automatic"}[settings.regions]
    beside = scene.path.parent / settings.regions
    here = Path(settings.regions)
    return str(here if here.exists() and not beside.exists() else beside)


def make_graph(
    scene: Scene, world: World, settings: BakeSettings, *, nearest: Nearest
) -> Generator[Progress, None, RegionSpace | None]:
    """Regions, links and valid points as the settings ask for; nothing is baked.

    Everything is traced in the caller's thread.

    Args:
        scene: For its side file's regions, its folder and its up axis.
        world: The same scene, flattened.
        settings: `regions` and `region_cell`.
        nearest: The tracer's closest hits.

    Returns:
        None if no regions are asked for.

    Raises:
        SceneError: the region file cannot be used, none of its regions touches the scene, or no floor was found.
    """
    source = regions_asked_for(scene, settings)
    if not source:
        return None
    begin = time.perf_counter()
    free = FreeSpace(world, nearest)
    stated = _stated(scene, source)
    kept, findings = _within_world(stated, world)
    minimum, maximum, seed = (
        np.array([values(stated, i) for i in kept], np.float64).reshape(-1, 3) - world.origin
        for values in (_minimum, _maximum, _seed)
    )
    yield Progress("regions", 0, len(kept), time.perf_counter() - begin)
    reach = reachable(minimum, maximum, seed, free, down=_down(scene))
    valid = _overruled(reach.valid, stated, kept)
    yield Progress("regions", len(kept), len(kept), time.perf_counter() - begin)
    pairs, areas, centres, link_findings = _links(stated, kept, minimum, maximum, valid, reach.seed, free, world)
    names = tuple(stated.regions[i].name for i in kept)
    graph = RegionGraph(
        names, minimum, maximum, reach.seed, pairs, areas, centres, "scene" if source == "scene" else "file"
    )
    findings += link_findings + _without_points(names, valid)
    return RegionSpace(graph, valid.ravel(), tuple(findings), float("nan"), free.rays)


def _stated(scene: Scene, source: str) -> RegionFile:
    if source == "scene":
        return from_boxes(scene.regions, str(scene.path))
    return read_region_file(Path(source))


def _minimum(stated: RegionFile, number: int) -> tuple[float, ...]:
    return stated.regions[number].minimum


def _maximum(stated: RegionFile, number: int) -> tuple[float, ...]:
    return stated.regions[number].maximum


def _seed(stated: RegionFile, number: int) -> tuple[float, ...]:
    return stated.regions[number].seed or (np.nan, np.nan, np.nan)


def _down(scene: Scene) -> Float64Array | None:
    if scene.up_axis < 0:
        return None
    down = np.zeros(3)
    down[scene.up_axis] = -1.0
    return down


def _within_world(stated: RegionFile, world: World) -> tuple[list[int], list[Finding]]:
    """Numbers of the regions that can be used, and what is to be said about the others.

    Raises:
        SceneError: none can be used, or one is too thin.
    """
    used = world.positions[np.unique(world.faces[world.face_casts])] if world.face_casts.any() else world.positions
    low, high = used.min(axis=0), used.max(axis=0)
    margin = 0.5 * float(np.linalg.norm(high - low))
    kept: list[int] = []
    findings: list[Finding] = []
    for number, region in enumerate(stated.regions):
        first, last = np.array(region.minimum) - world.origin, np.array(region.maximum) - world.origin
        thinnest = float((last - first).min())
        if not thinnest > THINNEST * float(np.abs([first, last]).max()):
            raise SceneError(
                f"region {region.name[:60]!r} is {thinnest:.3g} m thin, less than can be told apart there",
                where=stated.where,
                remedy="make it thicker",
            )
        if (last < low - margin).any() or (first > high + margin).any():
            detail = f"region {region.name[:60]!r} lies far outside the scene; it is left out with its links"
            findings.append(Finding(stated.where, "region-outside-scene", 1, detail, "set-aside"))
            continue
        kept.append(number)
    if stated.regions and not kept:
        raise SceneError(
            f"all {len(stated.regions):,} regions lie far outside the scene",
            where=stated.where,
            remedy="state boxes in metres, in the scene's world coordinates",
        )
    return kept, findings


def _overruled(valid: BoolArray, stated: RegionFile, kept: list[int]) -> BoolArray:
    """Valid points, where the file's bits win."""
    valid = valid.copy()
    for row, number in enumerate(kept):
        bits = stated.regions[number].valid
        if bits is not None:
            valid[row] = bits
    return valid


def _links(
    stated: RegionFile,
    kept: list[int],
    minimum: Float64Array,
    maximum: Float64Array,
    valid: BoolArray,
    seed: Float64Array,
    free: FreeSpace,
    world: World,
) -> tuple[Int32Array, Float64Array, Float64Array, list[Finding]]:
    """Links as the file states them, measured where it does not; or where boxes meet and something is open."""
    if stated.links is None:
        pairs = meeting_pairs(minimum, maximum)
        openings = measure_openings(minimum, maximum, valid, seed, pairs, free)
        is_open = openings.area > 0.0
        return pairs[is_open], openings.area[is_open], openings.centre[is_open], []
    row = {stated.regions[number].name: i for i, number in enumerate(kept)}
    links = [link for link in stated.links if link.a in row and link.b in row]
    pairs = np.array([sorted((row[link.a], row[link.b])) for link in links], np.int32).reshape(-1, 2)
    openings = measure_openings(minimum, maximum, valid, seed, pairs, free)
    unsaid = (np.nan, np.nan, np.nan)
    area = np.array([_value(link.area, measured) for link, measured in zip(links, openings.area, strict=True)])
    stated_centre = np.array([link.centre or unsaid for link in links], np.float64).reshape(-1, 3) - world.origin
    centre = np.where(np.isfinite(stated_centre), stated_centre, openings.centre)
    good = (area > 0.0) & np.isfinite(centre).all(axis=1)
    findings = [_closed(link, stated) for link, fine in zip(links, good, strict=True) if not fine]
    order = np.flatnonzero(good)
    order = order[np.lexsort((pairs[order, 1], pairs[order, 0]))]
    return pairs[order], area[order].astype(np.float64), centre[order], findings


def _value(stated: float | None, measured: float) -> float:
    return float(measured) if stated is None else stated


def _closed(link: FileLink, stated: RegionFile) -> Finding:
    detail = (
        f"nothing is open between {link.a[:60]!r} and {link.b[:60]!r}; the link is left out, unless it has an area "
        "and a centre"
    )
    return Finding(stated.where, "closed-link", 1, detail)


def _without_points(names: tuple[str, ...], valid: BoolArray) -> list[Finding]:
    empty = np.flatnonzero(~valid.any(axis=1))
    if len(empty) == 0:
        return []
    shown = ", ".join(names[i][:40] for i in empty[:5]) + (" …" if len(empty) > 5 else "")
    detail = f"none of the {GRID**3} points is in reachable free space: {shown}"
    return [Finding("regions", "region-without-points", len(empty), detail)]
