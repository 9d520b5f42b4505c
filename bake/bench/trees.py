"""How close the three models of Figure 2 of Sloan et al. 2013 come to what is traced on the trees themselves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from bake.arrays import Float32Array, Float64Array
from bake.bench.table import Measurements, bake_seed
from bake.bench.tree_figures import TreeFigure, traced_at_vertices
from bake.decorator_types import TreeFits
from bake.decorators.fit import GlobalFit, fit_global, model_error
from bake.decorators.local_ao import StagesLent
from bake.decorators.tree_fitter import traced_gold
from bake.decorators.tree_samples import place, sample_mesh
from bake.decorators.trees import BakedTrees, bake_trees
from bake.decorators.volume import evaluate
from bake.devices import Device, resolve
from bake.pipeline import settings_for
from bake.samples import place_samples
from bake.scene import flatten, load_scene
from bake.settings import BakeSettings
from bake.solve import map_to_vertices
from bake.stages import StageClock, drained
from bake.trace import Tracer, create_tracer
from bake.types import Scene, World

_TRUTH_RAYS = 1024
_EACH = 40
"""Up to so many trees of a scene each get rows of their own; of more, so many are measured, evenly chosen."""

_DRAWN = 2  # meshes of a scene that a figure shows a tree of
_REFINED = "refined"


@dataclass(frozen=True, slots=True)
class TreeMeasurements:
    """Two tables, of the models' errors and of the volumes, and the trees to draw."""

    tables: tuple[Measurements, Measurements]
    figures: tuple[TreeFigure, ...]


@dataclass(frozen=True, slots=True)
class _Measured:
    """One tree: the error of each model, shape (k,), and what it takes to draw it."""

    tree: int
    errors: Mapping[str, Float64Array]
    linear: GlobalFit


def measure_trees(scenes: Sequence[Path], options: Mapping[str, Any], *, draw: bool = False) -> TreeMeasurements:
    """One row a tree and distance, or means where a scene has many trees; and one a scene for what its volume costs.

    Args:
        scenes: Scene files.
        options: Bake options by long name.
        draw: Whether figures are wanted.
    """
    rows: list[dict[str, Any]] = []
    volumes: list[dict[str, Any]] = []
    figures: list[TreeFigure] = []
    for path in scenes:
        settings = settings_for(path, {**options, "refine-local": False})
        scene = load_scene(path, crease_angle=settings.crease_angle)
        found, volume, drawn = measure_scene(scene, settings, resolve(settings.device), draw=draw)
        rows += [{"scene": path.stem, **row} for row in found]
        volumes += [{"scene": path.stem, **row} for row in volume]
        figures += drawn
    notes = [
        f"reference: AO traced with {_TRUTH_RAYS} rays at up to 4,096 points spread over each tree; fog is left out",
        "global: the best linear function alone; local × global: what the bake stores; refined: with --refine-local; "
        "plain fit: local × global fitted to the volume without allowing for what a volume cannot see",
        "volume: the signal that the coefficients are fitted to; closer: trees on which local × global has less "
        f"error than global; gate: all of them, or more than nine in ten where there are more than {_EACH}",
    ]
    seed = bake_seed(options)
    seeds = {"bake": seed, "reference": seed ^ 2}
    tables = Measurements("trees", rows, notes, seeds=seeds), Measurements("tree volume", volumes, seeds=seeds)
    return TreeMeasurements(tables, tuple(figures))


