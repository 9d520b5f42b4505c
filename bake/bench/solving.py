"""How long the mapping to vertices takes at size, against a direct solver on a size that it can still manage."""

from __future__ import annotations

import time
import warnings

import numpy as np

from bake.bench.solve_updates import GATE_S, update_rows
from bake.bench.synthetic import Geometry, height_field
from bake.bench.table import Measurements
from bake.samples import place_samples
from bake.settings import BakeSettings
from bake.solve import VertexMapper
from bake.types import Float32Array, Float64Array, ObjectKeys, Role, SampleSet, World

_GATE = 5.0
_DIRECT_UNKNOWNS = 250_000


_UPDATED_UNKNOWNS = 200_000


def measure_updates(*, unknowns: int = _UPDATED_UNKNOWNS) -> Measurements:
    """Changes of alpha and of the threshold alone on a height field of `unknowns` vertices, one connected piece."""
    world = _world(height_field(round(unknowns**0.5) - 1))
    settings = BakeSettings(samples_per_face=(4, 4))
    samples = place_samples(world, settings)
    valid = np.random.default_rng(1).random(len(samples)) > 0.1
    rows = update_rows(world, samples, _made_up_ao(world, samples), valid, settings)
    notes = [
        f"height field, {len(samples):,} samples, a tenth of them invalid; nothing is traced",
        f"update: from what is kept of the bake before, best of a few; gate: {GATE_S:g} s",
        "whole: `map_to_vertices` from nothing, the threshold's validity given",
    ]
    return Measurements("solve updates", rows, notes, seeds={"AO made up": 1, "validity": 1})


def measure_solving(*, unknowns: int = 1_500_000, alpha: float = 0.1) -> Measurements:
    """Solves a height field of `unknowns` vertices, and one of a quarter of a million with SuperLU.

    The AO of its samples is made up: smooth, with the noise of a few rays, from 0 to 1. Both solvers get the
    same kind of matrix, made by the mapping itself; assembly is left out on both sides and shown apart.
    """
    small = _Case(_DIRECT_UNKNOWNS, alpha)
    direct_s = small.superlu_seconds()
    small_own_s = small.own_seconds()
    small_count = small.unknown_count
    del small
    large = _Case(unknowns, alpha)
    own_s = large.own_seconds()
    per_unknown = 1e6 * direct_s / small_count, 1e6 * own_s / large.unknown_count
    gain = per_unknown[0] / per_unknown[1]
    rows = [
        {"solver": "SuperLU", "unknowns": small_count, "solve seconds": direct_s, "µs per unknown": per_unknown[0]},
        {
            "solver": "ours", "unknowns": small_count, "solve seconds": small_own_s,
            "µs per unknown": 1e6 * small_own_s / small_count,
        },
        {
            "solver": "ours", "unknowns": large.unknown_count, "solve seconds": own_s, "µs per unknown": per_unknown[1],
            "assembly seconds": large.assembly_s, "weld and topology seconds": large.topology_s,
            "iterations": large.iterations, "gain per unknown": gain, "passed": gain >= _GATE,
        },
    ]  # fmt: skip
    return Measurements(
        "solving",
        rows,
        [f"alpha {alpha:g}; gate: at least {_GATE:g} times less time per unknown than SuperLU"],
        seeds={"AO made up": 1},
    )


class _Case:
    """A height field with made-up AO, up to its linear system."""

    def __init__(self, unknowns: int, alpha: float) -> None:
        world = _world(height_field(round(unknowns**0.5) - 1))
        settings = BakeSettings(samples_per_face=(2, 2), alpha=alpha)
        self._samples = place_samples(world, settings)
        self._ao = _made_up_ao(world, self._samples)
        self._valid = np.ones(len(self._samples), np.bool_)
        begin = time.perf_counter()
        self._mapper = VertexMapper(world, self._samples, settings)
        self.topology_s = time.perf_counter() - begin
        begin = time.perf_counter()
        self._system = self._mapper.system(self._ao, self._valid)
        self.assembly_s = time.perf_counter() - begin
        self.unknown_count = self._system.matrix.shape[0]
        self.iterations = 0

    def own_seconds(self) -> float:
        """Seconds that `VertexMapper.solve` spends after assembly: from its first word of solving to its last."""
        told: list[float] = []

        def on_progress(step: str, share: float) -> None:
            if step == "solve":
                told.append(time.perf_counter())

        solved = self._mapper.solve(self._ao, self._valid, on_progress=on_progress)
        self.iterations = solved.report.iterations
        return told[-1] - told[0]

    def superlu_seconds(self) -> float:
        """Seconds of factorising and solving with SciPy's SuperLU."""
        from scipy.sparse import csc_array
        from scipy.sparse.linalg import splu

        matrix = csc_array(self._system.matrix)
        begin = time.perf_counter()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            factor = splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
            factor.solve(np.ascontiguousarray(self._system.rhs))
        return time.perf_counter() - begin


def _made_up_ao(world: World, samples: SampleSet) -> Float32Array:
    weights = np.concatenate([samples.barycentric, 1.0 - samples.barycentric.sum(1, keepdims=True)], axis=1)
    points: Float64Array = np.einsum("ij,ijk->ik", weights, world.positions[world.faces[samples.face]])
    smooth: Float64Array = 0.5 + 0.5 * np.sin(0.3 * points[:, :2])
    noise = np.random.default_rng(1).normal(0.0, 0.05, (len(smooth), 2))
    return np.clip(smooth + noise, 0.0, 1.0).astype(np.float32)


def _world(geometry: Geometry) -> World:
    """One static object."""
    positions, faces = geometry
    count = len(faces)
    return World(
        origin=np.zeros(3),
        positions=positions,
        normals=np.zeros((len(positions), 3), np.float32),
        faces=faces,
        face_object=np.zeros(count, np.int32),
        face_casts=np.ones(count, np.bool_),
        face_samples=np.ones(count, np.bool_),
        face_two_sided=np.zeros(count, np.bool_),
        face_openness=np.zeros(count, np.float32),
        first_vertex=np.array([0, len(positions)], np.int64),
        first_face=np.array([0, count], np.int64),
        object_paths=("field",),
        object_roles=(Role.STATIC,),
        object_keys=(ObjectKeys(),),
        object_hash=("",),
    )
