"""Read first: what the stages pass to each other.

    Scene ─flatten→ World ─place_samples→ SampleSet ─trace→ Tally ─map_to_vertices→ VertexField
                                                                          └──── all of it → BakeResult

Everything is frozen. Arrays are shared, not copied: treat them as read-only.
Lengths are metres, AO is 1 where open and 0 where closed, `k` counts the falloff distances.
"""

from __future__ import annotations

import enum
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bake.arrays import (
    BoolArray,
    Float32Array,
    Float64Array,
    Int32Array,
    Int64Array,
    UInt8Array,
    UInt16Array,
    UInt32Array,
)
from bake.decorator_types import Decorators
from bake.region_types import Regions
from bake.scene_types import (
    Finding,
    Material,
    Mesh,
    ObjectKeys,
    Placing,
    PrimitiveRange,
    RegionBox,
    Role,
    Scene,
    SceneObject,
)
from bake.settings import BakeSettings

__all__ = [
    "BakeResult",
    "BoolArray",
    "Decorators",
    "Finding",
    "Float32Array",
    "Float64Array",
    "Int32Array",
    "Int64Array",
    "Material",
    "Mesh",
    "ObjectKeys",
    "Placing",
    "PrimitiveRange",
    "Progress",
    "RegionBox",
    "Regions",
    "Role",
    "SampleSet",
    "Scene",
    "SceneObject",
    "Skipped",
    "SolveReport",
    "StageReport",
    "Tally",
    "UInt8Array",
    "UInt16Array",
    "UInt32Array",
    "VertexField",
    "VertexState",
    "World",
]


class VertexState(enum.IntEnum):
    """How a vertex came by its value; the stored code of `VertexField.state`."""

    BAKED = 0
    FILLED = 1  # referenced, but every sample around it was invalid: filled from its neighbours
    UNREFERENCED = 2  # no triangle uses it; its AO is NaN in memory and 1 in exports
    NOT_BAKED = 3  # belongs to an object that receives no per-vertex AO


@dataclass(frozen=True, slots=True)
class World:
    """The scene flattened for baking: one vertex and one face array, instances expanded, recentred.

    Objects keep scene order; object i owns vertices `first_vertex[i]:first_vertex[i+1]` and faces
    `first_face[i]:first_face[i+1]`. A mirroring transform flips the winding, so that outside stays outside.

    Attributes:
        origin: Shape (3,), float64: what was subtracted from world positions, in metres.
        positions: Shape (n, 3), float64, metres from `origin`.
        normals: Shape (n, 3), float32, unit; zero where unknown (then the face normal serves).
        faces: Shape (m, 3), int32.
        face_object: Shape (m,), int32.
        face_casts: Shape (m,), bool: rays can hit it (degenerate faces included: they block nothing but cost little).
        face_samples: Shape (m,), bool: it takes surface samples (receives, and is no sliver or point).
        face_two_sided: Shape (m,), bool.
        face_openness: Shape (m,), float32, in [0, 1]: share of light that passes.
        first_vertex, first_face: Shape (o + 1,), int64.
        object_paths: o paths, scene order.
        object_roles: o roles.
        object_keys: o key sets.
        object_hash: o content hashes (hex): geometry, transform, role, keys and materials.
        vertex_uv: Shape (n, 2), float32, or None; only with the `alpha_lookup` setting.
        face_texture: Shape (m,), int32, index into `textures`, -1 where openness is uniform; None without lookup.
        textures: Openness maps, each (h, w) float32, wrapped by repetition.
    """

    origin: Float64Array
    positions: Float64Array
    normals: Float32Array
    faces: Int32Array
    face_object: Int32Array
    face_casts: BoolArray
    face_samples: BoolArray
    face_two_sided: BoolArray
    face_openness: Float32Array
    first_vertex: Int64Array
    first_face: Int64Array
    object_paths: tuple[str, ...]
    object_roles: tuple[Role, ...]
    object_keys: tuple[ObjectKeys, ...]
    object_hash: tuple[str, ...]
    vertex_uv: Float32Array | None = None
    face_texture: Int32Array | None = None
    textures: tuple[Float32Array, ...] = ()

    @property
    def vertex_count(self) -> int:
        """Number of vertices."""
        return len(self.positions)

    @property
    def face_count(self) -> int:
        """Number of faces."""
        return len(self.faces)

    @property
    def object_count(self) -> int:
        """Number of objects."""
        return len(self.object_paths)


@dataclass(frozen=True, slots=True)
class SampleSet:
    """Points on the surface where AO is estimated, sorted by face.

    Attributes:
        face: Shape (n,), int32.
        barycentric: Shape (n, 2), float32: weights of corners 0 and 1; corner 2 has the rest.
        area: Shape (n,), float32, m²: the surface that the sample stands for; sums to the sampled area.
        index: Shape (n,), int32: the sample's number on its face; it picks its block of directions.
        face_seed: Shape (face_count,), uint32: scramble of the face's sequences, stable under edits elsewhere.
    """

    face: Int32Array
    barycentric: Float32Array
    area: Float32Array
    index: Int32Array
    face_seed: UInt32Array

    def __len__(self) -> int:
        return len(self.face)

    def batches(self, size: int) -> Iterator[slice]:
        """Consecutive slices of at most `size` samples."""
        for begin in range(0, len(self), size):
            yield slice(begin, min(begin + size, len(self)))

    def only(self, rows: Int64Array) -> SampleSet:
        """Some of the samples, in the order of `rows`, which need not be sorted: they send the same rays."""
        return SampleSet(self.face[rows], self.barycentric[rows], self.area[rows], self.index[rows], self.face_seed)


