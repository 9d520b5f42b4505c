"""Hands a result to other tools, in the format that the file's suffix names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from bake.errors import InputError
from bake.results.export_glb import write_glb_export
from bake.results.export_npz import write_npz
from bake.results.export_obj import write_obj
from bake.results.export_ply import write_ply
from bake.results.export_vao import write_vao
from bake.results.exported_ao import column_of
from bake.types import BakeResult, Finding, Scene


@dataclass(frozen=True, slots=True)
class ExportRequest:
    """What is to be exported and how.

    Attributes:
        result: What was baked.
        column: AO column for formats that hold a single value a vertex.
        color: Also write AO as vertex colour, where the format can do without.
        scene: The scene the result was baked from; needed to keep a glTF document.
    """

    result: BakeResult
    column: int
    color: bool
    scene: Scene | None


Exporter = Callable[[ExportRequest, Path], tuple[Finding, ...]]


def _plain(writer: Callable[[BakeResult, Path, int], None]) -> Exporter:
    def run(request: ExportRequest, path: Path) -> tuple[Finding, ...]:
        writer(request.result, path, request.column)
        return ()

    return run


def _glb(request: ExportRequest, path: Path) -> tuple[Finding, ...]:
    return write_glb_export(request.result, path, request.column, color=request.color, scene=request.scene)


_EXPORTERS: Mapping[str, Exporter] = {
    ".npz": _plain(write_npz),
    ".ply": _plain(write_ply),
    ".glb": _glb,
    ".obj": _plain(write_obj),
    ".vao": _plain(write_vao),
}
EXPORT_SUFFIXES: tuple[str, ...] = tuple(_EXPORTERS)


def needs_scene(result: BakeResult, path: Path) -> bool:
    """Whether `export` to `path` wants the scene, because it keeps the document that the result came from."""
    return path.suffix.lower() == ".glb" and result.scene_path.suffix.lower() in (".glb", ".gltf")


def export(
    result: BakeResult,
    path: Path,
    *,
    distance: float | None = None,
    color: bool = False,
    scene: Scene | None = None,
) -> tuple[Finding, ...]:
    """Writes `result` to `path`; what was there is replaced only once the new file is whole.

    Args:
        result: What was baked.
        path: The file; its suffix, one of `EXPORT_SUFFIXES`, decides the format.
        distance: The baked distance in metres for formats that hold one value a vertex; the longest one by default.
        color: In a GLB, write AO as `COLOR_0` too.
        scene: The scene as loaded from `result.scene_path`, where `needs_scene` says so.

    Returns:
        What the format could not express, by object.

    Raises:
        InputError: unknown suffix or distance.
        ResultError: the scene's files changed since the bake.
        StorageError: the file could not be written.
    """
    exporter = _EXPORTERS.get(path.suffix.lower())
    if exporter is None:
        raise InputError(
            f"cannot export to {path.suffix or 'a file without suffix'}",
            where=str(path),
            remedy=f"use one of {' '.join(EXPORT_SUFFIXES)}",
        )
    return exporter(ExportRequest(result, column_of(result, distance), color, scene), path)
