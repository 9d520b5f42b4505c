"""Run time against error: our bakes at many settings, and other bakers on the same mesh, in one run.

Every scene is made one mesh file, which all contenders read. The seconds go from that file to the stored result, in a
process that has its libraries and kernels loaded; the error is that of the values interpolated over the surface,
against a converged reference (`bake/bench/surface_truth.py`).
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bake.bench.banding import banding
from bake.bench.peers import PEERS, bake_with, peer_version
from bake.bench.surface_truth import REFERENCE_RAYS, SurfaceTruth, finest_piecewise_linear, surface_truth
from bake.bench.synthetic import Geometry, comparison_field, write_ply
from bake.errors import DeviceError
from bake.pipeline import settings_for
from bake.results import load_result
from bake.scene import flatten, load_scene
from bake.settings import BakeSettings, Kernel
from bake.types import World

GATED = "comparison field"
UNBOUNDED = 1e5
"""Metres that stand for no greatest distance."""


@dataclass(frozen=True, slots=True)
class Contender:
    """One way of ours to bake: a name and the options that make it."""

    name: str
    options: Mapping[str, Any]


def _ours() -> Iterator[Contender]:
    yield Contender("preset preview", {"quality": "preview"})
    yield Contender("preset final", {"quality": "final"})
    for per_face, rays in (("1:1", 4), ("1:1", 8), ("1:1", 16), ("2:2", 8), ("2:2", 16), ("4:4", 16)):
        kinds = [("least-squares", 0.03), ("least-squares", 0.1)]
        for mapping, alpha in [("average", 0.0), *kinds] if rays * int(per_face[0]) <= 8 else kinds:
            smoothing = "average" if mapping == "average" else f"least squares, α {alpha:g}"
            options = {"samples-per-face": per_face, "rays": rays, "mapping": mapping, "alpha": alpha}
            yield Contender(f"{per_face} × {rays}, {smoothing}", options)


OURS: tuple[Contender, ...] = tuple(_ours())


@dataclass(frozen=True, slots=True)
class FrontRow:
    """One bake: who, how long, how good.

    Attributes:
        scene, baker, effort: Names.
        seconds: From the mesh's file to the stored result.
        rmse, area_rmse, p999: Errors at the first distance.
        banding: Kinks between faces, in 8-bit codes (`bake/bench/banding.py`).
        bounded: Whether the greatest distance was kept.
    """

    scene: str
    baker: str
    effort: str
    seconds: float
    rmse: float
    area_rmse: float
    p999: float
    banding: float
    bounded: bool = True


@dataclass(frozen=True, slots=True)
class Front:
    """All bakes of a scene.

    Attributes:
        rows: In the order they were made.
        floor, floor_banding: Error and kinks of the best piecewise linear AO.
        reference_error: That of the reference itself.
        distance: The greatest distance, metres.
        seed: Of our bakes; the reference has the next one.
    """

    scene: str
    rows: Sequence[FrontRow]
    floor: float
    floor_banding: float
    reference_error: float
    distance: float
    seed: int


def measure_fronts(
    scenes: Iterable[Path],
    options: Mapping[str, Any],
    *,
    peers: Path | None = None,
    ours: Sequence[Contender] = OURS,
    scale: float = 1.0,
) -> list[Front]:
    """The front of each scene; without one, of the comparison field.

    Args:
        scenes: Scene files; each is flattened into one mesh.
        options: Bake options by long name; `max-distance` holds for everybody.
        peers: An interpreter that has other bakers installed.
        ours: Our ways to bake.
        scale: Metres in a unit of the scenes.
    """
    found: list[Front] = []
    with tempfile.TemporaryDirectory(prefix="obscura-front-") as name:
        for number, (title, geometry) in enumerate(_geometries(list(scenes), scale)):
            folder = Path(name) / str(number)
            folder.mkdir()
            found.append(_front(title, geometry, folder, {**_PLAIN, **options}, peers, ours))
    return found


_PLAIN: Mapping[str, Any] = {"kernel": Kernel.OCCLUSION.value, "max-distance": 10.0}


def _geometries(scenes: Sequence[Path], scale: float) -> Iterator[tuple[str, Geometry]]:
    if not scenes:
        yield GATED, comparison_field()
    for path in scenes:
        world = flatten(load_scene(path), settings_for(path, {}))
        yield path.name, (world.positions * scale, world.faces)


def _front(
    title: str,
    geometry: Geometry,
    folder: Path,
    options: Mapping[str, Any],
    peers: Path | None,
    ours: Sequence[Contender],
) -> Front:
    mesh = folder / "mesh.ply"
    write_ply(mesh, geometry)
    np.savez(folder / "mesh.npz", positions=geometry[0], faces=geometry[1])
    settings = BakeSettings.from_options(options)
    world = flatten(load_scene(mesh), settings)
    truth = _truth(world, settings)
    rows = list(_our_rows(title, mesh, folder, options, ours, truth, world))
    if peers is not None:
        open_truth = _truth(world, settings.replaced(max_distance=UNBOUNDED))
        rows += _peer_rows(title, folder, settings, peers, truth, open_truth, world)
    best = finest_piecewise_linear(world, settings)
    floor = truth.errors(best)["mixed 0"]
    return Front(
        title, rows, floor, banding(world, best), float(truth.own_error[0]), settings.trace_distance, settings.seed
    )


def _truth(world: World, settings: BakeSettings) -> SurfaceTruth:
    return surface_truth(world, settings.replaced(rays=REFERENCE_RAYS, seed=(settings.seed + 1) % 2**32))


def _our_rows(
    title: str,
    mesh: Path,
    folder: Path,
    options: Mapping[str, Any],
    ours: Sequence[Contender],
    truth: SurfaceTruth,
    world: World,
) -> Iterator[FrontRow]:
    jobs = [(str(folder / f"ours-{i}"), {**options, **one.options}) for i, one in enumerate(ours)]
    request = json.dumps({"scene": str(mesh), "jobs": jobs})
    # One process for all, as peers' interpreters load their libraries before they look at the clock.
    ended = subprocess.run(
        [sys.executable, "-m", "bake.bench.timed_bakes"], input=request, capture_output=True, text=True, check=False
    )
    if ended.returncode:
        raise DeviceError("the timed bakes failed", where="bench", remedy=ended.stderr.strip()[-400:])
    for one, (result, _), seconds in zip(ours, jobs, json.loads(ended.stdout), strict=True):
        ao = load_result(Path(result), verify=False).field.ao
        yield _row(title, "Obscura", one.name, seconds, ao, truth, world)


def _peer_rows(
    title: str,
    folder: Path,
    settings: BakeSettings,
    python: Path,
    truth: SurfaceTruth,
    open_truth: SurfaceTruth,
    world: World,
) -> Iterator[FrontRow]:
    with np.load(folder / "mesh.npz") as stored:
        faces = stored["faces"]
    for peer in PEERS:
        version = peer_version(python, peer)
        for effort in peer.efforts if version else ():
            made = bake_with(
                python, peer, folder / "mesh.npz", folder, max_distance=settings.trace_distance, effort=effort
            )
            if made is not None:
                # The mesh's own vertices, which our loader may have parted at creases: by the corners of its faces.
                ao = made.ao if made.ao.ndim == 3 else made.ao[faces]
                own = truth if peer.bounded else open_truth
                name = f"{peer.name} {version}"
                yield _row(title, name, f"{effort} rays", made.seconds, ao, own, world, bounded=peer.bounded)


def _row(
    title: str,
    baker: str,
    effort: str,
    seconds: float,
    ao: np.ndarray,
    truth: SurfaceTruth,
    world: World,
    *,
    bounded: bool = True,
) -> FrontRow:
    errors = truth.errors(ao)
    p999 = float(truth.percentile(ao, 99.9)[0])
    return FrontRow(
        title, baker, effort, seconds, errors["mixed 0"], errors["area 0"], p999, banding(world, ao), bounded
    )
