"""Small results built by hand, without tracing anything."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bake.decorator_types import Decorators, FogBoxes, SmallScalars, TreeFits, TreeModel, TreeVolume
from bake.settings import BakeSettings
from bake.types import (
    BakeResult,
    Finding,
    ObjectKeys,
    Role,
    SampleSet,
    SolveReport,
    StageReport,
    Tally,
    VertexField,
    World,
)


def build_result(
    *,
    ao: np.ndarray | None = None,
    seed: int = 1,
    objects: int = 3,
    vertices_per_object: int = 5,
    distances: tuple[float, ...] = (2.0, 300.0),
    textures: bool = False,
    scene_path: Path = Path("/levels/yard.glb"),
    files: dict[str, str] | None = None,
) -> BakeResult:
    """Objects of `vertices_per_object` random vertices, the last of them unreferenced, and a fan of faces each."""
    random = np.random.default_rng(seed)
    per = vertices_per_object
    vertices = objects * per
    fan = np.array([[0, i, i + 1] for i in range(1, per - 2)], np.int32).reshape(-1, 3)
    faces = np.concatenate([fan[:0], *(fan + per * i for i in range(objects))]).astype(np.int32)
    face_count, k, sample_count = len(faces), len(distances), 2 * len(faces)
    state = np.zeros(vertices, np.uint8)
    state[per - 1 :: per] = 2
    if vertices > 1:
        state[1] = 1
    values = random.random((vertices, k)).astype(np.float32) if ao is None else ao.astype(np.float32)
    values[state == 2] = np.nan
    world = World(
        origin=np.array([1000.5, -20.25, 3.0]),
        positions=random.normal(size=(vertices, 3)),
        normals=np.tile(np.float32([0, 1, 0]), (vertices, 1)),
        faces=faces,
        face_object=np.repeat(np.arange(objects, dtype=np.int32), len(fan)),
        face_casts=np.ones(face_count, bool),
        face_samples=np.ones(face_count, bool),
        face_two_sided=np.zeros(face_count, bool),
        face_openness=np.zeros(face_count, np.float32),
        first_vertex=np.arange(objects + 1, dtype=np.int64) * per,
        first_face=np.arange(objects + 1, dtype=np.int64) * len(fan),
        object_paths=tuple(f"Yard/Fässer/barrel#{i}" for i in range(objects)),
        object_roles=(Role.STATIC,) * objects,
        object_keys=tuple(ObjectKeys(alpha=0.5) if i == 0 else ObjectKeys() for i in range(objects)),
        object_hash=tuple(f"{i:064x}" for i in range(objects)),
        vertex_uv=random.random((vertices, 2)).astype(np.float32) if textures else None,
        face_texture=np.zeros(face_count, np.int32) if textures else None,
        textures=(np.ones((2, 3), np.float32), np.zeros((4, 1), np.float32)) if textures else (),
    )
    hits = random.integers(1, 16, sample_count).astype(np.uint16)
    return BakeResult(
        scene_path=scene_path,
        files=files if files is not None else {"yard.glb": "ab" * 32},
        settings=BakeSettings(rays=16, distances=distances, seed=seed),
        world=world,
        samples=SampleSet(
            face=np.repeat(np.arange(face_count, dtype=np.int32), 2),
            barycentric=np.tile(np.float32([[0.25, 0.25], [0.5, 0.25]]), (face_count, 1)),
            area=np.ones(sample_count, np.float32),
            index=np.tile(np.int32([0, 1]), face_count),
            face_seed=random.integers(0, 2**32, face_count, dtype=np.uint32),
        ),
        tally=Tally(
            ao=random.random((sample_count, k)).astype(np.float32),
            rays=np.full(sample_count, 16, np.uint16),
            hits=hits,
            back_faces=(hits // 3).astype(np.uint16),
        ),
        field=VertexField(
            ao=values,
            state=state,
            report=SolveReport(12, 3, 17, 1e-8, 2, (0,) * k, (0.05,) * k),
        ),
        stages=(
            StageReport("scene", "ran", f"{objects} objects", 0.1, 0, 80.0),
            StageReport("trace", "ran", "", 0.5, 16 * sample_count, 120.0),
            StageReport("fog", "skipped", "no shrubs"),
        ),
        findings=(Finding("Yard/Fässer/barrel#0", "zero-area-faces", 2, "Two faces are points."),),
        device="cpu",
        tracer="embree",
        rays_skipped=7,
        versions={"numpy": np.__version__},
    )


def build_decorators(
    result: BakeResult, *, seed: int = 1, trees: tuple[int, ...] = (0,), model_sizes: tuple[int, ...] = (5,)
) -> Decorators:
    """All parts, with random values: trees are the named objects, shrubs and small ones the last object."""
    random = np.random.default_rng(seed)
    k, last = result.settings.distance_count, result.world.object_count - 1

    def floats(*shape: int) -> np.ndarray:
        return random.random(shape).astype(np.float32)

    count = len(trees)
    brick = np.full((1, 9, 9, 9), -1, np.int32)
    brick[0, :2, :2, :2] = np.arange(8).reshape(2, 2, 2)
    return Decorators(
        fog=FogBoxes(np.int32([last]), floats(1, 3), 1 + floats(1, 3), np.float32([0.8]), np.float32([0.5])),
        volume=TreeVolume(
            origin=random.random(3),
            spacing=0.75,
            top=np.int32([[[0, -1]]]),
            brick_voxels=brick,
            voxel=np.indices((2, 2, 2)).reshape(3, 8).T.astype(np.int32),
            sh=floats(8, 9, k),
            valid=np.uint8([1, 1, 1, 0, 1, 1, 1, 1]),
        ),
        models=tuple(TreeModel(mesh, floats(size, k)) for mesh, size in enumerate(model_sizes)),
        fits=TreeFits(
            object=np.int32(trees),
            model=np.arange(count, dtype=np.int32) % len(model_sizes),
            centre=random.random((count, 3)),
            coefficients=floats(count, 4, k),
            rmse_global=floats(count, k),
            rmse_product=floats(count, k),
            rmse_volume=floats(count, k),
            terms=np.full((count, k), 4, np.uint8),
        ),
        shrub_scalars=SmallScalars(np.int32([last]), floats(1, k), np.array([True])),
        small_scalars=SmallScalars(np.int32([last]), floats(1, k), np.array([False])),
    )


def same_results(a: BakeResult, b: BakeResult) -> bool:
    """Whether two results are equal, every array bit by bit."""

    def same(x: object, y: object) -> bool:
        if isinstance(x, np.ndarray):
            return (
                isinstance(y, np.ndarray) and x.dtype == y.dtype and x.shape == y.shape and x.tobytes() == y.tobytes()
            )
        if isinstance(x, tuple) and isinstance(y, tuple) and x and isinstance(x[0], np.ndarray | TreeModel):
            return len(x) == len(y) and all(map(same, x, y))
        if hasattr(x, "__slots__") and type(x) is type(y) and not isinstance(x, Path):
            return all(same(getattr(x, name), getattr(y, name)) for name in x.__slots__)
        return x == y

    return same(a, b)
