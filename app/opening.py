"""Reading scenes and results for the window; runs in a worker thread and touches no widget."""

from __future__ import annotations

import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from app.document import default_result_folder
from bake.errors import ObscuraError, StorageError
from bake.settings import BakeSettings
from bake.types import BakeResult, Finding, World
from viewer.camera import guessed_up_axis

if TYPE_CHECKING:
    from bake.scene.load import SceneReader

SAMPLE_LEVEL = Path(__file__).resolve().parents[1] / "assets" / "sample_level" / "level.glb"
"""What a user without a file sees."""


@dataclass(frozen=True, slots=True)
class OpenedScene:
    """A scene as read for showing.

    Attributes:
        path: The scene's file.
        result_path: Where the window bakes it to.
        files: Hashes of the files read.
        settings: Of its side file, over the defaults.
        findings: What validation found.
        up_axis: 1 or 2; guessed where the file does not say.
        world: Its geometry.
        reader: Reads it again quickly.
    """

    path: Path
    result_path: Path
    files: dict[str, str]
    settings: BakeSettings
    findings: tuple[Finding, ...]
    up_axis: int
    world: World
    reader: SceneReader


@dataclass(frozen=True, slots=True)
class OpenedResult:
    """A result as read for showing."""

    path: Path
    result: BakeResult
    up_axis: int


def read_scene(path: Path, cache: Path, *, up_axis: int = 0) -> OpenedScene:
    """Reads a scene file.

    Args:
        path: The file.
        cache: Folder that holds the window's own results.
        up_axis: 1 or 2 for files that do not say which way is up; 0 to guess.

    Raises:
        InputError: the file, its side file or its options cannot be used.
    """
    from bake.pipeline import settings_for
    from bake.scene import flatten
    from bake.scene.load import SceneReader

    settings = settings_for(path, {})
    reader = SceneReader(path)
    scene = reader.read(crease_angle=settings.crease_angle)
    world = flatten(scene, settings)
    return OpenedScene(
        path=path.resolve(),
        result_path=default_result_folder(path, cache),
        files=dict(scene.files),
        settings=settings,
        findings=tuple(scene.findings),
        up_axis=scene.up_axis if scene.up_axis in (1, 2) else up_axis or up_axis_of(world),
        world=world,
        reader=reader,
    )


def read_result(path: Path, *, verify: bool, up_axis: int = 0) -> OpenedResult:
    """Reads a result folder.

    Args:
        path: The folder.
        verify: Whether to check that its files are as they were written.
        up_axis: 1 or 2 for scenes that do not say which way is up; 0 to guess.

    Raises:
        ResultError: it is none, or it is damaged.
    """
    from bake.results import load_result

    result = load_result(path, verify=verify)
    up = 1 if result.scene_path.suffix.lower() in (".glb", ".gltf") else up_axis or up_axis_of(result.world)
    return OpenedResult(path.resolve(), result, up)


def read_own_result(path: Path, scene: Path, files: dict[str, str]) -> OpenedResult | None:
    """Reads the window's own result of a scene, if there is one.

    It may be older than the scene's files: what has changed since is then marked, and can be rebaked.

    Args:
        path: The result's folder.
        scene: The scene's file, absolute.
        files: Hashes of the scene's files now.
    """
    from bake.results import is_result, read_manifest

    try:
        if not is_result(path):
            return None
        opened = read_result(path, verify=True)
        is_current = dict(read_manifest(path).files) == files
        return opened if is_current or opened.result.scene_path == scene else None
    except ObscuraError:
        return None  # a damaged cache is baked again, not complained about


def copy_result(source: Path, target: Path) -> Path:
    """Copies a result folder; the target appears whole or not at all.

    Raises:
        StorageError: the target exists and is not empty, or cannot be written.
    """
    if target.exists() and (not target.is_dir() or any(target.iterdir())):
        raise StorageError("the folder is not empty", where=str(target), remedy="choose a new folder")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target.parent, prefix=f".{target.name}-") as staging:
            copied = Path(staging) / "result"
            shutil.copytree(source, copied)
            if target.exists():
                target.rmdir()
            copied.rename(target)
    except OSError as error:
        raise StorageError(f"could not be written ({error.strerror})", where=str(target)) from error
    return target


def up_axis_of(world: World) -> int:
    """Which way is up in a world whose file does not say, from where its surfaces face."""
    faces, positions = np.asarray(world.faces), np.asarray(world.positions)
    step = max(1, len(faces) // 200_000)
    a, b, c = (positions[faces[::step, corner]] for corner in range(3))
    return guessed_up_axis(np.cross(b - a, c - a) / 2.0)
