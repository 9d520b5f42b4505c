"""The same bake by every tracer: seconds and error side by side, and how far their values lie apart."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bake.bench.scaled import scaled
from bake.bench.surface_truth import SurfaceTruth, surface_truth
from bake.bench.synthetic import Geometry, comparison_field, field_with_props, write_ply
from bake.bench.table import Measurements
from bake.bench.timed_bakes import bakes_timed
from bake.devices import Device, resolve
from bake.pipeline import settings_for
from bake.results import load_result
from bake.scene import flatten, load_scene
from bake.settings import BakeSettings, Kernel, TracerKind
from bake.types import Float32Array, World

SMALL = 1_000
"""Faces up to which brute force, every ray against every face, takes no more than seconds."""

REFERENCE_RAYS, POINTS = 1024, 10_000
APART = 1e-4
"""Gate: by no more than this may a tracer's RMSE differ from that of the first."""

_PLAIN: Mapping[str, Any] = {
    "kernel": Kernel.OCCLUSION.value, "max-distance": 10.0, "samples-per-face": "1:1", "rays": 16,
}  # fmt: skip


def measure_tracers(scenes: Iterable[Path], options: Mapping[str, Any], *, scale: float = 1.0) -> Measurements:
    """A row a scene and tracer, each with the same rays.

    Args:
        scenes: Scene files, flattened into one mesh; without any, a small field and that of the comparison of bakers.
        options: Bake options by long name; tracer and device are the benchmark's.
        scale: Metres in a unit of the scenes.
    """
    asked = {**_PLAIN, **{name: value for name, value in options.items() if name not in ("tracer", "device")}}
    settings = BakeSettings.from_options(asked)
    paths, rows = list(scenes), list[dict[str, Any]]()
    with tempfile.TemporaryDirectory(prefix="obscura-tracers-") as name:
        for number, (title, geometry) in enumerate(_geometries(paths, scale)):
            folder = Path(name) / str(number)
            folder.mkdir()
            write_ply(folder / "mesh.ply", geometry)
            rows += _rows(title, folder, asked, settings)
    fewest, most = settings.samples_per_face
    notes = [
        f"{fewest}:{most} × {settings.rays} rays, {settings.mapping.value}; seconds from the mesh's file to the stored "
        "result, libraries and kernels loaded, median of three under 5 seconds",
        f"RMSE at points spread by area, against {REFERENCE_RAYS:,} rays; apart: vertex values from the first "
        "tracer's, root of the mean square, and how many by more than 0.01",
        f"brute force up to {SMALL:,} faces; gate: RMSE within {APART:g} of the first tracer's",
    ]
    seeds = {"bakes": settings.seed, "reference": (settings.seed + 1) % 2**32, "scenes": 1}
    title = f"tracers: {', '.join(path.name for path in paths)}" if paths else "tracers"
    return Measurements(title, rows, notes, seeds=seeds, settings=settings.to_json())


def _geometries(scenes: Sequence[Path], scale: float) -> Iterator[tuple[str, Geometry]]:
    if not scenes:
        yield "small field", field_with_props(14, 5, subdivisions=1)
        yield "comparison field", comparison_field()
    for path in scenes:
        world = flatten(scaled(load_scene(path), scale), settings_for(path, {}))
        yield path.name, (world.positions, world.faces)


def _contenders(faces: int) -> Iterator[tuple[TracerKind, Device]]:
    plain = resolve("cpu")
    yield TracerKind.EMBREE, plain
    yield TracerKind.WARP, plain
    best = resolve("auto")
    if best.is_cuda:
        yield TracerKind.WARP, best
    if faces <= SMALL:
        yield TracerKind.BRUTE, plain


def _rows(title: str, folder: Path, options: Mapping[str, Any], settings: BakeSettings) -> Iterator[dict[str, Any]]:
    mesh = folder / "mesh.ply"
    world = flatten(load_scene(mesh), settings)
    truth = _truth(world, settings)
    contenders = list(_contenders(world.face_count))
    jobs = [
        (str(folder / str(number)), {**options, "tracer": kind.value, "device": device.alias})
        for number, (kind, device) in enumerate(contenders)
    ]
    first: Float32Array | None = None
    for (kind, device), (result, _), seconds in zip(contenders, jobs, bakes_timed(mesh, jobs), strict=True):
        baked = load_result(Path(result), verify=False)
        ao = baked.field.ao
        first = ao if first is None else first
        apart = (ao - first)[np.isfinite(ao) & np.isfinite(first)].astype(np.float64)
        error, base = (truth.errors(one)["area 0"] for one in (ao, first))
        yield {
            "scene": title,
            "faces": world.face_count,
            "tracer": kind.value,
            "device": device.name if device.is_cuda else "cpu",
            "Mrays": float(baked.tally.rays.sum(dtype=np.int64)) / 1e6,
            "seconds": seconds,
            "RMSE": error,
            "apart": float(np.sqrt(np.mean(apart * apart))),
            "vertices apart": int(np.count_nonzero(np.abs(apart) > 0.01)),
            "passed": abs(error - base) <= APART,
        }


def _truth(world: World, settings: BakeSettings) -> SurfaceTruth:
    reference = settings.replaced(rays=REFERENCE_RAYS, seed=(settings.seed + 1) % 2**32)
    return surface_truth(world, reference, points=POINTS)
