"""What is odd about a scene, listed by object; what cannot be baked at all is refused."""

from __future__ import annotations

from collections import Counter

import numpy as np

from bake.errors import SceneError
from bake.scene.enclosure import box_corners, enclosing_objects
from bake.scene.key_findings import key_findings
from bake.scene.mesh_check import MeshCheck, check_mesh
from bake.types import Finding, Float64Array, Mesh, Role, Scene

FARTHEST = 1e9  # metres; beyond, products of coordinates leave the range of float32
SMALLEST_SCENE, LARGEST_SCENE = 1.0, 10_000.0  # metres, longest side of a plausible level

# What each count of `MeshCheck` is called, how grave it is, and what it means.
MESH_FINDINGS = (
    ("zero_area_faces", "zero-area-faces", "set-aside", "Triangles without area take no samples; they still block."),
    ("sliver_faces", "sliver-faces", "set-aside", "Triangles too thin for a normal take no samples; they still block."),
    ("duplicate_faces", "duplicate-faces", "warning", "Triangles lie exactly on earlier ones that look the same way."),
    ("opposed_faces", "opposed-faces", "info", "Triangles lie back to back; they count as two-sided."),
    ("unreferenced_vertices", "unreferenced-vertices", "info", "No triangle uses these vertices; they get no value."),
    (
        "inconsistent_edges",
        "inconsistent-winding",
        "warning",
        "Along these edges, two triangles disagree about which side is outside: one of them will count as a back face.",
    ),
    ("non_manifold_edges", "non-manifold-edges", "info", "More than two triangles meet at these edges."),
    ("opposing_normals", "opposing-normals", "warning", "Normals point away from all their triangles; turned round."),
)  # fmt: skip


class MeshChecks:
    """What was found out about meshes, so that a scene that is read again is not looked over again.

    The meshes must stay as they are, and alive: they are told apart by identity.
    """

    def __init__(self) -> None:
        self._checks: dict[int, MeshCheck] = {}
        self._corners: dict[int, Float64Array] = {}
        self.covered: dict[tuple[int, bytes, bytes], float] = {}
        """See `enclosing_objects`."""

    def check(self, mesh: Mesh) -> MeshCheck:
        """What is odd about a mesh."""
        if id(mesh) not in self._checks:
            self._checks[id(mesh)] = check_mesh(mesh)
        return self._checks[id(mesh)]

    def corners(self, mesh: Mesh) -> Float64Array:
        """Corners of a mesh's box in object space."""
        if id(mesh) not in self._corners:
            self._corners[id(mesh)] = box_corners(mesh.positions, mesh.faces)
        return self._corners[id(mesh)]


def find_problems(scene: Scene, checks: MeshChecks | None = None) -> list[Finding]:
    """Findings in scene order; a mesh that many objects share is looked over once and reported at the first.

    Args:
        scene: As loaded.
        checks: What is known of its meshes already.

    Raises:
        SceneError: an object reaches farther than 10⁹ m from the origin.
    """
    shown = Counter(item.mesh for item in scene.objects)
    checks = checks or MeshChecks()
    boxes = refuse_far(scene, checks)
    findings: list[Finding] = []
    done: set[int] = set()
    for item in scene.objects:
        if item.mesh not in done:
            done.add(item.mesh)
            findings += _mesh_findings(checks.check(scene.meshes[item.mesh]), item.path, shown[item.mesh])
    return [
        *findings,
        *key_findings(scene),
        *_transform_findings(scene),
        *_enclosing_findings(scene, boxes, checks),
        *_size_findings(scene, boxes),
    ]


def world_boxes(scene: Scene, checks: MeshChecks | None = None) -> Float64Array:
    """A world box around each object, shape (o, 2, 3): that of its turned object-space box, so never too small."""
    checks = checks or MeshChecks()
    corners = {index: checks.corners(mesh) for index, mesh in enumerate(scene.meshes)}
    linear = np.stack([item.transform[:3, :3] for item in scene.objects])
    shift = np.stack([item.transform[:3, 3] for item in scene.objects])
    own = np.stack([corners[item.mesh] for item in scene.objects])
    world = own @ linear.transpose(0, 2, 1) + shift[:, None]
    return np.stack((world.min(axis=1), world.max(axis=1)), axis=1)


def refuse_far(scene: Scene, checks: MeshChecks | None = None) -> Float64Array:
    """The boxes of `world_boxes`.

    Raises:
        SceneError: as `find_problems`.
    """
    boxes = world_boxes(scene, checks)
    reach = np.abs(boxes).max(axis=(1, 2))
    if not (reach <= FARTHEST).all():
        number = int(np.argmax(~(reach <= FARTHEST)))
        raise SceneError(
            f"the object reaches {reach[number]:.3g} m from the origin",
            where=f"{scene.path}: {scene.objects[number].path}",
            remedy="check its transform and its positions: the limit is 1e9 m",
        )
    return boxes


def _mesh_findings(check: MeshCheck, path: str, shown: int) -> list[Finding]:
    suffix = f" {shown} objects share this mesh." if shown > 1 else ""
    return [
        Finding(path, what, getattr(check, name), detail + suffix, severity)
        for name, what, severity, detail in MESH_FINDINGS
        if getattr(check, name)
    ]


def _transform_findings(scene: Scene) -> list[Finding]:
    linear = np.stack([item.transform[:3, :3] for item in scene.objects])
    lengths = np.linalg.norm(linear, axis=1).prod(axis=1)
    flat = np.flatnonzero(np.abs(np.linalg.det(linear)) <= 1e-12 * lengths)
    if len(flat) == 0:
        return []
    detail = "The transform flattens the object; what is left without area takes no samples."
    more = f" It is the first of {len(flat)} such objects." if len(flat) > 1 else ""
    first = scene.objects[int(flat[0])].path
    return [Finding(first, "flattening-transform", len(flat), detail + more, "set-aside")]


def _enclosing_findings(scene: Scene, boxes: Float64Array, checks: MeshChecks) -> list[Finding]:
    detail = "It closes off the space around all other objects: if it is a sky, give it the role ignore."
    return [
        Finding(scene.objects[number].path, "encloses-scene", 1, detail, "warning")
        for number in enclosing_objects(scene, boxes, checks.covered)
    ]


def _size_findings(scene: Scene, boxes: Float64Array) -> list[Finding]:
    counts = np.array([item.role is not Role.IGNORE for item in scene.objects])
    counts |= not counts.any()
    longest = float((boxes[counts, 1].max(axis=0) - boxes[counts, 0].min(axis=0)).max())
    if SMALLEST_SCENE <= longest <= LARGEST_SCENE:
        return []
    detail = f"The scene measures {longest:.3g} m: if its unit is not the metre, scale it or the distances."
    return [Finding(scene.path.name, "unlikely-size", 1, detail, "warning")]
