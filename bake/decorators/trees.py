"""The stages that trees add to a bake: volume, local AO, fit."""

from __future__ import annotations

import time
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np

from bake.decorator_types import TreeFits, TreeModel, TreeVolume
from bake.decorators.local_ao import StagesLent, bake_alone, representatives, seen_by_volume, trees_by_mesh
from bake.decorators.tracing import TreeTracer
from bake.decorators.tree_fitter import FitsKnown, FittedTrees, MeshFitter
from bake.decorators.volume import KnownVoxels, trace_volume, tree_boxes
from bake.decorators.volume_grid import VoxelGrid, build_grid
from bake.settings import BakeSettings
from bake.stages import StageClock
from bake.types import Finding, Float64Array, Progress, Scene, World

_T = TypeVar("_T")
_LONG_GROUP = 64  # trees fitted between two signs of life


class TreesKnown(FitsKnown, Protocol):
    """What of the trees an edit of the scene leaves as it is."""

    def voxels(self, grid: VoxelGrid) -> KnownVoxels | None:
        """Voxels that need not be traced; None if all have to be."""
        ...

    def model(self, mesh: int, trees: Sequence[int]) -> TreeModel | None:
        """The local AO of a mesh with these instances; None if it has to be baked."""
        ...

    def fits_anew(self, trees: Sequence[int], model: TreeModel, volume: TreeVolume) -> bool:
        """Whether any of a mesh's trees has to be fitted again; told before `fit` and `errors` are asked."""
        ...

    def seen(self, number: int, spacing: float) -> Float64Array | None:
        """What `seen_by_volume` found of a tree that stands as it stood; None if nobody remembers."""
        ...

    def remember(self, number: int, spacing: float, seen: Float64Array) -> None:
        """Keeps what `seen_by_volume` found."""
        ...


@dataclass(frozen=True, slots=True)
class BakedTrees:
    """What the bake makes of trees.

    Attributes:
        volume, models, fits: As stored.
        findings: What the user should know.
    """

    volume: TreeVolume
    models: tuple[TreeModel, ...]
    fits: TreeFits
    findings: tuple[Finding, ...]


def bake_trees(
    scene: Scene,
    world: World,
    settings: BakeSettings,
    tracer: TreeTracer,
    stages: StagesLent,
    clock: StageClock,
    *,
    known: TreesKnown | None = None,
) -> Generator[Progress, None, BakedTrees | None]:
    """Bakes all trees of a scene: volume, local AO a mesh, global AO a tree (Sloan et al. 2013, section 2.2).

    Args:
        scene, world: The level; object i of one is object i of the other.
        settings: Those of the bake.
        tracer: Of the whole world, open.
        stages: What baking a tree alone needs.
        clock: Gets the rows "tree volume", "trees" (each mesh alone) and "fit trees".
        known: What need not be found again after an edit; not with `refine_local`.

    Returns:
        None if there are no trees, or none with faces, or the settings skip them; the row "trees" says so.
    """
    groups = trees_by_mesh(scene, world)
    if "trees" in settings.skip or not groups:
        clock.skipped("trees", "asked for by --skip" if "trees" in settings.skip else "no trees in the scene")
        return None
    findings: list[Finding] = []
    volume = yield from _volume(scene, world, groups, settings, tracer, clock, findings, known)
    fitters = yield from _local(scene, world, groups, volume, settings, stages, clock, known)
    begin = time.perf_counter()
    fitted: list[FittedTrees] = []
    for fitter in fitters:
        if settings.refine_local:
            fitted.append((yield from _refined(fitter, volume, tracer, begin)))
            findings.append(_saved(fitter.mesh.name, fitted[-1]))
            continue
        parts: list[FittedTrees] = []
        for first in range(0, len(fitter.trees), _LONG_GROUP):
            yield Progress("fit trees", first, len(fitter.trees), _since(begin))
            parts.append(fitter.fitted(volume, tracer, fitter.trees[first : first + _LONG_GROUP], known))
        fitted.append(FittedTrees.joined(parts))
    fits = _fits(groups, fitted)
    rays = sum(fitter.rays for fitter in fitters)
    clock.ran("fit trees", f"{len(fits.object):,} trees, {4 * fits.terms.shape[1]} numbers each", _since(begin), rays)
    return BakedTrees(volume, tuple(item.model for item in fitted), fits, tuple(findings))


