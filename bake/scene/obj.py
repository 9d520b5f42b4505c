"""Wavefront OBJ: groups and objects kept apart, polygons cut into triangles, normals made where there are none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.errors import SceneError
from bake.scene.files import FileLedger
from bake.scene.normals import crease_normals, unit_vectors
from bake.scene.obj_materials import read_obj_materials
from bake.scene.obj_text import ObjText, read_obj_text
from bake.scene.parsed import ParsedFile, Placement, number_repeats
from bake.scene.polygons import triangulate_polygons
from bake.scene.surface import referenced_vertices
from bake.types import BoolArray, Finding, Float32Array, Int64Array, Mesh


def parse_obj(ledger: FileLedger, *, crease_angle: float) -> ParsedFile:
    """Reads the OBJ file of `ledger` and its material files.

    An object is a pair of `o` and `g` names, `object/group`; pieces of one name belong together wherever they stand.
    Normals are made over the whole file, so that groups which touch shade as one surface.

    Raises:
        SceneError: the file cannot be used; the message names the line or the object.
    """
    file = str(ledger.scene)
    text = read_obj_text(ledger.read(ledger.scene.name, what="the scene file"), file)
    _refuse_not_finite(text, file)
    findings = _first_findings(text, ledger.scene.name)
    materials, material_findings = read_obj_materials(ledger, text.libraries, text.materials)
    triangles, polygon = triangulate_polygons(text.positions[text.corners[:, 0]], text.corner_counts, where=file)
    owner = text.polygon_object[polygon] if len(polygon) else np.zeros(0, np.int64)
    surface = _shaded(text, text.corners[triangles], owner, crease_angle)
    material = text.polygon_material[polygon] if len(polygon) else np.zeros(0, np.int64)
    names = [_path(parts, ledger.scene.stem) for parts in text.objects]
    meshes: list[Mesh] = []
    placements: list[Placement] = []
    textured = any(item.openness_map is not None for item in materials)
    order = np.argsort(owner, kind="stable")
    bounds = np.searchsorted(owner[order], np.arange(len(names) + 1))
    for number, path in enumerate(number_repeats(names)):
        own = order[bounds[number] : bounds[number + 1]]
        if len(own) == 0:
            continue
        placements.append(Placement(path, names[number], len(meshes), np.eye(4)))
        meshes.append(_mesh(path, text, surface, own, material[own], textured=textured))
        if surface.made[own[0]]:
            detail = f"It has no normals: made with a crease angle of {crease_angle:g}°."
            findings.append(Finding(path, "normals-made", len(meshes[-1].positions), detail, "info"))
    return ParsedFile(meshes, materials, placements, [*findings, *material_findings])


@dataclass(frozen=True, slots=True)
class _Surface:
    """Triangles whose corners know what they are made of.

    Attributes:
        position, texture_point: Shape (m, 3): indices into the file's lists; -1: none.
        normal: Shape (m, 3): index into `normals`.
        normals: Shape (n, 3), float32, unit.
        made: Shape (m,): whether the normals were made; the same for all triangles of an object.
    """

    position: Int64Array
    texture_point: Int64Array
    normal: Int64Array
    normals: Float32Array
    made: BoolArray


def _refuse_not_finite(text: ObjText, file: str) -> None:
    finite = np.isfinite(text.positions).all(axis=1)
    if not finite.all():
        number = int(np.argmin(finite))
        raise SceneError(
            f"v number {number + 1} is {text.positions[number].tolist()}",
            where=file,
            remedy="repair the mesh: positions must be finite numbers",
        )


def _first_findings(text: ObjText, name: str) -> list[Finding]:
    findings: list[Finding] = []
    if text.set_aside:
        detail = "Points, lines and free-form surfaces are no triangles."
        findings.append(Finding(name, "not-triangles", text.set_aside, detail, "set-aside"))
    short = int((text.corner_counts < 3).sum())
    if short:
        detail = "Faces with fewer than three corners are left out."
        findings.append(Finding(name, "incomplete-triangle", short, detail, "set-aside"))
    unused = len(text.positions) - int(referenced_vertices(text.corners[:, 0], len(text.positions)).sum())
    if unused:
        findings.append(Finding(name, "unreferenced-vertices", unused, "No face uses these vertices.", "info"))
    return findings


def _path(names: tuple[str, str], stem: str) -> str:
    return "/".join(part for part in names if part) or stem


def _shaded(text: ObjText, corners: Int64Array, owner: Int64Array, crease_angle: float) -> _Surface:
    """Gives every corner a normal: the file's, or for objects that lack some, made ones."""
    lacking = np.zeros(len(text.objects), np.bool_)
    lacking[owner[(corners[:, :, 2] < 0).any(axis=1)]] = True
    made = lacking[owner]
    position, normal = corners[:, :, 0], corners[:, :, 2].copy()
    normals = unit_vectors(text.normals)
    if made.any():
        split = crease_normals(text.positions, position[made], crease_angle)
        normal[made] = split.faces + len(normals)
        normals = np.concatenate((normals, split.normals))
    return _Surface(position, corners[:, :, 1], normal, normals, made)


def _mesh(
    path: str, text: ObjText, surface: _Surface, own: Int64Array, material: Int64Array, *, textured: bool
) -> Mesh:
    """One object's mesh; corners that agree in position, normal and (where it matters) texture point share a vertex."""
    position, normal = surface.position[own].reshape(-1), surface.normal[own].reshape(-1)
    keys = position * np.int64(len(surface.normals) + 1) + normal
    point = surface.texture_point[own].reshape(-1)
    if textured:
        keys = np.unique(keys, return_inverse=True)[1].reshape(-1) * np.int64(len(text.texture_points) + 1) + point + 1
    _, first, faces = np.unique(keys, return_index=True, return_inverse=True)
    uvs = None
    if textured:
        padded = np.concatenate((text.texture_points, np.zeros((1, 2))))
        uvs = np.nan_to_num(padded[point[first]]).astype(np.float32)
    return Mesh(
        name=path,
        positions=text.positions[position[first]],
        normals=surface.normals[normal[first]],
        faces=faces.reshape(-1, 3).astype(np.int32),
        face_material=material.astype(np.int32),
        uvs=uvs,
        source_vertex=position[first].astype(np.int32),
    )
