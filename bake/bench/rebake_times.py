"""How long a rebake takes after one prop moved, against a whole bake of the same level in the same run."""

from __future__ import annotations

import dataclasses
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from bake.bench.large_level import write_large_level
from bake.bench.table import Measurements
from bake.devices import resolve
from bake.pipeline import bake, settings_for
from bake.rebake.session import RebakeSession
from bake.rebake.types import Partial, RebakeOutcome
from bake.scene import load_scene
from bake.stages import StageClock, drained
from bake.types import Scene

FIRST_SECONDS, FINAL_SECONDS, SPEED_UP, RAYS = 0.4, 3.0, 20.0, 3.0
"""Gates for one prop moved in a level of 0.5 to 1 M triangles: first values, final ones, whole bake over final, and
rays traced over rays changed."""

MOVES = 5

_T = TypeVar("_T")


def measure_rebake_times(path: Path | None, options: Mapping[str, Any]) -> Measurements:
    """One row a move of a prop, and two for alpha and the threshold alone.

    Args:
        path: A scene; the large level of the benchmarks if None.
        options: Bake options by long name.
    """
    with tempfile.TemporaryDirectory() as folder:
        source = write_large_level(Path(folder))[0] if path is None else path
        settings = settings_for(source, options)
        scene = load_scene(source, crease_angle=settings.crease_angle)
    device, clock = resolve(settings.device), StageClock()
    result = drained(bake(scene, settings, device, clock))
    whole = clock.seconds
    rows: list[dict[str, Any]] = []
    begin = time.perf_counter()
    with RebakeSession(result, scene, device) as session:
        drained(session.prepare())
        prepared = time.perf_counter() - begin
        for number in _props(scene):
            scene = _moved(scene, number)
            row = _row(session, scene, settings, scene.objects[number].path)
            row["passed"] = (
                row["first_s"] <= FIRST_SECONDS
                and row["values_s"] <= FINAL_SECONDS
                and whole / row["values_s"] >= SPEED_UP
                and row["traced_per_changed"] <= RAYS
            )
            rows.append({**row, "speed_up": whole / row["values_s"]})
        for name, changed in (
            ("alpha", settings.replaced(alpha=0.1)),
            ("threshold", settings.replaced(alpha=0.1, back_face_threshold=0.2)),
        ):
            rows.append(_row(session, scene, changed, name))
    notes = [
        f"{result.world.face_count:,} triangles, {result.world.vertex_count:,} vertices, "
        f"{len(result.samples):,} samples of {settings.rays} rays; whole bake {whole:.1f} s; "
        f"session made ready in {prepared:.1f} s",
        "first: until the first values are there; values: until the final ones are; all: with everything that hangs on "
        "them",
    ]
    return Measurements("rebake: one prop moved", rows, notes, seeds={"scene": 1, "bake": settings.seed})


def _row(session: RebakeSession, scene: Scene, settings: Any, name: str) -> dict[str, Any]:
    begin, first, values = time.perf_counter(), float("nan"), float("nan")
    work = session.rebake(scene, settings)
    while True:
        try:
            step = next(work)
        except StopIteration as end:
            outcome: RebakeOutcome = end.value
            break
        if isinstance(step, Partial):
            now = time.perf_counter() - begin
            first = now if np.isnan(first) else first
            values = now if step.final else values
    report = outcome.report
    return {
        "edit": name,
        "first_s": first,
        "values_s": values,
        "all_s": time.perf_counter() - begin,
        "checked": report.samples_checked,
        "whole": report.samples_whole,
        "rays_tested": report.rays_tested,
        "rays_traced": report.rays_traced,
        "rays_changed": report.rays_changed,
        "traced_per_changed": report.rays_traced / max(report.rays_changed, 1),
        "vertices": report.vertices_changed,
        **{f"{stage}_s": seconds for stage, seconds in report.stages.items() if seconds >= 0.005},
    }


def _props(scene: Scene) -> list[int]:
    """Objects of moderate size, spread over the scene."""
    sizes = np.array([np.ptp(scene.meshes[item.mesh].positions, axis=0).max(initial=0.0) for item in scene.objects])
    props = np.flatnonzero(sizes <= max(0.1 * float(sizes.max()), float(np.median(sizes))))
    return [int(number) for number in props[np.linspace(0, len(props) - 1, MOVES).astype(int)]]


def _moved(scene: Scene, number: int) -> Scene:
    item = scene.objects[number]
    transform = item.transform.copy()
    transform[:3, 3] += (0.7, 0.1, -0.4)
    moved = dataclasses.replace(item, transform=transform)
    return dataclasses.replace(scene, objects=(*scene.objects[:number], moved, *scene.objects[number + 1 :]))
