"""Small results built by hand, without tracing anything."""

from __future__ import annotations

from pathlib import Path

import numpy as np

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


def same_results(a: BakeResult, b: BakeResult) -> bool:
    """Whether two results are equal, every array bit by bit."""

    def same(x: object, y: object) -> bool:
        if isinstance(x, np.ndarray):
            return (
                isinstance(y, np.ndarray) and x.dtype == y.dtype and x.shape == y.shape and x.tobytes() == y.tobytes()
            )
        if isinstance(x, tuple) and isinstance(y, tuple) and x and isinstance(x[0], np.ndarray):
            return len(x) == len(y) and all(map(same, x, y))
        if hasattr(x, "__slots__") and type(x) is type(y) and not isinstance(x, Path):
            return all(same(getattr(x, name), getattr(y, name)) for name in x.__slots__)
        return x == y

    return same(a, b)
