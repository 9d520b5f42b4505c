"""glTF 2.0 (`.gltf`, `.glb`): from the document to meshes, materials and placements."""

from __future__ import annotations

from dataclasses import replace

from bake.scene.files import FileLedger
from bake.scene.gltf_buffers import GltfBuffers
from bake.scene.gltf_document import read_document
from bake.scene.gltf_materials import MaterialReader
from bake.scene.gltf_meshes import MeshReader
from bake.scene.gltf_nodes import read_placements
from bake.scene.parsed import ParsedFile, Placement
from bake.types import Mesh


def parse_gltf(ledger: FileLedger, *, crease_angle: float) -> ParsedFile:
    """Reads the scene file of `ledger` and everything that it refers to.

    Meshes that no object shows are not read. Objects whose mesh has no triangles are left out with a finding.

    Raises:
        SceneError: the file cannot be used; the message names the place.
    """
    document = read_document(ledger)
    buffers = GltfBuffers(document)
    placements, findings = read_placements(document, buffers)
    materials = MaterialReader(document, buffers)
    reader = MeshReader(document, buffers, materials.read(), crease_angle=crease_angle)
    first_shown: dict[int, str] = {}
    for placement in placements:
        first_shown.setdefault(placement.mesh, placement.path)
    meshes: list[Mesh] = []
    new_index: dict[int, int] = {}
    for source_index, path in first_shown.items():
        mesh = reader.read(source_index, path)
        if mesh is not None:
            new_index[source_index] = len(meshes)
            meshes.append(mesh)
    kept: list[Placement] = [
        replace(placement, mesh=new_index[placement.mesh]) for placement in placements if placement.mesh in new_index
    ]
    return ParsedFile(
        meshes=meshes,
        materials=reader.materials,
        placements=kept,
        findings=[*findings, *materials.findings, *reader.findings],
        up_axis=1,
    )