def _volume(
    scene: Scene,
    world: World,
    groups: Mapping[int, Sequence[int]],
    settings: BakeSettings,
    tracer: TreeTracer,
    clock: StageClock,
    findings: list[Finding],
    known: TreesKnown | None,
) -> Generator[Progress, None, TreeVolume]:
    begin, directions = time.perf_counter(), settings.volume_directions
    trees = np.sort(np.concatenate([np.array(group, np.int64) for group in groups.values()]))
    low, high = tree_boxes(world.positions, world.faces, world.first_face, trees)
    grid = build_grid(low, high, settings.volume_spacing, world.origin)
    where = scene.path.name
    if grid.spacing > settings.volume_spacing:
        detail = f"the tree volume would need too many voxels, so its spacing is {grid.spacing:.3g} m"
        findings.append(Finding(where, "tree-volume-coarsened", len(grid.voxel), detail))
    voxels = None if known is None else known.voxels(grid)
    total = (len(grid.voxel) if voxels is None else int(np.count_nonzero(voxels.wanted))) * directions
    work = trace_volume(
        grid,
        tracer,
        directions=directions,
        back_face_threshold=settings.back_face_threshold,
        seed=settings.seed,
        known=voxels,
    )
    while True:
        try:
            done = next(work) * directions
        except StopIteration as stop:
            volume, lost = stop.value
            break
        yield Progress("tree volume", done, total, _since(begin), done / _since(begin))
    if lost:
        detail = f"{lost:,} voxels lie in trees that are buried whole; they count as open"
        findings.append(Finding(where, "tree-volume-buried", lost, detail))
    filled = int((volume.valid == 0).sum())
    why = f"{len(grid.voxel):,} voxels, {filled:,} filled, {volume.memory_bytes / 2**20:.1f} MB"
    clock.ran("tree volume", why, _since(begin), total)
    return volume


def _local(
    scene: Scene,
    world: World,
    groups: Mapping[int, Sequence[int]],
    volume: TreeVolume,
    settings: BakeSettings,
    stages: StagesLent,
    clock: StageClock,
    known: TreesKnown | None,
) -> Generator[Progress, None, list[MeshFitter]]:
    """Bakes each mesh alone, as a surface and, where it is to be compared with the volume, as a volume."""
    begin, rays = time.perf_counter(), 0
    fitters: list[MeshFitter] = []

    def run(work: Generator[int, None, _T]) -> Generator[Progress, None, _T]:
        nonlocal rays
        while True:
            try:
                rays += next(work)
            except StopIteration as stop:
                return stop.value
            yield Progress("trees", rays, 0, _since(begin), rays / _since(begin))

    alone = 0
    for mesh, trees in groups.items():
        model = None if known is None else known.model(mesh, trees)
        if model is None:
            alone += 1
            model = yield from run(bake_alone(scene, mesh, [scene.objects[i] for i in trees], settings, stages))
        fitter = MeshFitter(scene.meshes[mesh], world, model, trees, settings)
        if not settings.refine_local and (known is None or known.fits_anew(trees, model, volume)):
            for number in np.array(trees)[representatives(len(trees))]:
                number, spacing = int(number), volume.spacing
                seen = None if known is None else known.seen(number, spacing)
                if seen is None:
                    placed = fitter.placed(number)
                    seen = yield from run(seen_by_volume(world, number, placed, spacing, settings, stages))
                    if known is not None:
                        known.remember(number, spacing, seen)
                fitter.seen[number] = seen
        fitters.append(fitter)
    clock.ran("trees", f"{alone} of {len(fitters)} baked alone", _since(begin), rays)
    return fitters


def _refined(
    fitter: MeshFitter, volume: TreeVolume, tracer: TreeTracer, begin: float
) -> Generator[Progress, None, FittedTrees]:
    """One mesh with its local AO refined; tells how far it is, in trees."""
    work, count = fitter.refined(volume, tracer), len(fitter.trees)
    while True:
        try:
            share = next(work)
        except StopIteration as stop:
            return stop.value
        yield Progress("fit trees", round(share * count), count, _since(begin))


def _fits(groups: Mapping[int, Sequence[int]], fitted: Sequence[FittedTrees]) -> TreeFits:
    """All trees in scene order."""
    numbers = np.concatenate([np.array(group, np.int32) for group in groups.values()])
    order = np.argsort(numbers)
    fits = [fit for item in fitted for fit in item.fits]
    errors = np.concatenate([item.rmse for item in fitted]).astype(np.float32)[order]
    return TreeFits(
        object=numbers[order],
        model=np.repeat(np.arange(len(fitted), dtype=np.int32), [len(item.fits) for item in fitted])[order],
        centre=np.concatenate([item.centre for item in fitted])[order],
        coefficients=np.array([fit.coefficients for fit in fits], np.float32)[order],
        rmse_global=errors[:, 0],
        rmse_product=errors[:, 1],
        terms=np.array([fit.terms for fit in fits], np.uint8)[order],
        rmse_volume=errors[:, 2],
    )


def _saved(name: str, item: FittedTrees) -> Finding:
    assert item.rmse_unrefined is not None
    before, after = item.rmse_unrefined.mean(axis=0), item.rmse[:, 1].mean(axis=0)
    columns = ", ".join(f"{a:.4f} to {b:.4f}" for a, b in zip(before, after, strict=True))
    detail = f"refining local AO takes the mean error of {len(item.fits)} trees from {columns} (one pair a distance)"
    return Finding(name, "local-ao-refined", len(item.fits), detail, "info")


def _since(begin: float) -> float:
    return max(time.perf_counter() - begin, 1e-9)
