"""How close the three models of Figure 2 of Sloan et al. 2013 come to what is traced on the trees themselves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from bake.bench.lods import finished
from bake.bench.table import Measurements
from bake.decorators.fit import fit_global, model_error
from bake.decorators.local_ao import StagesLent
from bake.decorators.tree_fitter import traced_gold
from bake.decorators.tree_samples import PlacedSamples, place, sample_mesh
from bake.decorators.trees import BakedTrees, bake_trees
from bake.decorators.volume import evaluate
from bake.devices import Device, resolve
from bake.pipeline import settings_for
from bake.samples import place_samples
from bake.scene import flatten, load_scene
from bake.settings import BakeSettings
from bake.solve import map_to_vertices
from bake.stages import StageClock
from bake.trace import Tracer, create_tracer
from bake.types import Float64Array, Scene, World

_TRUTH_RAYS = 1024


def measure_trees(scenes: Sequence[Path], options: Mapping[str, Any]) -> Measurements:
    """One row a tree and distance, and one a scene for what its volume costs.

    Args:
        scenes: Scene files.
        options: Bake options by long name.
    """
    rows: list[dict[str, Any]] = []
    for path in scenes:
        settings = settings_for(path, {**options, "refine-local": False})
        scene = load_scene(path, crease_angle=settings.crease_angle)
        rows += [{"scene": path.stem, **row} for row in _rows(scene, settings, resolve(settings.device))]
    notes = [
        f"reference: AO traced with {_TRUTH_RAYS} rays at up to 4,096 points spread over each tree; fog is left out",
        "global: the best linear function alone; local × global: what the bake stores; refined: with --refine-local; "
        "plain fit: local × global fitted to the volume without allowing for what a volume cannot see",
        "volume: the signal that the coefficients are fitted to; gate: local × global has less error than global",
    ]
    return Measurements("trees", rows, notes)


def _rows(scene: Scene, settings: BakeSettings, device: Device) -> list[dict[str, Any]]:
    world, clock = flatten(scene, settings), StageClock()
    with create_tracer(world, settings, device) as tracer:
        baked = _baked(scene, world, settings, device, tracer, clock)
        if baked is None:
            return []
        refined = _baked(scene, world, settings.replaced(refine_local=True), device, tracer, StageClock())
    assert refined is not None
    rows: list[dict[str, Any]] = []
    exact = settings.replaced(rays=_TRUTH_RAYS, seed=settings.seed ^ 2)
    with create_tracer(world, exact, device) as tracer:
        for tree, number in enumerate(baked.fits.object.tolist()):
            errors = _errors(scene, world, (baked, refined), tree, tracer, exact)
            for column, distance in enumerate(settings.column_distances):
                row: dict[str, Any] = {"tree": world.object_paths[number], "distance m": distance}
                row |= {f"RMSE {name}": float(error[column]) for name, error in errors.items()}
                passed = row["RMSE local × global"] < row["RMSE global"]
                rows.append({**row, "passed": passed})
    return [*rows, *_means(rows, settings), _cost(baked, clock)]


def _baked(
    scene: Scene, world: World, settings: BakeSettings, device: Device, tracer: Tracer, clock: StageClock
) -> BakedTrees | None:
    lent = StagesLent(flatten, place_samples, partial(create_tracer, device=device), map_to_vertices)
    return finished(bake_trees(scene, world, settings, tracer, lent, clock))


def _errors(
    scene: Scene, world: World, ways: tuple[BakedTrees, BakedTrees], tree: int, tracer: Tracer, settings: BakeSettings
) -> dict[str, Float64Array]:
    """Errors of each model of one tree, shape (k,)."""
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
    models = {
        "global": fit_global(volume, np.ones_like(volume), offsets, area).at(offsets),
        "plain fit": fit_global(volume, local, offsets, area).at(offsets) * local,
        "local × global": _global(baked, tree, placed) * local,
        "refined": _global(refined, tree, placed) * shared,
        "volume": volume,
    }
    return {name: model_error(truth, model, area) for name, model in models.items()}


def _global(baked: BakedTrees, tree: int, placed: PlacedSamples) -> Float64Array:
    """The stored global AO of a tree at its samples, shape (n, k)."""
    y: Float64Array = baked.fits.coefficients[tree].astype(np.float64)
    return y[0] + (placed.points - baked.fits.centre[tree]) @ y[1:]


def _means(rows: Sequence[Mapping[str, Any]], settings: BakeSettings) -> list[dict[str, Any]]:
    names = [key for key in rows[0] if key.startswith("RMSE")]
    return [
        {"tree": "mean of all", "distance m": distance}
        | {name: float(np.mean([row[name] for row in rows if row["distance m"] == distance])) for name in names}
        for distance in settings.column_distances
    ]


def _cost(baked: BakedTrees, clock: StageClock) -> dict[str, Any]:
    traced = next(row for row in clock.rows if row.name == "tree volume")
    voxels = len(baked.volume.voxel)
    return {
        "tree": "volume of all",
        "voxels": voxels,
        "filled": int((baked.volume.valid == 0).sum()),
        "spacing m": baked.volume.spacing,
        "memory MB": baked.volume.memory_bytes / 2**20,
        "bytes a tree": baked.fits.coefficients[0].nbytes,
        "seconds": traced.seconds,
        "points/s": voxels / traced.seconds,
        "Mrays/s": traced.rays / traced.seconds / 1e6,
    }
