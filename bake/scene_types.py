"""A level as it was read: what the loaders make and `flatten` turns into a `World`."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bake.arrays import Float32Array, Float64Array, Int32Array


class Role(enum.StrEnum):
    """What an object is to the bake: who casts, who receives, and how."""

    STATIC = "static"
    BLOCKER = "blocker"
    RECEIVER = "receiver"
    TREE = "tree"
    SHRUB = "shrub"
    SMALL = "small"
    LOD = "lod"
    IGNORE = "ignore"

    @property
    def casts_opaque(self) -> bool:
        """Whether rays end at this object's triangles."""
        return self in (Role.STATIC, Role.BLOCKER)

    @property
    def receives_per_vertex(self) -> bool:
        """Whether surface samples are placed on this object and mapped to its vertices."""
        return self in (Role.STATIC, Role.RECEIVER)


@dataclass(frozen=True, slots=True)
class Material:
    """What a surface does to a ray.

    Attributes:
        name: Name in the file.
        two_sided: Both sides are a proper outside: a hit on the back never counts as a back face.
        openness: Share of light that passes, in [0, 1]: 0 opaque; the mean of an alpha mask's holes.
        openness_map: Shape (h, w), float32, in [0, 1], row 0 at v = 0: the share per texel of the alpha texture,
            mask cut-off already applied; None without one.
    """

    name: str
    two_sided: bool = False
    openness: float = 0.0
    openness_map: Float32Array | None = None


@dataclass(frozen=True, slots=True)
class PrimitiveRange:
    """Where one source primitive lies inside a `Mesh`, so that an export can find its way back."""

    primitive: int
    first_vertex: int
    vertex_count: int
    first_face: int
    face_count: int


@dataclass(frozen=True, slots=True)
class Mesh:
    """Geometry as stored, in object space, shared by the objects that instance it.

    Attributes:
        name: Name in the file.
        positions: Shape (n, 3), float64.
        normals: Shape (n, 3), float32, unit length; zero where the file had none and none could be made.
        faces: Shape (m, 3), int32, corners counter-clockwise seen from outside.
        face_material: Shape (m,), int32, index into `Scene.materials`.
        primitives: The source primitives, in order.
        source_index: Index of the mesh in its file, -1 if the file has no meshes.
        uvs: Shape (n, 2), float32, or None.
        source_vertex: Shape (n,), int32: the stored vertex that each came from (within its primitive for glTF, in the
            file's vertex list otherwise), where vertices were split or gathered; None where they are as stored.
    """

    name: str
    positions: Float64Array
    normals: Float32Array
    faces: Int32Array
    face_material: Int32Array
    primitives: tuple[PrimitiveRange, ...] = ()
    source_index: int = -1
    uvs: Float32Array | None = None
    source_vertex: Int32Array | None = None


@dataclass(frozen=True, slots=True)
class ObjectKeys:
    """What a side file or glTF extras may say of one object beyond its role; None: not said.

    Attributes:
        two_sided: Whether hits on its backs are proper; True also makes one surface of opposed triangles that share
            their vertices.
        offset: How far above its faces rays start, in metres, beyond what rounding asks for.
        samples: Samples on each of its faces.
        alpha: Its own smoothing.
        density: Of a shrub, per metre.
        transmission: Share of light that passes a tree's triangle.
        weld: Whether it shares values with objects that it touches.
        of: Of a level of detail, the path of the finest.
        normals: "file", or "faces": its vertex normals are ignored, rays leave around each face's own.
        winding: "file", "normals": faces are turned to the side that their vertex normals show, or "flipped".
    """

    two_sided: bool | None = None
    offset: float | None = None
    samples: int | None = None
    alpha: float | None = None
    density: float | None = None
    transmission: float | None = None
    weld: bool | None = None
    of: str | None = None
    normals: str | None = None
    winding: str | None = None


@dataclass(frozen=True, slots=True)
class Placing:
    """Where a side file puts an object; see `bake.scene.placing.placed`.

    Attributes:
        translate: Added to its place, in metres.
        rotate: Turns about the world's x, then y, then z axis, in degrees.
        scale: Factors along its own axes.
        pivot: Its own origin, about which it is turned and scaled: world metres, before it is moved.
    """

    translate: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotate: tuple[float, float, float] = (0.0, 0.0, 0.0)
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    pivot: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def is_as_stored(self) -> bool:
        """Whether it leaves the object where the file has it."""
        return not any((*self.translate, *self.rotate)) and self.scale == (1.0, 1.0, 1.0)

    @property
    def origin(self) -> tuple[float, float, float]:
        """Where the object's own origin is now, world metres."""
        x, y, z = (a + b for a, b in zip(self.pivot, self.translate, strict=True))
        return x, y, z


@dataclass(frozen=True, slots=True)
class SceneObject:
    """One placed mesh.

    Attributes:
        path: Node path such as `Level/Trees/oak_03`, unique in the scene (`#1`, `#2` … on repeats).
        mesh: Index into `Scene.meshes`.
        transform: Shape (4, 4), float64, object to world, column vectors.
        role: What it is to the bake.
        keys: Its own settings.
        node: Index of the source node, -1 if the file has no nodes.
        node_instance: Index within the node's EXT_mesh_gpu_instancing, -1 if it is not instanced so.
        placing: What the side file adds to its place; part of `transform` already. None: nobody looked.
        copy_of: Path of the object that the side file made it from; empty if the file has it itself.
    """

    path: str
    mesh: int
    transform: Float64Array
    role: Role = Role.STATIC
    keys: ObjectKeys = ObjectKeys()
    node: int = -1
    node_instance: int = -1
    placing: Placing | None = None
    copy_of: str = ""


@dataclass(frozen=True, slots=True)
class Finding:
    """Something about one object that the user should know: never a silent repair.

    Attributes:
        object: Path of the object, or the file's name.
        what: Stable kebab-case name of the finding, e.g. `zero-area-faces`.
        count: How many elements are concerned.
        detail: One sentence for people.
        severity: "info", "warning" (baked, but look at it) or "set-aside" (not baked).
    """

    object: str
    what: str
    count: int
    detail: str
    severity: str = "warning"


@dataclass(frozen=True, slots=True)
class RegionBox:
    """A visibility region named in the side file: an axis-aligned box in world metres."""

    name: str
    minimum: tuple[float, float, float]
    maximum: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Scene:
    """A level as it was read, before anything is flattened.

    Attributes:
        path: The file it came from.
        meshes, materials, objects: Its content; `objects` in scene order.
        regions: Regions of the side file.
        bake_options: The side file's `[bake]` table, by long option name, not yet validated.
        findings: What validation found, in scene order.
        files: Every file read (scene, buffers, side file, textures), by its path relative to the scene's folder, with
            its SHA-256 in hex; an empty string where a file was looked for and is absent.
        up_axis: 1 for glTF, -1 where the file does not say.
    """

    path: Path
    meshes: tuple[Mesh, ...]
    materials: tuple[Material, ...]
    objects: tuple[SceneObject, ...]
    regions: tuple[RegionBox, ...] = ()
    bake_options: Mapping[str, Any] = field(default_factory=dict[str, Any])
    findings: tuple[Finding, ...] = ()
    files: Mapping[str, str] = field(default_factory=dict[str, str])
    up_axis: int = -1
