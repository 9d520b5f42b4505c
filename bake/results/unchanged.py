"""Tells whether a bake would only give again what is already stored."""

from __future__ import annotations

from collections.abc import Mapping, Set
from dataclasses import Field, fields
from pathlib import Path
from typing import Any

from bake.errors import ResultError
from bake.results.load import load_result
from bake.results.manifest import COMPLETE, read_manifest
from bake.setting_fields import option_name
from bake.settings import BakeSettings

# The device and tracer asked for may be "auto": what counts is which ones were found. The quality preset only fills
# rays and samples, which are compared themselves.
_NOT_COMPARED = ("device", "tracer", "quality")


def is_current(
    folder: Path,
    *,
    files: Mapping[str, str],
    settings: BakeSettings,
    device: str,
    tracer: str,
    versions: Mapping[str, str],
    apart_from: str = "",
) -> bool:
    """Whether `folder` holds, undamaged, the result that these inputs would give.

    Args:
        folder: A result folder; it need not exist.
        files: The scene's files with their SHA-256, as in `Scene.files`.
        settings: What would be baked with.
        device, tracer: What would trace, as in `BakeResult`.
        versions: Library versions, as in `BakeResult`.
        apart_from: Settings that affect this stage first may differ (see `setting`): all before it would be the same.
    """
    ignored = {*_NOT_COMPARED, *(option_name(item.name) for item in fields(settings) if _affects(item) == apart_from)}
    try:
        manifest = read_manifest(folder)
        agrees = (
            manifest.schema in COMPLETE  # an older one may lack what this version bakes
            and not manifest.stale
            and not manifest.skipped  # what was rebaked is as good, but not the same bits
            and dict(manifest.files) == dict(files)
            and _compared(manifest.settings, ignored) == _compared(settings, ignored)
            and (manifest.device, manifest.tracer) == (device, tracer)
            and dict(manifest.versions) == dict(versions)
        )
        if agrees:
            load_result(folder)
    except ResultError:
        return False
    return agrees


def _compared(settings: BakeSettings, ignored: Set[str]) -> dict[str, object]:
    return {option: value for option, value in settings.to_json().items() if option not in ignored}


def _affects(item: Field[Any]) -> str:
    return item.metadata["affects"]
