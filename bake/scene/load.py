"""A scene file → `Scene`, whatever its format."""

from __future__ import annotations

import logging
from dataclasses import replace
from pathlib import Path

import numpy as np

from bake.errors import SceneError
from bake.scene.copies import with_copies
from bake.scene.files import FileLedger
from bake.scene.gltf import parse_gltf
from bake.scene.obj import parse_obj
from bake.scene.parsed import ParsedFile
from bake.scene.ply import parse_ply
from bake.scene.roles import assign_roles
from bake.scene.side_file import read_side_file
from bake.scene.validate import find_problems
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
    path = Path(path)
    parser = PARSERS.get(path.suffix.lower())
    if parser is None:
        if path.suffix.lower() in LATER:
            raise SceneError("USD is not supported yet", where=str(path), remedy="export it as glTF (.glb)")
        raise SceneError(
            f"{path.suffix or 'a file without suffix'} is no scene format",
            where=str(path),
            remedy=f"use {', '.join(PARSERS)}",
        )
    ledger = FileLedger(path)
    try:
        with np.errstate(all="ignore"):
            return _load(parser(ledger, crease_angle=crease_angle), ledger)
    except MemoryError:
        raise SceneError("the scene does not fit into memory", where=str(path), remedy="split it") from None


def _load(parsed: ParsedFile, ledger: FileLedger) -> Scene:
    side_file = read_side_file(ledger)
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
    problems = find_problems(scene)
    log.info("%s: %d objects, %d meshes", ledger.scene.name, len(objects), len(parsed.meshes))
    return replace(scene, findings=(*scene.findings, *problems))
