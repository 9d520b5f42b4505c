"""From what the scene and the settings say to regions that are linked and know their free space."""

from __future__ import annotations

import dataclasses
from collections.abc import Generator
from pathlib import Path

import numpy as np

from bake.region_types import GRID, RegionGraph
from bake.regions.automatic import STEPS, AutomaticRegions, automatic_regions, no_floor
from bake.regions.boundaries import Openings, measure_openings
from bake.regions.coverage import coverage
from bake.regions.floor_below import Floor
from bake.regions.free_space import FreeSpace
from bake.regions.links import meeting_pairs
from bake.regions.obstacles import stopping_faces
from bake.regions.rays import Nearest
from bake.regions.region_document import RegionFile, from_boxes
from bake.regions.region_file import read_region_file
from bake.regions.space import RegionSpace
from bake.regions.stated import boxes_in_world, links_between, open_links
from bake.regions.upright import find_up
from bake.regions.validity import reachable
from bake.settings import BakeSettings
from bake.types import BoolArray, Finding, Float64Array, Int32Array, Progress, Scene, World

_STAGE = "regions"


def regions_asked_for(scene: Scene, settings: BakeSettings) -> str:
    """Where regions come from: "" (none), "automatic", "scene", or the path of a file that exists or not.

    A relative path is taken from the scene's folder; where it leads to nothing there, from the working folder. By
    default the setting is "scene": the side file's regions, or none. That tells it from "none", which always is none.
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
        scene: For its side file's regions, its folder, its materials and its up axis.
        world: The same scene, flattened.
        settings: `regions`, `region_cell` and `ground`.
        nearest: The tracer's closest hits.

    Returns:
        None if no regions are asked for.

    Raises:
        SceneError: the region file cannot be used, none of its regions touches the scene, or no floor was found.
    """
    source = regions_asked_for(scene, settings)
    if not source:
        return None
    stops = stopping_faces(scene, world)
    free, floor = FreeSpace(world, nearest, stops), Floor(nearest, find_up(scene, world, settings), stops)
    if source == "automatic":
        return (yield from _automatic(scene, world, settings, nearest, free, floor, None))
    stated = from_boxes(scene.regions, str(scene.path)) if source == "scene" else read_region_file(Path(source))
    if stated.seeds:
        return (yield from _automatic(scene, world, settings, nearest, free, floor, stated))
    return (yield from _stated(stated, "scene" if source == "scene" else "file", world, free, floor))


def _stated(
    stated: RegionFile, origin: str, world: World, free: FreeSpace, floor: Floor
) -> Generator[Progress, None, RegionSpace]:
    """Regions as stated: what is missing is found, what is said wins."""
    boxes, findings = boxes_in_world(stated, world)
    yield Progress(_STAGE, 0, 2)
    reach = reachable(boxes.minimum, boxes.maximum, boxes.seed, free, down=floor.up.down)
    valid = np.where(boxes.has_bits[:, None], boxes.bits, reach.valid)
    yield Progress(_STAGE, 1, 2)
    links = links_between(stated, boxes, world)
    openings = measure_openings(boxes.minimum, boxes.maximum, valid, reach.seed, links.pairs, free)
    openings = _crossed(openings, links.pairs, boxes.minimum, boxes.maximum, floor)
    pairs, area, centre, closed = open_links(stated, links, openings)
    yield Progress(_STAGE, 2, 2)
    graph = RegionGraph(boxes.names, boxes.minimum, boxes.maximum, reach.seed, pairs, area, centre, origin)
    findings += closed + _without_points(boxes.names, valid, stated.where)
    return RegionSpace(graph, valid.ravel(), tuple(findings), float("nan"), free.rays)


def _automatic(
    scene: Scene,
    world: World,
    settings: BakeSettings,
    nearest: Nearest,
    free: FreeSpace,
    floor: Floor,
    stated: RegionFile | None,
) -> Generator[Progress, None, RegionSpace]:
    """Regions made from the geometry; those in which nothing can be reached are dropped."""
    seeds = stated.seeds if stated else ()
    made: AutomaticRegions = yield from automatic_regions(scene, world, settings, nearest, seeds)
    reach = reachable(made.minimum, made.maximum, made.seed, free, down=floor.up.down)
    yield Progress(_STAGE, STEPS - 2, STEPS)
    kept = np.flatnonzero(reach.valid.any(axis=1))
    if len(kept) == 0:
        raise no_floor(scene)
    minimum, maximum, seed, valid = made.minimum[kept], made.maximum[kept], made.seed[kept], reach.valid[kept]
    pairs = meeting_pairs(minimum, maximum)
    openings = measure_openings(minimum, maximum, valid, seed, pairs, free)
    openings = _crossed(openings, pairs, minimum, maximum, floor)
    yield Progress(_STAGE, STEPS - 1, STEPS)
    is_open = openings.area > 0.0
    digits = len(str(len(kept)))
    names = tuple(f"auto {number:0{digits}d}" for number in range(1, len(kept) + 1))
    graph = RegionGraph(
        names, minimum, maximum, seed, pairs[is_open], openings.area[is_open], openings.centre[is_open], "automatic"
    )
    share = coverage(minimum, maximum, valid, seed, made.points, free)
    yield Progress(_STAGE, STEPS, STEPS)
    return RegionSpace(graph, valid.ravel(), made.findings, share, free.rays + made.rays)


def _crossed(
    openings: Openings, pairs: Int32Array, minimum: Float64Array, maximum: Float64Array, floor: Floor
) -> Openings:
    """The same, their middles where characters cross them: there the models of both sides shall agree."""
    return dataclasses.replace(openings, centre=floor.lowered_centres(pairs, openings.centre, minimum, maximum))


def _without_points(names: tuple[str, ...], valid: BoolArray, where: str) -> list[Finding]:
    empty: list[int] = np.flatnonzero(~valid.any(axis=1)).tolist()
    if len(empty) == 0:
        return []
    shown = ", ".join(names[i][:40] for i in empty[:5]) + (" …" if len(empty) > 5 else "")
    detail = f"none of the {GRID**3} points is in reachable free space: {shown}"
    return [Finding(where, "region-without-points", len(empty), detail)]
