"""What an object's keys change about its geometry, counted: a repair that was asked for is reported all the same."""

from __future__ import annotations

import numpy as np

from bake.scene.orientation import oriented, says_orientation
from bake.types import Finding, Scene


def key_findings(scene: Scene) -> list[Finding]:
    """Faces turned, normals ignored and twins made one, by object, in scene order."""
    findings: list[Finding] = []
    for item in scene.objects:
        if not says_orientation(item.keys):
            continue
        mesh = scene.meshes[item.mesh]
        sides = oriented(mesh, item.keys)
        needless, known = int(sides.needless.sum()), int(np.count_nonzero(mesh.normals.any(axis=1)))
        if sides.turned:
            detail = f"{sides.turned:,} triangles were turned round, because winding is {item.keys.winding}."
            findings.append(Finding(item.path, "turned-faces", sides.turned, detail, "info"))
        if item.keys.normals == "faces" and known:
            detail = f"The normals of {known:,} vertices are ignored, because normals is faces."
            findings.append(Finding(item.path, "ignored-normals", known, detail, "info"))
        if needless:
            detail = (
                "Opposed triangles on the same vertices are one surface, because two_sided is set; one of each stays."
            )
            findings.append(Finding(item.path, "merged-twins", needless, detail, "info"))
    return findings