def measure_scene(
    scene: Scene, settings: BakeSettings, device: Device, *, draw: bool = False
) -> tuple[list[dict[str, Any]], list[dict[str, Any]], list[TreeFigure]]:
    """The rows of one scene in both tables, none if it has no trees, and the trees to draw."""
    world, clock = flatten(scene, settings), StageClock()
    with create_tracer(world, settings, device) as tracer:
        baked = _baked(scene, world, settings, device, tracer, clock)
        if baked is None:
            return [], [], []
        refined = _baked(scene, world, settings.replaced(refine_local=True), device, tracer, StageClock())
    assert refined is not None
    exact = settings.replaced(rays=_TRUTH_RAYS, seed=settings.seed ^ 2)
    chosen = _chosen(baked.fits)
    with create_tracer(world, exact, device) as tracer:
        measured = [_measure(scene, world, (baked, refined), tree, tracer, exact) for tree in chosen]
        rows = _rows(world, baked, measured, settings)
        figures = [
            _figure(scene, world, (baked, refined), item, tracer, exact)
            for item in (_worth_drawing(baked.fits, measured) if draw else ())
        ]
    return rows, [_cost(baked, clock)], figures


def _baked(
    scene: Scene, world: World, settings: BakeSettings, device: Device, tracer: Tracer, clock: StageClock
) -> BakedTrees | None:
    lent = StagesLent(flatten, place_samples, partial(create_tracer, device=device), map_to_vertices)
    return drained(bake_trees(scene, world, settings, tracer, lent, clock))


def _chosen(fits: TreeFits) -> list[int]:
    """Trees to measure, rows of the fits: all, or some of them, evenly among those of all meshes."""
    by_model = np.argsort(fits.model, kind="stable")
    count = len(by_model)
    return sorted(by_model[np.linspace(0, count - 1, min(count, _EACH)).round().astype(np.int64)].tolist())


def _measure(
    scene: Scene, world: World, ways: tuple[BakedTrees, BakedTrees], tree: int, tracer: Tracer, settings: BakeSettings
) -> _Measured:
    baked, refined = ways
    model = baked.models[int(baked.fits.model[tree])]
    mesh = scene.meshes[model.mesh]
    samples = sample_mesh(mesh)
    placed = place(samples, mesh, world, int(baked.fits.object[tree]))
    truth, area = traced_gold(tracer, placed, world, settings), placed.area
    offsets: Float64Array = placed.points - baked.fits.centre[tree]
    volume = evaluate(baked.volume, placed.points, placed.normals).astype(np.float64)
    local = samples.interpolate(mesh, model.local_ao)
    shared = samples.interpolate(mesh, refined.models[int(refined.fits.model[tree])].local_ao)
    linear = fit_global(volume, np.ones_like(volume), offsets, area)
    models = {
        "global": linear.at(offsets),
        "plain fit": fit_global(volume, local, offsets, area).at(offsets) * local,
        "local × global": _global(baked, tree, offsets) * local,
        _REFINED: _global(refined, tree, offsets) * shared,
        "volume": volume,
    }
    return _Measured(tree, {name: model_error(truth, model, area) for name, model in models.items()}, linear)


def _global(baked: BakedTrees, tree: int, offsets: Float64Array) -> Float64Array:
    """The stored global AO of a tree at places relative to its centre, shape (n, k)."""
    y: Float64Array = baked.fits.coefficients[tree].astype(np.float64)
    return y[0] + offsets @ y[1:]


def _rows(
    world: World, baked: BakedTrees, measured: Sequence[_Measured], settings: BakeSettings
) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = []
    fits, count = baked.fits, len(baked.fits.object)
    if count == len(measured):
        for item in measured:
            path = world.object_paths[int(fits.object[item.tree])]
            for column, distance in enumerate(settings.column_distances):
                row: dict[str, Any] = {"tree": path, "distance m": distance}
                row |= {f"RMSE {name}": float(error[column]) for name, error in item.errors.items()}
                rows.append({**row, "passed": row["RMSE local × global"] < row["RMSE global"]})
    few = f"mean of {len(measured):,}" + (f" of {count:,}" if count > len(measured) else "")
    for column, distance in enumerate(settings.column_distances):
        errors = {name: np.array([item.errors[name][column] for item in measured]) for name in measured[0].errors}
        closer = int((errors["local × global"] < errors["global"]).sum())
        row = {"tree": few, "distance m": distance}
        row |= {f"RMSE {name}": float(error.mean()) for name, error in errors.items()}
        rows.append({**row, "closer": f"{closer} of {len(measured)}", "passed": closer > 0.9 * len(measured)})
    if count > len(measured):
        rows += _as_baked(fits, settings)
    return rows


