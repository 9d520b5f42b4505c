"""How good the smoothing is that the samples ask for themselves, against the best fixed one and the default."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from bake.bench.isolation import isolated
from bake.bench.surface_truth import SurfaceTruth, surface_truth, trace_samples
from bake.bench.synthetic import comparison_field, write_ply
from bake.bench.table import Measurements, bake_seed
from bake.pipeline import settings_for
from bake.samples import place_samples
from bake.scene import flatten, load_scene
from bake.settings import BakeSettings
from bake.solve import VertexMapper
from bake.solve.alpha_choice import CANDIDATES, choose_alpha
from bake.types import World

BUDGETS: Mapping[str, Mapping[str, Any]] = {
    "1:1 × 8": {"samples-per-face": "1:1", "rays": 8},
    "1:1 × 16": {"samples-per-face": "1:1", "rays": 16},
    "1:4 × 16": {"samples-per-face": "1:4", "rays": 16},
    "4:4 × 16": {"samples-per-face": "4:4", "rays": 16},
    "4:16 × 64": {"samples-per-face": "4:16", "rays": 64},
}
REFERENCE_RAYS, POINTS = 1024, 8_000
_DEFAULT = BakeSettings().alpha
_FIELD: Mapping[str, Any] = {"kernel": "occlusion", "max-distance": 10}


def measure_alpha(scenes: Iterable[Path], options: Mapping[str, Any]) -> Measurements:
    """Rows by scene and by samples × rays.

    Args:
        scenes: Scene files; without any, the field of `bench accuracy` with its plain occlusion.
        options: Bake options by long name; rays and samples are the benchmark's.
    """
    paths = list(scenes)
    title = "alpha" if paths else "alpha: comparison field"
    rows: list[dict[str, Any]] = []
    with TemporaryDirectory() as folder:
        if not paths:
            paths, options = [Path(folder) / "comparison field.ply"], {**_FIELD, **options}
            write_ply(paths[0], comparison_field())
        for path in paths:
            outcome = isolated(_rows, path, options)
            rows += outcome.get("rows", [outcome])
    notes = [
        f"RMSE of the interpolated AO, root of the mean square over the distances, against {REFERENCE_RAYS:,} rays at "
        f"{POINTS:,} points, half by area and half evenly over faces; candidates {', '.join(map(str, CANDIDATES))}",
        f"chosen: from the samples alone, by least estimated error; ratios: RMSE at the chosen alpha over that at "
        f"{_DEFAULT:g}, and over that at the best candidate, which takes the reference to know",
    ]
    return Measurements(title, rows, notes, seeds={"bake": bake_seed(options), "added noise": 1})


def _rows(path: Path, options: Mapping[str, Any]) -> dict[str, Any]:
    settings = settings_for(path, options)
    world = flatten(load_scene(path, crease_angle=settings.crease_angle), settings)
    reference = settings.replaced(rays=REFERENCE_RAYS, seed=(settings.seed + 6) % 2**32)
    truth = surface_truth(world, reference, points=POINTS)
    budgets = {name: settings_for(path, {**options, **budget}) for name, budget in BUDGETS.items()}
    return {"rows": [_row(path.name, name, world, truth, own) for name, own in budgets.items()]}


def _row(scene: str, budget: str, world: World, truth: SurfaceTruth, settings: BakeSettings) -> dict[str, Any]:
    samples = place_samples(world, settings)
    tally = trace_samples(world, samples, settings)
    mapper = VertexMapper(world, samples, settings)
    valid = tally.valid(settings.back_face_threshold)
    choice = choose_alpha(world, samples, tally.ao, valid, mapper, rays=settings.rays)
    errors = [_rms(list(truth.errors(field.ao).items())) for field in choice.fields]
    by_alpha = dict(zip(CANDIDATES, errors, strict=True))
    best = min(by_alpha, key=lambda alpha: by_alpha[alpha])
    own = by_alpha[choice.alpha]
    return {
        "scene": scene,
        "samples × rays": budget,
        "noise": choice.noise,
        "chosen": choice.alpha,
        "best": best,
        "RMSE chosen": own,
        f"RMSE {_DEFAULT:g}": by_alpha[_DEFAULT],
        "RMSE best": by_alpha[best],
        f"over {_DEFAULT:g}": own / by_alpha[_DEFAULT],
        "over best": own / by_alpha[best],
    }


def _rms(errors: Sequence[tuple[str, float]]) -> float:
    squares = [error**2 for name, error in errors if name.startswith("mixed")]
    return (sum(squares) / len(squares)) ** 0.5
