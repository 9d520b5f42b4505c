"""What hangs on the surface and on the space around it: trees, regions, small decorators, lower levels of detail."""

from __future__ import annotations

import dataclasses
from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from bake.decorator_types import TreeFits
from bake.decorators.trees import BakedTrees, bake_trees
from bake.devices import Device
from bake.pipeline import lent_stages
from bake.rebake.known_points import known_points
from bake.rebake.known_trees import KnownTrees
from bake.rebake.setting_changes import REGIONS, SAMPLES, SOLVE, SPACE, TREES
from bake.rebake.state import Edit, State
from bake.region_types import PointState
from bake.regions.model_findings import KINDS
from bake.regions.probes import judged
from bake.regions.region_stage import RegionOutcome, bake_regions, find_regions, model_regions
from bake.regions.space import RegionSpace
from bake.stages import StageClock
from bake.trace import Tracer
from bake.trace.changed_points import ChangedPoints
from bake.types import BakeResult, Finding, Float32Array, Progress, Role

TREE_FINDINGS = frozenset({"tree-volume-coarsened", "tree-volume-buried", "local-ao-refined"})
SPACE_FINDINGS = frozenset(
    {
        "regions-leave-outskirts",
        "region-cell-coarsened",
        "regions-enlarged",
        "too-many-regions",
        "region-outside-scene",
        "closed-link",
        "region-without-points",
    }
)
MODEL_FINDINGS = frozenset(KINDS)

_NOT_REACHED = "carried: the edit does not reach it"


def rebaked_trees(
    state: State,
    edit: Edit,
    tracer: Tracer,
    device: Device,
    clock: StageClock,
    *,
    bound: float,
    changed: ChangedPoints | None = None,
) -> Generator[Progress, None, tuple[BakedTrees | None, KnownTrees | None]]:
    """Trees: what of them an edit can reach anew, all else carried.

    Args:
        state: Before the edit.
        edit: What differs.
        tracer: Of the edited world.
        device: Where trees are traced alone.
        clock: Gets their rows.
        bound: Most that may be skipped for a voxel or a tree.
        changed: Tells points with a ray that can have changed; None if nobody can.
    """
    before, decorators = state.result, state.result.decorators
    anew = edit.settings_change.any_of(SOLVE, SAMPLES, TREES)
    known: KnownTrees | None = None
    if decorators is not None and decorators.fits is not None and decorators.volume is not None and not anew:
        if not _differ(state, edit, Role.TREE):
            for name in ("tree volume", "trees", "fit trees"):
                clock.skipped(name, _NOT_REACHED)
            carried = BakedTrees(
                decorators.volume, decorators.models, _renumbered(state, edit, decorators.fits),
                _findings(before, TREE_FINDINGS),
            )  # fmt: skip
            return carried, None
        if not edit.settings.refine_local:
            known = KnownTrees(state, edit, bound, changed)
    lent = lent_stages(device)
    trees = yield from bake_trees(edit.scene, edit.world, edit.settings, tracer, lent, clock, known=known)
    return trees, known


def _renumbered(state: State, edit: Edit, fits: TreeFits) -> TreeFits:
    """The same fits with the objects' numbers as they are now."""
    objects = edit.change.new_object[fits.object].astype(np.int32)
    return dataclasses.replace(fits, object=objects)


@dataclass(frozen=True, slots=True)
class RebakedRegions:
    """What became of the regions.

    Attributes:
        outcome: As a bake's; None without any.
        skipped: Shape (t,), float32: what is skipped after this edit, one a traced point.
        traced: Points that were traced.
    """

    outcome: RegionOutcome | None
    skipped: Float32Array
    traced: int = 0