@dataclass(frozen=True, slots=True)
class Tally:
    """What the rays of each sample found.

    Attributes:
        ao: Shape (n, k), float32, in [0, 1].
        rays: Shape (n,), uint16: rays traced.
        hits: Shape (n,), uint16: rays whose first proper hit lies within the bake's longest distance.
        back_faces: Shape (n,), uint16: those that struck the back of a one-sided face, grazing and edge hits excepted.
    """

    ao: Float32Array
    rays: UInt16Array
    hits: UInt16Array
    back_faces: UInt16Array

    def __len__(self) -> int:
        return len(self.ao)

    def back_face_share(self) -> Float32Array:
        """Back-face hits over hits, shape (n,), float32, in [0, 1]; 0 where nothing was hit."""
        return (self.back_faces / np.maximum(self.hits, 1)).astype(np.float32)

    def valid(self, threshold: float) -> BoolArray:
        """Samples whose back-face share is at most `threshold`, shape (n,) (Sloan et al. 2013, section 2.1)."""
        return self.back_faces <= threshold * self.hits

    @staticmethod
    def empty(sample_count: int, distance_count: int) -> Tally:
        """A tally of zeros to be written into."""
        return Tally(
            ao=np.zeros((sample_count, distance_count), np.float32),
            rays=np.zeros(sample_count, np.uint16),
            hits=np.zeros(sample_count, np.uint16),
            back_faces=np.zeros(sample_count, np.uint16),
        )


@dataclass(frozen=True, slots=True)
class SolveReport:
    """How the mapping to vertices went.

    Attributes:
        unknowns: Number of welded vertices solved for.
        components: Number of connected components; 0 for averages, which tell none apart.
        iterations: Most iterations that any right-hand side took.
        residual: Largest final relative residual.
        limited_edges: Edges whose regulariser was bounded against the local mass.
        bounded: Vertices whose value sits at 0 or 1 because of the bounds, per distance.
        rmse: Shape (k,): root of the area-weighted mean square of (interpolated value - sample), valid samples.
        averaged: Unknowns that keep their weighted average because their component did not converge.
    """

    unknowns: int
    components: int
    iterations: int
    residual: float
    limited_edges: int
    bounded: tuple[int, ...]
    rmse: tuple[float, ...]
    averaged: int = 0


@dataclass(frozen=True, slots=True)
class VertexField:
    """AO per vertex.

    Attributes:
        ao: Shape (n, k), float32, in [0, 1]; NaN where `state` is UNREFERENCED or NOT_BAKED.
        state: Shape (n,), uint8, a `VertexState`.
        report: How the solve went.
    """

    ao: Float32Array
    state: UInt8Array
    report: SolveReport


@dataclass(frozen=True, slots=True)
class StageReport:
    """One row of the stage report (after Table 1 of Sloan et al. 2013).

    `status` is "ran" or "skipped"; `why` says why it was skipped, or counts what it did.
    """

    name: str
    status: str
    why: str
    seconds: float = 0.0
    rays: int = 0
    peak_memory_mb: float = 0.0


@dataclass(frozen=True, slots=True)
class Progress:
    """Where a bake stands; `done` and `total` count the stage's own unit (rays while tracing)."""

    stage: str
    done: int
    total: int
    seconds: float = 0.0
    rays_per_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Skipped:
    """What rebakes left out because it could not count: bounds in AO, added up since each was traced.

    Attributes:
        samples: Shape (n,), float32, one a surface sample.
        voxels: Shape (v,), float32, one a voxel of the tree volume.
        trees: Shape (t,), float32, one a tree, of the rays that tell its model's error.
        points: Shape (p,), float32, one a traced point of the regions.
    """

    samples: Float32Array
    voxels: Float32Array
    trees: Float32Array
    points: Float32Array


@dataclass(frozen=True, slots=True)
class BakeResult:
    """All that a bake produced, as it is stored.

    Attributes:
        scene_path: The scene's file, absolute.
        files: Files the scene was read from, with SHA-256.
        settings: What it was baked with.
        world, samples, tally, field: The data of each stage.
        stages: The stage report, in order.
        findings: What validation and the bake found.
        device, tracer: Where the rays were traced: "cpu" or a CUDA device's name; "embree", "warp" or "brute".
        rays_skipped: Rays that were not traced because they could not matter.
        versions: Library versions by name.
        decorators: What became of trees, shrubs and small decorators; None if the scene has none.
        regions: Where objects move, and the models that light them there; None if none were asked for.
        skipped: What rebakes left out; None if nothing ever was.
        stale: Paths of objects whose values are older than the rest: a rebake was told to leave them.
    """

    scene_path: Path
    files: Mapping[str, str]
    settings: BakeSettings
    world: World
    samples: SampleSet
    tally: Tally
    field: VertexField
    stages: Sequence[StageReport]
    findings: Sequence[Finding]
    device: str
    tracer: str
    rays_skipped: int
    versions: Mapping[str, str]
    decorators: Decorators | None = None
    regions: Regions | None = None
    skipped: Skipped | None = None
    stale: tuple[str, ...] = ()
