"""Two published bakes repeated in size: Sloan et al. 2013, Table 1, and the sled of NVIDIA's baking sample."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from bake.bench.isolation import isolated
from bake.bench.scaling_device import runnable
from bake.bench.table import Measurements
from bake.bench.workload_published import (
    LEVEL,
    LEVEL_SOURCE,
    LEVEL_TOTAL_S,
    SLED,
    SLED_SOURCE,
    SLED_TOTAL_S,
    PublishedStage,
)
from bake.bench.workload_scenes import SEED, write_level, write_sled
from bake.bench.workload_stages import Stage, run_stages
from bake.errors import SettingsError

LEVEL_OPTIONS: Mapping[str, Any] = {
    "rays": 256,
    "samples-per-face": "4:4",
    "alpha": 1.0,
    "volume-directions": 1024,
    "region-directions": 1024,
    "skip": "decorators",
}
SLED_OPTIONS: Mapping[str, Any] = {
    "rays": 64,
    "samples-per-face": "3:3",
    "alpha": 1.0,
    "kernel": "occlusion",
    "max-distance": 135.5,
    "ground": "+y:100:0.03",
}
LEVEL_MOST_S = 5.0
"""Gate on CUDA, for a card of the class of an H100."""

CPU_SHARE = 0.01
"""Part of the level's points that is traced on the CPU unless it is said otherwise."""


def measure_workloads(options: Mapping[str, Any], *, share: float | None = None) -> tuple[Measurements, Measurements]:
    """Bakes both in fresh processes, stage by stage beside what was published.

    Args:
        options: Bake options by long name; they win over those of the workloads.
        share: In (0, 1]: part of the points that is traced; without it all on CUDA, and on the CPU 0.01 of the level's
            and all of the sled's.

    Raises:
        SettingsError: the share is no such number.
    """
    if share is not None and not 0.0 < share <= 1.0:
        raise SettingsError(f"share {share:g}", where="--share", remedy="use a number above 0 and up to 1")
    options, device = runnable(options)
    shares = (share, share) if share is not None else ((1.0, 1.0) if device.is_cuda else (CPU_SHARE, 1.0))
    with tempfile.TemporaryDirectory() as folder:
        scene, regions = write_level(Path(folder))
        level = isolated(run_stages, scene, {**LEVEL_OPTIONS, "regions": str(regions), **options}, shares[0])
        sled = isolated(run_stages, write_sled(Path(folder) / "sled.glb"), {**SLED_OPTIONS, **options}, shares[1])
    return (
        side_by_side(
            "workload of Sloan et al.",
            level,
            LEVEL,
            LEVEL_TOTAL_S,
            LEVEL_SOURCE,
            most_s=LEVEL_MOST_S if device.is_cuda else None,
        ),
        side_by_side("workload of NVIDIA's sled", sled, SLED, SLED_TOTAL_S, SLED_SOURCE),
    )


def side_by_side(
    name: str,
    measured: Mapping[str, Any],
    published: Sequence[PublishedStage],
    total_s: float,
    source: str,
    *,
    most_s: float | None = None,
) -> Measurements:
    """One row a published stage, then their sum, then what only ours does.

    Args:
        name: Of the table.
        measured: What `run_stages` tells, or why there is nothing.
        published: Stages as published.
        total_s: As published; it may hold more than the stages do.
        source: Where from, and on which card.
        most_s: Gate on the sum of ours, if there is one.
    """
    if "refused" in measured:
        return Measurements(name, [measured], seeds={"scene": SEED, "bake": 1})
    stages: dict[str, Stage] = {stage.name: stage for stage in measured["stages"]}
    rows: list[dict[str, Any]] = []
    for line in published:
        own = [stages.pop(what) for what in line.ours if what in stages]
        seconds, rays = sum(stage.seconds for stage in own), sum(stage.rays for stage in own)
        row = {**_row(line.name, own, seconds, rays), "published s": line.seconds}
        if line.mrays:
            row["published Mrays/s"] = line.mrays / line.seconds
        rows.append(row if line.below else {**row, "published / ours": line.seconds / max(seconds, 1e-9)})
    extrapolated = any(stage.share < 1.0 for stage in measured["stages"])
    sum_s = sum(row["seconds"] for row in rows)
    gate = {} if most_s is None else {"passed": sum_s <= most_s and not extrapolated}
    rows.append(
        {
            "stage": "all of these", "seconds": sum_s, "extrapolated": extrapolated, "published s": total_s,
            "published / ours": total_s / sum_s, **gate,
        }
    )  # fmt: skip
    rows += [_row(f"{stage.name} (ours alone)", [stage], stage.seconds, stage.rays) for stage in stages.values()]
    shown = [{**row, "extrapolated": "yes" if row["extrapolated"] else ""} for row in rows]
    notes = [
        f"published: {source}; ours: {measured['tracer']}, peak memory {measured['peak memory MB']:,.0f} MB; a "
        "scene of our own making with as much work in every stage",
        "published s of 1 without a ratio: less than a second; nothing is stored on either side",
    ]
    if most_s is not None:
        notes.append(f"gate: all of these in at most {most_s:g} s, nothing extrapolated")
    if extrapolated:
        notes.append(
            "extrapolated: of these stages the share that `traced` names was traced, runs of 64 points spread evenly, "
            "and seconds and rays are divided by it; no such time was measured as a whole"
        )
    return Measurements(name, shown, notes, seeds={"scene": SEED, "bake": 1})


def _row(name: str, own: Sequence[Stage], seconds: float, rays: int) -> dict[str, Any]:
    row: dict[str, Any] = {"stage": name, "ours did": "; ".join(stage.work for stage in own if stage.work)}
    share = min((stage.share for stage in own), default=1.0)
    row |= {"traced": f"{100.0 * share:.3g} %" if rays else "", "seconds": seconds, "extrapolated": share < 1.0}
    if rays:
        row |= {"Mrays": rays / 1e6, "Mrays/s": rays / max(seconds, 1e-9) / 1e6}
    return row