def rebaked_regions(
    state: State,
    edit: Edit,
    tracer: Tracer,
    clock: StageClock,
    *,
    bound: float,
    changed: ChangedPoints | None = None,
) -> Generator[Progress, None, RebakedRegions]:
    """Regions: found anew if what stops movement changed, traced where the edit can reach, and modelled.

    Args: those of `rebaked_trees`.
    """
    before, change = state.result, edit.settings_change
    regions, kept = before.regions, before.skipped
    opaque = bool(edit.casters.before.opaque.any() or edit.casters.after.opaque.any())
    space: RegionSpace | None = None
    if change.any_of(SPACE) or opaque or not _same_boxes(state, edit) or (regions is None) != (_asked_for(edit) == ""):
        space = yield from find_regions(edit.scene, edit.world, edit.settings, tracer, clock)
        if space is None:
            return RebakedRegions(None, np.zeros(0, np.float32))
    elif regions is None:
        clock.skipped("regions", "none asked for (--regions auto makes some)")
        return RebakedRegions(None, np.zeros(0, np.float32))
    elif len(edit.casters):
        clock.skipped("regions", "carried: nothing that stops movement changed")
        findings = _findings(before, SPACE_FINDINGS)
        valid = regions.points.state != PointState.UNREACHABLE
        space = RegionSpace(regions.graph, np.asarray(valid), findings, float("nan"), 0)
    if space is not None:
        known, skipped = known_points(state, edit, space, bound, changed)
        traced = len(skipped) if known is None else int(np.count_nonzero(known.wanted))
        outcome = yield from bake_regions(space, edit.settings, tracer, clock, known=known)
        return RebakedRegions(outcome, skipped, traced)
    assert regions is not None
    skipped = np.zeros(0, np.float32) if kept is None else kept.points
    for name in ("regions", "region probes"):
        clock.skipped(name, _NOT_REACHED)
    if change.any_of(REGIONS) or "back_face_threshold" in change.names:
        points = judged(regions.points, edit.settings.back_face_threshold)
        outcome = yield from model_regions(regions.graph, points, edit.settings, clock)
        outcome = RegionOutcome(outcome.regions, (*_findings(before, SPACE_FINDINGS), *outcome.findings))
        return RebakedRegions(outcome, skipped)
    for name in ("fit regions", "regularise regions"):
        clock.skipped(name, _NOT_REACHED)
    return RebakedRegions(RegionOutcome(regions, _findings(before, SPACE_FINDINGS | MODEL_FINDINGS)), skipped)


def _differ(state: State, edit: Edit, role: Role, *, rays: bool = True) -> bool:
    """Whether the objects of a role are others than before, or anything is for rays."""

    def those(world_paths: tuple[str, ...], hashes: tuple[str, ...], roles: tuple[Role, ...]) -> list[tuple[str, str]]:
        rows = zip(world_paths, hashes, roles, strict=True)
        return [(path, digest) for path, digest, own in rows if own is role]

    old, new = state.result.world, edit.world
    return (rays and len(edit.casters) > 0) or those(old.object_paths, old.object_hash, old.object_roles) != those(
        new.object_paths, new.object_hash, new.object_roles
    )


def _asked_for(edit: Edit) -> str:
    from bake.regions.graph import regions_asked_for

    return "" if "regions" in edit.settings.skip else regions_asked_for(edit.scene, edit.settings)


def _same_boxes(state: State, edit: Edit) -> bool:
    """Whether the regions of the side file, or those of the file that the settings name, are what they were."""
    source = _asked_for(edit)
    if source in ("", "automatic"):
        return True
    if source == "scene":
        if state.scene is not None:
            return state.scene.regions == edit.scene.regions
        return _stored_boxes(state) == [(box.name, *box.minimum, *box.maximum) for box in edit.scene.regions]
    files, before = edit.scene.files, state.result.files
    return {name: digest for name, digest in files.items() if name not in before or before[name] != digest} == {}


def _stored_boxes(state: State) -> list[tuple[object, ...]]:
    """The regions as a side file would say them; rounded, for they lie about the world's origin."""
    regions, origin = state.result.regions, state.result.world.origin
    if regions is None:
        return []
    graph = regions.graph
    low, high = np.round(graph.minimum + origin, 9).tolist(), np.round(graph.maximum + origin, 9).tolist()
    return [(name, *a, *b) for name, a, b in zip(graph.names, low, high, strict=True)]


def _findings(result: BakeResult, kinds: frozenset[str]) -> tuple[Finding, ...]:
    return tuple(item for item in result.findings if item.what in kinds)


__all__ = ["RebakedRegions", "rebaked_regions", "rebaked_trees"]
