"""Tells whether a bake would only give again what is already stored."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from bake.errors import ResultError
from bake.results.load import load_result
from bake.results.manifest import SCHEMA, read_manifest
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
) -> bool:
    """Whether `folder` holds, undamaged, the result that these inputs would give.

    Args:
        folder: A result folder; it need not exist.
        files: The scene's files with their SHA-256, as in `Scene.files`.
        settings: What would be baked with.
        device, tracer: What would trace, as in `BakeResult`.
        versions: Library versions, as in `BakeResult`.
    """
    try:
        manifest = read_manifest(folder)
        agrees = (
            manifest.schema == SCHEMA  # an older one may lack what this version bakes
            and dict(manifest.files) == dict(files)
            and _compared(manifest.settings) == _compared(settings)
            and (manifest.device, manifest.tracer) == (device, tracer)
            and dict(manifest.versions) == dict(versions)
        )
        if agrees:
            load_result(folder)
    except ResultError:
        return False
    return agrees


def _compared(settings: BakeSettings) -> dict[str, object]:
    return {option: value for option, value in settings.to_json().items() if option not in _NOT_COMPARED}
