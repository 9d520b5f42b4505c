"""A walk through a stored result: what is needed of it is made from the result alone."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

from bake.devices import resolve
from bake.errors import InputError
from bake.regions.upright import Upright, find_up
from bake.stages import patiently
from bake.trace import Tracer, create_tracer
from bake.types import BakeResult, BoolArray, Progress, Regions, Scene
from bake.walk.simulate import simulate
from bake.walk.tour import tour
from bake.walk.truth import trace_truth
from bake.walk.types import PathTruth, Walk, WalkOptions, WalkPath


@dataclass(frozen=True, slots=True)
class WalkOutcome:
    """What a walk needed and gave.

    Attributes:
        path: Where it led.
        visited: Regions that a tour visited, shape (r,), bool; None where the path was given.
        truth: What was traced along it; None if that was not asked for.
        walk: What the character saw. `simulate` gives it anew for other options, from path and truth.
    """

    path: WalkPath
    visited: BoolArray | None
    truth: PathTruth | None
    walk: Walk


def walk_result(
    result: BakeResult, path: WalkPath | None, options: WalkOptions, *, with_truth: bool = True
) -> Generator[Progress, None, WalkOutcome]:
    """Walks through a result; close the generator to cancel.

    Args:
        result: It has regions.
        path: Where to walk; None for a tour of the regions.
        options: How, and what to look at.
        with_truth: Trace the path as well, to compare.

    Raises:
        InputError: the result has no regions, or no tour can be made of them.
        ObscuraError: as the tracer says.
    """
    regions = regions_of(result)
    visited = None
    truth = None
    if path is None or with_truth:
        device, fog = resolve("auto"), result.decorators.fog if result.decorators else None
        work = patiently("build BVH", lambda: create_tracer(result.world, result.settings, device, fog=fog))
        tracer: Tracer = (yield from work)[0]
        with tracer:
            if path is None:
                yield Progress("tour", 0, 0)
                made = tour(regions, result.world, tracer.nearest, up_of(result))
                path, visited = made.path, made.visited
            if with_truth:
                settings = result.settings
                truth = yield from trace_truth(
                    path,
                    tracer,
                    seed=settings.seed,
                    back_face_threshold=settings.back_face_threshold,
                )
    yield Progress("walk", 0, 0)
    return WalkOutcome(path, visited, truth, simulate(regions, path, options, truth=truth))


def regions_of(result: BakeResult) -> Regions:
    """The regions of a result.

    Raises:
        InputError: it has none.
    """
    if result.regions is None or not len(result.regions.graph):
        raise InputError("the result has no regions to walk in", where="walk", remedy="bake with --regions auto")
    return result.regions


def up_of(result: BakeResult) -> Upright:
    """What points up in a result's scene: glTF says so, for other files its level faces tell."""
    y_up = result.scene_path.suffix.lower() in (".glb", ".gltf")
    bare = Scene(result.scene_path, (), (), (), up_axis=1 if y_up else -1)
    return find_up(bare, result.world, result.settings)
