"""Run time against error: our bakes at many settings, and other bakers on the same mesh, in one run.

Every scene is made one mesh file, which all contenders read. The seconds go from that file to the stored result, in a
process that has its libraries and kernels loaded; the error is that of the values interpolated over the surface,
against a converged reference (`bake/bench/surface_truth.py`).
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from bake.bench.banding import banding
from bake.bench.peers import PEERS, bake_with, peer_version
from bake.bench.surface_truth import OF_ALL_RAYS, REFERENCE_RAYS, SurfaceTruth, finest_piecewise_linear, surface_truth
from bake.bench.synthetic import Geometry, comparison_field, under_the_field, write_ply
from bake.bench.timed_bakes import bakes_timed
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
    for per_face, rays, alpha in (
        ("1:1", 4, None), ("1:1", 6, None), ("1:1", 8, None), ("2:2", 8, None), ("1:1", 8, 0.1), ("1:1", 16, 0.1),
        ("2:2", 16, 0.1), ("2:2", 16, 0.03), ("4:4", 8, 0.03), ("4:4", 16, 0.03),
    ):  # fmt: skip
        smoothing = "average" if alpha is None else f"least squares, α {alpha:g}"
        options: dict[str, Any] = {"samples-per-face": per_face, "rays": rays}
        options |= {"mapping": "average"} if alpha is None else {"alpha": alpha}
        yield Contender(f"{per_face} × {rays}, {smoothing}", options)
    kept = {"samples-per-face": "4:4", "rays": 16, "alpha": 0.03, "back-face-threshold": 1}
    yield Contender("4:4 × 16, least squares, α 0.03, no sample dropped", kept)
    yield Contender("preset preview", {"quality": "preview"})
    yield Contender("preset final", {"quality": "final"})


OURS: tuple[Contender, ...] = tuple(_ours())


@dataclass(frozen=True, slots=True)
class FrontRow:
    """One bake: who, how long, how good.

    Attributes:
        scene, baker, effort: Names.
        seconds: From the mesh's file to the stored result.
        rmse, p999: Errors at the first distance over the surface, that is at points spread by area.
        mixed_rmse: The error where half of the points are spread by area and half evenly over the faces.
        all_rays_rmse: The first error over more points: those whose back faces are few beside all their rays.
        banding: Kinks between faces, in 8-bit codes (`bake/bench/banding.py`).
        bounded: Whether the greatest distance was kept.
    """

    scene: str
    baker: str
    effort: str
    seconds: float
    rmse: float
    mixed_rmse: float
    p999: float
    banding: float
    all_rays_rmse: float
    bounded: bool = True


@dataclass(frozen=True, slots=True)
class Front:
    """All bakes of a scene.

    Attributes:
        rows: In the order they were made.
        floor, mixed_floor, floor_banding: Errors and kinks of the best piecewise linear AO.
        points, all_rays_points: How many points count, by area, by either count of back faces.
        options: Of each of our bakes, by its effort.
        buried_points: Of those that count by the latter alone, how many lie under the comparison field's ground; None
            on other scenes.
        reference_error: That of the reference itself.
        distance: The greatest distance, metres.
        seed: Of our bakes; the reference has the next one.
    """

    scene: str
    rows: Sequence[FrontRow]
    floor: float
    mixed_floor: float
    floor_banding: float
    points: int
    all_rays_points: int
    reference_error: float
    distance: float
    seed: int
    buried_points: int | None = None
    options: Mapping[str, Mapping[str, Any]] = field(default_factory=dict[str, Mapping[str, Any]])


def measure_fronts(
    scenes: Iterable[Path],
    options: Mapping[str, Any],
    *,
    peers: Path | None = None,
    ours: Sequence[Contender] = OURS,
    scale: float = 1.0,
    tell: Callable[[FrontRow], None] | None = None,
) -> Iterator[Front]:
    """The front of each scene, as they come; without a scene, of the comparison field.

    Args:
        scenes: Scene files; each is flattened into one mesh.
        options: Bake options by long name; `max-distance` holds for everybody.
        peers: An interpreter that has other bakers installed.
        ours: Our ways to bake.
        scale: Metres in a unit of the scenes.
        tell: Told each row as soon as it is measured.
    """
    with tempfile.TemporaryDirectory(prefix="obscura-front-") as name:
        for number, (title, geometry) in enumerate(_geometries(list(scenes), scale)):
            folder = Path(name) / str(number)
            folder.mkdir()
            yield _front(title, geometry, folder, {**_PLAIN, **options}, peers, ours, tell or _silent)


def _silent(_: FrontRow) -> None:
    """Tells nobody."""


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
    tell: Callable[[FrontRow], None],
) -> Front:
    mesh = folder / "mesh.ply"
    write_ply(mesh, geometry)
    np.savez(folder / "mesh.npz", positions=geometry[0], faces=geometry[1])
    settings = BakeSettings.from_options(options)
    world = flatten(load_scene(mesh), settings)
    truth = _truth(world, settings)
    rows: list[FrontRow] = []
    measured = _our_rows(title, mesh, folder, options, ours, truth, world)
    if peers is not None:
        measured = chain(measured, _peer_rows(title, folder, settings, peers, truth, world))
    for row in measured:
        rows.append(row)
        tell(row)
    best = finest_piecewise_linear(world, settings)
    floor = truth.errors(best)
    return Front(
        title, rows, floor["area 0"], floor["mixed 0"], banding(world, best),
        len(truth.sets["area"]), len(truth.sets[OF_ALL_RAYS]), float(truth.own_error[0]), settings.trace_distance,
        settings.seed, _buried(world, truth) if title == GATED else None,
        {one.name: {**options, **one.options} for one in ours},
    )  # fmt: skip


def _buried(world: World, truth: SurfaceTruth) -> int:
    """Points on props under the ground, of those that count only where back faces are counted of all rays."""
    rows = np.setdiff1d(truth.sets[OF_ALL_RAYS], truth.sets["area"])
    points = np.einsum("ij,ijk->ik", truth.weights[rows], world.positions[truth.corners[rows]]) + world.origin
    return int(np.count_nonzero(under_the_field(points)))


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
    for one, (result, _), seconds in zip(ours, jobs, bakes_timed(mesh, jobs), strict=True):
        ao = load_result(Path(result), verify=False).field.ao
        yield _row(title, "Obscura", one.name, seconds, ao, truth, world)


def _peer_rows(
    title: str,
    folder: Path,
    settings: BakeSettings,
    python: Path,
    truth: SurfaceTruth,
    world: World,
) -> Iterator[FrontRow]:
    open_truth: SurfaceTruth | None = None
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
                if not peer.bounded and open_truth is None:
                    open_truth = _truth(world, settings.replaced(max_distance=UNBOUNDED))
                own = truth if peer.bounded or open_truth is None else open_truth
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
    p999 = float(truth.percentile(ao, 99.9, "area")[0])
    return FrontRow(
        title, baker, effort, seconds, errors["area 0"], errors["mixed 0"], p999, banding(world, ao),
        errors[f"{OF_ALL_RAYS} 0"], bounded,
    )  # fmt: skip
