"""A bake in figures, for JSON, for the terminal and for the window."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from app.commands.progress import duration
from app.commands.region_figures import region_counts
from bake.regions.region_stage import MODEL_ROWS
from bake.types import BakeResult, Decorators, Role, StageReport, VertexState, World

UNCHANGED = "scene and settings are unchanged since the stored result"
SAME_RAYS = "unchanged since the stored result: only settings of the region models differ"
_MOST_FINDINGS = 8  # on the terminal; JSON has them all


def stages_of(result: BakeResult, *, unchanged: bool, traced: bool = True) -> list[StageReport]:
    """The stage report of a command: of the bake it ran, or of the one it could skip, whole or up to the models."""
    if unchanged:
        return [StageReport(stage.name, "skipped", UNCHANGED) for stage in result.stages]
    if traced:
        return list(result.stages)
    return [
        stage if stage.name in MODEL_ROWS else StageReport(stage.name, "skipped", SAME_RAYS) for stage in result.stages
    ]


def mrays_per_second(stages: list[StageReport]) -> float:
    """Million rays a second over the stages that traced; 0 if none did."""
    seconds = sum(stage.seconds for stage in stages if stage.rays)
    return sum(stage.rays for stage in stages) / seconds / 1e6 if seconds else 0.0


def bake_summary(
    result: BakeResult, path: Path, seconds: float, *, unchanged: bool = False, traced: bool = True
) -> dict[str, Any]:
    """What `bake --json` prints; plain values that JSON can hold.

    Args:
        result: What was baked.
        path: Where it is stored.
        seconds: How long the command took.
        unchanged: The stored result was still current, so that nothing was traced.
        traced: Whether rays were traced; not if only the models of regions were made anew.
    """
    stages = stages_of(result, unchanged=unchanged, traced=traced)
    state = np.bincount(np.asarray(result.field.state), minlength=len(VertexState))
    valid = result.tally.valid(result.settings.back_face_threshold)
    rays = int(result.tally.rays.sum(dtype=np.int64))
    is_new = traced and not unchanged
    return {
        "result": str(path),
        "scene": str(result.scene_path),
        "unchanged": unchanged,
        "seconds": seconds,
        "rays": rays if is_new else 0,
        "rays_skipped": result.rays_skipped + (0 if is_new else rays),
        "mrays_per_s": mrays_per_second(stages),
        "peak_memory_mb": max((stage.peak_memory_mb for stage in stages), default=0.0),
        "device": result.device,
        "tracer": result.tracer,
        "seed": result.settings.seed,
        "distances": list(result.settings.column_distances),
        "stages": [_stage(stage) for stage in stages],
        "faces": result.world.face_count,
        "objects": result.world.object_count,
        "vertices": {
            "total": result.world.vertex_count,
            "filled": int(state[VertexState.FILLED]),
            "unreferenced": int(state[VertexState.UNREFERENCED]),
            "not_baked": int(state[VertexState.NOT_BAKED]),
        },
        "samples": {"total": len(result.samples), "invalid": int(np.count_nonzero(~valid))},
        "solve": {
            "unknowns": result.field.report.unknowns,
            "iterations": result.field.report.iterations,
            "rmse": [value if np.isfinite(value) else None for value in result.field.report.rmse],
        },
        "decorators": decorator_counts(result),
        "dynamic": region_counts(result),
        "warnings": [asdict(finding) for finding in result.findings],
    }


def decorator_counts(result: BakeResult) -> dict[str, Any]:
    """How many decorators of each kind the result has, and what their volume needs."""
    parts = result.decorators or Decorators()
    volume = parts.volume
    return {
        "fog_boxes": 0 if parts.fog is None else len(parts.fog.object),
        "trees": 0 if parts.fits is None else len(parts.fits.object),
        "tree_models": len(parts.models),
        "shrubs": 0 if parts.shrub_scalars is None else len(parts.shrub_scalars.object),
        "small": 0 if parts.small_scalars is None else len(parts.small_scalars.object),
        "lods": sum(
            bool(np.isfinite(result.field.ao[first:last]).any())
            for first, last, role in _vertex_spans(result.world)
            if role is Role.LOD
        ),
        "volume_bricks": 0 if volume is None else len(volume.brick_voxels),
        "volume_voxels": 0 if volume is None else len(volume.voxel),
        "volume_filled_voxels": 0 if volume is None else int(np.count_nonzero(np.asarray(volume.valid) == 0)),
        "volume_memory_mb": 0.0 if volume is None else volume.memory_bytes / 1e6,
    }


def _vertex_spans(world: World) -> Iterator[tuple[int, int, Role]]:
    """First vertex, the one behind the last, and role of each object."""
    first: list[int] = world.first_vertex.tolist()
    return zip(first[:-1], first[1:], world.object_roles, strict=True)


def _stage(stage: StageReport) -> dict[str, Any]:
    return {**asdict(stage), "mrays_per_s": mrays_per_second([stage])}


def summary_text(
    result: BakeResult, path: Path, seconds: float, *, unchanged: bool = False, traced: bool = True
) -> str:
    """The same for people at a terminal."""
    figures = bake_summary(result, path, seconds, unchanged=unchanged, traced=traced)
    vertices, samples = figures["vertices"], figures["samples"]
    if unchanged:
        return f"{path}: {UNCHANGED}; nothing was traced"
    share = 100 * samples["invalid"] / max(samples["total"], 1)
    lines = [
        f"{result.scene_path.name} → {path} in {duration(seconds)} ({result.tracer} on {result.device})",
        "",
        *_stage_lines(stages_of(result, unchanged=False, traced=traced)),
        "",
        f"  vertices  {vertices['total']:,}; {vertices['filled']:,} filled, {vertices['unreferenced']:,} unreferenced",
        f"  samples   {samples['total']:,}; {samples['invalid']:,} invalid ({share:.1f} %)",
        f"  rays      {figures['rays']:,} at {figures['mrays_per_s']:.2f} Mrays/s",
        f"  memory    {figures['peak_memory_mb']:,.0f} MB at most",
    ]
    for column, distance in enumerate(result.settings.column_distances):
        values = result.field.ao[:, column]
        values = values[~np.isnan(values)]
        if len(values):
            low, middle, high = np.quantile(values, (0.05, 0.5, 0.95))
            lines.append(f"  AO        {distance:g} m: median {middle:.2f}, 90 % within {low:.2f} to {high:.2f}")
    lines += [*_decorator_lines(figures["decorators"]), *_region_lines(figures["dynamic"]), *_finding_lines(result)]
    return "\n".join(lines)


def _decorator_lines(counts: dict[str, Any]) -> list[str]:
    """One line, if the scene has any."""
    names = {"trees": "trees", "shrubs": "shrubs", "small": "small decorators", "lods": "lower LODs"}
    there = [f"{counts[key]:,} {name}" for key, name in names.items() if counts[key]]
    if counts["volume_voxels"]:
        there.append(f"volume of {counts['volume_voxels']:,} voxels ({counts['volume_memory_mb']:.1f} MB)")
    return [f"  decorators  {', '.join(there)}"] if there else []


def _region_lines(counts: dict[str, Any]) -> list[str]:
    """One line, if the result has regions."""
    if not counts["regions"]:
        return []
    return [
        f"  regions   {counts['regions']:,} with {counts['models']:,} models, {counts['links']:,} links, "
        f"{counts['bytes'] / 1e3:.1f} kB; mean error {counts['mean_error_regularised']:.3f}, "
        f"worst step {counts['worst_mismatch_after']:.3f}"
    ]


def _stage_lines(stages: list[StageReport]) -> list[str]:
    width = max((len(stage.name) for stage in stages), default=5)
    lines = [f"  {'stage':{width}}  {'seconds':>8}  {'Mrays/s':>8}"]
    for stage in stages:
        rate = f"{mrays_per_second([stage]):.2f}" if stage.rays else ""
        time = f"{stage.seconds:.2f}" if stage.status == "ran" else stage.status
        lines.append(f"  {stage.name:{width}}  {time:>8}  {rate:>8}  {stage.why}".rstrip())
    return lines


def _finding_lines(result: BakeResult) -> list[str]:
    order = {"set-aside": 0, "warning": 1, "info": 2}
    findings = sorted(result.findings, key=lambda finding: (order.get(finding.severity, 1), -finding.count))
    if not findings:
        return []
    shown = findings[:_MOST_FINDINGS]
    lines = [f"  {finding.severity}: {finding.object}: {finding.what} ({finding.count:,})" for finding in shown]
    rest = len(findings) - len(shown)
    return ["", *lines, *([f"  … and {rest:,} more; `report` and --json list them all"] if rest else [])]