def _as_baked(fits: TreeFits, settings: BakeSettings) -> list[dict[str, Any]]:
    """Means over all trees of the errors that the bake itself reports, at its own number of rays."""
    count = len(fits.object)
    kept = {"global": fits.rmse_global, "local × global": fits.rmse_product, "volume": fits.rmse_volume}
    rows: list[dict[str, Any]] = []
    for column, distance in enumerate(settings.column_distances):
        closer = int((fits.rmse_product[:, column] < fits.rmse_global[:, column]).sum())
        row: dict[str, Any] = {"tree": f"all {count:,}, as baked", "distance m": distance}
        row |= {f"RMSE {name}": float(error[:, column].mean()) for name, error in kept.items()}
        rows.append({**row, "closer": f"{closer:,} of {count:,}"})
    return rows


def _cost(baked: BakedTrees, clock: StageClock) -> dict[str, Any]:
    traced = next(row for row in clock.rows if row.name == "tree volume")
    volume, voxels = baked.volume, len(baked.volume.voxel)
    return {
        "trees": len(baked.fits.object),
        "bricks": len(volume.brick_voxels),
        "voxels": voxels,
        "filled": int((volume.valid == 0).sum()),
        "spacing m": volume.spacing,
        "volume bytes": volume.memory_bytes,
        "bytes a tree": baked.fits.coefficients[0].nbytes,
        "seconds": traced.seconds,
        "points/s": voxels / traced.seconds,
        "Mrays/s": traced.rays / traced.seconds / 1e6,
    }


def _worth_drawing(fits: TreeFits, measured: Sequence[_Measured]) -> list[_Measured]:
    """Of the meshes with the most trees, the tree whose error is the median."""
    counts = np.bincount(fits.model)
    drawn: list[_Measured] = []
    for model in np.argsort(-counts, kind="stable")[:_DRAWN].tolist():
        of = [item for item in measured if fits.model[item.tree] == model]
        of.sort(key=lambda item: float(item.errors["local × global"].sum()))
        drawn += of[len(of) // 2 : len(of) // 2 + 1]
    return drawn


def _figure(
    scene: Scene,
    world: World,
    ways: tuple[BakedTrees, BakedTrees],
    item: _Measured,
    tracer: Tracer,
    settings: BakeSettings,
) -> TreeFigure:
    baked, refined = ways
    number = int(baked.fits.object[item.tree])
    first, last = (int(v) for v in world.first_vertex[number : number + 2])
    centre = baked.fits.centre[item.tree]
    positions = world.positions[first:last]
    offsets: Float64Array = positions - centre
    traced, normals = traced_at_vertices(world, number, tracer, settings)
    values = {
        "global": item.linear.at(offsets),
        "local × global": _global(baked, item.tree, offsets) * _local(baked, item.tree),
        _REFINED: _global(refined, item.tree, offsets) * _local(refined, item.tree),
        "volume": evaluate(baked.volume, positions, normals).astype(np.float64),
    }
    return TreeFigure(
        scene=scene.path.stem,
        tree=world.object_paths[number],
        up_axis=scene.up_axis if scene.up_axis in (1, 2) else 1,
        distances=settings.column_distances,
        positions=offsets,
        faces=world.faces[world.first_face[number] : world.first_face[number + 1]] - np.int32(first),
        values={name: np.clip(ao, 0.0, 1.0).astype(np.float32) for name, ao in values.items()} | {"traced": traced},
        errors=item.errors,
    )


def _local(baked: BakedTrees, tree: int) -> Float32Array:
    return baked.models[int(baked.fits.model[tree])].local_ao
