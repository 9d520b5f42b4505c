"""Regions made from the geometry alone: solids, floors, rooms."""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np

from bake.errors import SceneError
from bake.regions.columns import Plan, make_plan, make_solids
from bake.regions.floors import STEP, find_floors
from bake.regions.obstacles import stopping_faces
from bake.regions.rays import Nearest
from bake.regions.rooms import Rooms, merge_cells
from bake.regions.upright import find_up
from bake.regions.walkable import Walkable, choose_walkable
from bake.settings import BakeSettings
from bake.types import Finding, Float64Array, Progress, Scene, World

MOST_COLUMNS = 2_000_000
"""Cells become coarser where the plan would need more; that bounds memory at about 1 GB and time at some seconds."""

MOST_REGIONS = 2000

LONGEST = 12.0
"""Metres: longest edge of a region in plan, unless the level is so wide that it would need too many."""

STEPS = 7
"""Steps from the geometry to linked regions, of which five are taken here, the rest in `make_graph`."""

_WANTED = 250  # open floor is cut into about so many regions at least before they become larger
_OUTLYING = 0.5  # percent of the corners at either end that a far backdrop may have to itself
_MARGIN = 0.05  # of the rest's extent, kept around it
_BODY = 1.0  # metres above the floor, where coverage is asked for
_MOST_POINTS = 20_000


@dataclass(frozen=True, slots=True)
class AutomaticRegions:
    """What the geometry suggests.

    Attributes:
        minimum, maximum: Shape (r, 3), metres relative to `World.origin`.
        seed: Shape (r, 3).
        points: Shape (n, 3): evenly chosen points a metre above the walkable floor, to measure coverage at.
        findings: What was coarsened or left out.
        rays: Rays traced for it.
    """

    minimum: Float64Array
    maximum: Float64Array
    seed: Float64Array
    points: Float64Array
    findings: tuple[Finding, ...]
    rays: int


def automatic_regions(
    scene: Scene, world: World, settings: BakeSettings, nearest: Nearest, seeds: Sequence[Sequence[float]] = ()
) -> Generator[Progress, None, AutomaticRegions]:
    """Boxes over the floor on which a character can walk.

    It needs 1.8 m above its head's way, climbs steps of 0.5 m and slopes of 50°, and is lit up to 2.5 m or the ceiling.
    Missed are passages narrower than one or two cells, and floors that only a jump or a ladder reaches and that are
    small or fall off on most sides, as roofs do.

    Args:
        scene: For its materials and its up axis.
        world: The same scene, flattened.
        settings: `region_cell`, and `ground` for what points up.
        nearest: The tracer's closest hits.
        seeds: World positions; only floors below them are taken. Without, all that are likely.

    Raises:
        SceneError: no floor was found.
    """
    up = find_up(scene, world, settings)
    stops = stopping_faces(scene, world)
    corners = up.turned(world.positions[world.faces[stops]])
    where = str(scene.path)
    if len(corners) == 0:
        raise no_floor(scene)
    turned_seeds = up.turned(np.array(seeds, np.float64).reshape(-1, 3) - world.origin) if len(seeds) else None
    plan, findings = _plan(corners, settings.region_cell, turned_seeds, where)
    yield Progress("regions", 0, STEPS)
    solids = make_solids(corners, world.face_two_sided[stops], plan, climb=STEP)
    yield Progress("regions", 1, STEPS)
    floors, rays = find_floors(solids, plan, up, nearest, world.face_two_sided)
    yield Progress("regions", 2, STEPS)
    space = choose_walkable(floors, turned_seeds)
    if not space.walked.any():
        raise no_floor(scene)
    yield Progress("regions", 3, STEPS)
    area = float(space.walked.sum()) * plan.cell**2
    longest = max(LONGEST, math.sqrt(area / _WANTED), 4.0 * plan.cell)
    rooms = merge_cells(space, longest)
    yield Progress("regions", 4, STEPS)
    chosen = np.argsort(-rooms.fresh, kind="stable")[:MOST_REGIONS]
    chosen = chosen[np.lexsort((rooms.low[chosen, 1], rooms.low[chosen, 0]))]
    findings += _about(rooms, len(chosen), longest, where)
    minimum, maximum = up.boxes(rooms.low[chosen], rooms.high[chosen])
    points = up.world(_body_points(space))
    return AutomaticRegions(minimum, maximum, up.world(rooms.seed[chosen]), points, tuple(findings), rays)


def no_floor(scene: Scene) -> SceneError:
    """The error that says that nothing can be made."""
    return SceneError(
        "no floor was found to make regions over",
        where=str(scene.path),
        remedy="state regions in a file; if up is not up, say so by --ground",
    )


def _plan(corners: Float64Array, cell: float, seeds: Float64Array | None, where: str) -> tuple[Plan, list[Finding]]:
    """The columns to fill: of all that there is, or, where that is too wide, of where nearly all faces are."""
    points = corners.reshape(-1, 3)
    low, high = points.min(axis=0), points.max(axis=0)
    findings: list[Finding] = []
    if math.prod(high[:2] - low[:2]) > MOST_COLUMNS * cell**2:
        inner_low, inner_high = np.percentile(points[:, :2], [_OUTLYING, 100.0 - _OUTLYING], axis=0)
        margin = _MARGIN * (inner_high - inner_low)
        inner_low, inner_high = inner_low - margin, inner_high + margin
        if seeds is not None:
            inner_low = np.minimum(inner_low, seeds[:, :2].min(axis=0) - LONGEST)
            inner_high = np.maximum(inner_high, seeds[:, :2].max(axis=0) + LONGEST)
        before = float(math.prod(high[:2] - low[:2]))
        low[:2], high[:2] = np.maximum(low[:2], inner_low), np.minimum(high[:2], inner_high)
        size = high[:2] - low[:2]
        if math.prod(size) < 0.9 * before:
            detail = (
                f"automatic regions cover the middle {size[0]:,.0f} m x {size[1]:,.0f} m, where 98 % of the faces lie"
            )
            findings.append(Finding(where, "regions-leave-outskirts", 1, detail, "info"))
    coarse = max(cell, math.sqrt(math.prod(high[:2] - low[:2]) / MOST_COLUMNS))
    if coarse > 1.01 * cell:
        detail = (
            f"the level is so wide that free space was found in cells of {coarse:.2f} m instead of {cell:g} m; "
            "narrow passages are missed (is a unit of the file a metre?)"
        )
        findings.append(Finding(where, "region-cell-coarsened", 1, detail))
    return make_plan(low, high, coarse), findings


def _about(rooms: Rooms, kept: int, longest: float, where: str) -> list[Finding]:
    findings: list[Finding] = []
    if longest > LONGEST:
        detail = f"the level is so wide that its regions are up to {longest:.0f} m long instead of {LONGEST:g} m"
        findings.append(Finding(where, "regions-enlarged", 1, detail, "info"))
    if kept < len(rooms):
        left = np.sort(rooms.fresh)[: len(rooms) - kept].sum() / rooms.fresh.sum()
        detail = f"the smallest regions above {MOST_REGIONS:,} are left out, with {100.0 * left:.1f} % of the floor"
        findings.append(Finding(where, "too-many-regions", len(rooms) - kept, detail))
    return findings


def _body_points(space: Walkable) -> Float64Array:
    walked = np.flatnonzero(space.walked)
    step = max(1, math.ceil(len(walked) / _MOST_POINTS))
    return space.floors.bodies(_BODY)[walked[step // 2 :: step]]
