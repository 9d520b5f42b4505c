"""A scene file → `Scene`, whatever its format."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Generator, Iterable
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from bake.errors import SceneError
from bake.scene.copies import with_copies
from bake.scene.files import FileLedger, hash_files
from bake.scene.gltf import parse_gltf
from bake.scene.obj import parse_obj
from bake.scene.parsed import ParsedFile
from bake.scene.ply import parse_ply
from bake.scene.roles import assign_roles
from bake.scene.side_file import read_side_file
from bake.scene.validate import MeshChecks, find_problems, refuse_far
from bake.types import Scene

log = logging.getLogger(__name__)

PARSERS = {".gltf": parse_gltf, ".glb": parse_gltf, ".obj": parse_obj, ".ply": parse_ply}
LATER = {".usd", ".usda", ".usdc", ".usdz"}


def load_scene(path: Path, *, crease_angle: float = 40.0) -> Scene:
    """Reads a level: its geometry, materials, roles, regions, and what is odd about it.

    Args:
        path: glTF 2.0 (`.gltf`, `.glb`), `.obj` or `.ply`.
        crease_angle: In degrees; where a file has no normals, faces that meet at a larger angle stay apart.

    Returns:
        The scene, with at least one triangle.

    Raises:
        SceneError: the file, one that it refers to, or its side file is missing, damaged or not understood; or the
            scene holds nothing that can be baked.
    """
    return looked_over(load_unchecked(path, crease_angle=crease_angle))


def load_unchecked(path: Path, *, crease_angle: float = 40.0) -> Scene:
    """Like `load_scene`, without the findings that `looked_over` adds.

    Raises:
        SceneError: as there.
    """
    return SceneReader(path, only_once=True).read_unchecked(crease_angle=crease_angle)


def looked_over(scene: Scene) -> Scene:
    """A scene of `load_unchecked` with what is odd about its objects among the findings.

    Raises:
        SceneError: looking it over takes more memory than there is.
    """
    with np.errstate(all="ignore"), _within_memory(scene.path):
        return _with_problems(scene, MeshChecks())


@contextmanager
def _within_memory(path: Path) -> Generator[None]:
    try:
        yield
    except MemoryError:
        raise SceneError("the scene does not fit into memory", where=str(path), remedy="split it") from None


def _with_problems(scene: Scene, checks: MeshChecks) -> Scene:
    return replace(scene, findings=(*scene.findings, *find_problems(scene, checks)))


def _parser(path: Path) -> Callable[..., ParsedFile]:
    parser = PARSERS.get(path.suffix.lower())
    if parser is None:
        if path.suffix.lower() in LATER:
            raise SceneError("USD is not supported yet", where=str(path), remedy="export it as glTF (.glb)")
        raise SceneError(
            f"{path.suffix or 'a file without suffix'} is no scene format",
            where=str(path),
            remedy=f"use {', '.join(PARSERS)}",
        )
    return parser


class SceneReader:
    """Reads one scene again and again. What lies in the scene's own files is parsed anew only if one of them changed.

    So a scene of which only the side file changed is there at once, and its meshes and materials are the very objects
    of the scene read before; one of which no file at all changed is the very scene read before. Several threads may use
    it.

    Args:
        path: As for `load_scene`.
        only_once: It will not be read again.
    """

    def __init__(self, path: Path, *, only_once: bool = False) -> None:
        self.path, self._only_once = Path(path), only_once
        self._parsed: tuple[ParsedFile, dict[str, str], dict[str, _Stamp], float] | None = None
        self._checks = MeshChecks()
        self._last: Scene | None = None
        self._lock = threading.Lock()

    def read(self, *, crease_angle: float = 40.0) -> Scene:
        """The scene as its files are now; see `load_scene`.

        Raises:
            SceneError: as there.
        """
        return self._read(crease_angle, self._looked_over)

    def read_unchecked(self, *, crease_angle: float = 40.0) -> Scene:
        """The same without what is odd about the objects among its findings.

        Raises:
            SceneError: as for `read`.
        """
        return self._read(crease_angle, self._assembled)

    def _read(self, crease_angle: float, finish: Callable[[ParsedFile, FileLedger], Scene]) -> Scene:
        parser = _parser(self.path)
        ledger = FileLedger(self.path)
        with np.errstate(all="ignore"), _within_memory(self.path), self._lock:
            return finish(self._parse(parser, ledger, crease_angle), ledger)

    def _parse(self, parser: Callable[..., ParsedFile], ledger: FileLedger, crease_angle: float) -> ParsedFile:
        if self._parsed is not None:
            parsed, seen, stamps, angle = self._parsed
            if angle == crease_angle and stamps == _stamps(ledger.folder, stamps):
                ledger.remember(seen)
                return parsed
        self._parsed, self._checks, self._last = None, MeshChecks(), None
        parsed = parser(ledger, crease_angle=crease_angle)
        if self._only_once:
            return parsed
        seen = dict(ledger.seen)
        stamps = _stamps(ledger.folder, seen)
        if dict(hash_files(self.path, seen)) == seen:  # else somebody writes just now, and the stamps are too new
            self._parsed = (parsed, seen, stamps, crease_angle)
        return parsed

    def _looked_over(self, parsed: ParsedFile, ledger: FileLedger) -> Scene:
        scene = self._assembled(parsed, ledger)
        if scene is not self._last:
            self._last = scene = _with_problems(scene, self._checks)
        return scene

    def _assembled(self, parsed: ParsedFile, ledger: FileLedger) -> Scene:
        side_file = read_side_file(ledger)
        if self._parsed is not None and self._last is not None and self._last.files == ledger.seen:
            return self._last
        if not parsed.placements:
            raise SceneError("the scene has no triangles", where=str(ledger.scene), remedy="export it with its meshes")
        placements = with_copies(parsed.placements, side_file.copies, str(ledger.folder / side_file.name))
        objects, role_findings = assign_roles(placements, side_file, str(ledger.scene), parsed.meshes)
        scene = Scene(
            path=ledger.scene,
            meshes=tuple(parsed.meshes),
            materials=tuple(parsed.materials),
            objects=tuple(objects),
            regions=side_file.regions,
            bake_options=side_file.bake_options,
            findings=(*parsed.findings, *role_findings),
            files=ledger.seen,
            up_axis=parsed.up_axis,
        )
        refuse_far(scene, self._checks)
        log.info("%s: %d objects, %d meshes", ledger.scene.name, len(objects), len(parsed.meshes))
        return scene


_Stamp = tuple[int, int, int] | None
"""Time of change, size and number of a file; None where there is none."""


def _stamps(folder: Path, names: Iterable[str]) -> dict[str, _Stamp]:
    found: dict[str, _Stamp] = {}
    for name in names:
        try:
            stat = (folder / name).stat()
            found[name] = (stat.st_mtime_ns, stat.st_size, stat.st_ino)
        except (OSError, ValueError):
            found[name] = None
    return found
