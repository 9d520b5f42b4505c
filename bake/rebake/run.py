"""A stored result brought up to date: load, follow the edits, store."""

from __future__ import annotations

import fnmatch
import re
import time
from collections.abc import Generator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bake.devices import resolve
from bake.errors import InputError
from bake.rebake.session import DEFAULT_BOUND, RebakeSession
from bake.rebake.types import Partial, RebakeOutcome, RebakeReport
from bake.results import check_destination, load_result, save_result
from bake.scene import load_scene, read_bake_options
from bake.settings import BakeSettings
from bake.stages import patiently
from bake.types import BakeResult, Progress


@dataclass(frozen=True, slots=True)
class RebakeRequest:
    """What to bring up to date, and where to.

    Attributes:
        result_path: A result.
        output_path: A folder: absent, empty or a result that will be replaced; may be the same.
        scene_path: The scene as it is now; where the result's was if None.
        objects: Globs over object paths: what may change; everything if empty.
        bound: Most AO that may be skipped for a sample.
        options: Settings by long option name that are wanted now; all others stay as the result has them.
    """

    result_path: Path
    output_path: Path
    scene_path: Path | None = None
    objects: tuple[str, ...] = ()
    bound: float = DEFAULT_BOUND
    options: Mapping[str, Any] = field(default_factory=dict[str, Any])


@dataclass(frozen=True, slots=True)
class RebakeRun:
    """What came of it.

    Attributes:
        result: As it is stored.
        report: What was done.
        seconds: From the request to the stored result.
        overruled: Options of the side file's `[bake]` table that the result's own settings overrule, as text.
    """

    result: BakeResult
    report: RebakeReport
    seconds: float
    overruled: tuple[str, ...]


def run_rebake(request: RebakeRequest) -> Generator[Progress, None, RebakeRun]:
    """Brings a stored result up to date; close the generator to cancel.

    Raises:
        InputError: the result, the scene, an option or a pattern cannot be used; nothing was traced then.
        ObscuraError: a device failed or the result could not be stored. What was in the folder stays.
    """
    begin = time.perf_counter()
    check_destination(request.output_path)
    stored, _ = yield from patiently("load", lambda: load_result(request.result_path))
    settings = BakeSettings.from_options({**stored.settings.to_json(), **request.options})
    path = request.scene_path or stored.scene_path
    overruled = _overruled(path, settings, request.options)
    scene, _ = yield from patiently("load", lambda: load_scene(path, crease_angle=settings.crease_angle))
    objects = None
    if request.objects:
        objects = _matching(request.objects, tuple(item.path for item in scene.objects))
    with RebakeSession(stored, None, resolve(settings.device), bound=request.bound) as session:
        outcome = yield from _without_values(session.rebake(scene, settings, objects=objects))
    yield Progress("store", 0, 0, time.perf_counter() - begin)
    save_result(outcome.result, request.output_path)  # not to be stopped half-way: it ends either stored or not begun
    return RebakeRun(outcome.result, outcome.report, time.perf_counter() - begin, overruled)


def _without_values(
    steps: Generator[Progress | Partial, None, RebakeOutcome],
) -> Generator[Progress, None, RebakeOutcome]:
    """Only the progress of a rebake: nobody looks at its values on the way."""
    try:
        while True:
            step = next(steps)
            if isinstance(step, Progress):
                yield step
    except StopIteration as end:
        return end.value
    finally:
        steps.close()


def _matching(patterns: tuple[str, ...], paths: tuple[str, ...]) -> frozenset[str]:
    found: set[str] = set()
    for pattern in patterns:
        expression = re.compile(fnmatch.translate(pattern))
        matched = [path for path in paths if path == pattern or expression.match(path)]
        if not matched:
            raise InputError("matches no object", where=f"--objects {pattern}", remedy="check the path or the pattern")
        found.update(matched)
    return frozenset(found)


def _overruled(path: Path, settings: BakeSettings, options: Mapping[str, Any]) -> tuple[str, ...]:
    """What the side file asks for and the result was not baked with; the settings of a result stay with it."""
    said, _ = read_bake_options(path)
    wanted = BakeSettings.from_options({**settings.to_json(), **said}).to_json()
    own = settings.to_json()
    return tuple(
        f"{name} = {wanted[name]} (baked with {own[name]})"
        for name in sorted(said)
        if name not in options and wanted[name] != own[name]
    )
