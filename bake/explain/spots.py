"""Where a level's AO is suspicious: vertices that stand out, gathered into spots, the gravest first."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bake.explain.cause_names import CauseKind
from bake.explain.clusters import cluster
from bake.explain.quick_guess import guess_causes
from bake.explain.vertex_signs import VertexSigns, baked_faces, vertex_signs
from bake.types import BakeResult, BoolArray, Float32Array, Float64Array, Int32Array, Int64Array

SEVERE_ENOUGH = 0.12
"""Vertices below this severity are not listed."""

MOST = 2000
"""Spots kept, the gravest."""

SIGNS = ("dark", "residual", "filled", "margin", "held", "seam")
"""Names of the bits of `Spots.signs`, from the lowest."""

_RESIDUAL, _MARGIN, _SEAM = 0.15, 0.5, 0.15  # from here on a sign is worth a mark


@dataclass(frozen=True, slots=True)
class Spots:
    """Suspicious places, the gravest first.

    Attributes:
        distance: Whose AO was looked at, metres.
        vertex: Shape (s,), int64: the vertex that stands out most.
        object: Shape (s,), int32: its object.
        centre: Shape (s, 3), float64, metres from `World.origin`: middle of its vertices, weighted by how they stand
            out.
        radius: Shape (s,), float64, metres: of a ball around the centre that holds them.
        vertices: Shape (s,), int64: how many.
        area: Shape (s,), float64, m².
        severity: Shape (s,), float32, in [0, 1].
        value: Shape (s,), float32, in [0, 1]: AO of the vertex.
        usual: Shape (s,), float32, in [0, 1]: what is usual around it.
        signs: Shape (s,), uint8: bits named by `SIGNS`: what is odd there.
        guess: s causes, guessed from the signs without tracing a ray; `name_causes` measures.
        first: Shape (s + 1,), int64; members: all vertices of all spots: spot i has `members[first[i]:first[i + 1]]`.
        members: Shape (v,), int64.
        left_out: Spots beyond the most that were asked for.
        seconds: What it took.
        seen: Shape (s,), float32: AO by rays from the vertex; None before `refine_spots`.
        unseen: Shape (s,), bool: it lies inside or under something; None before `refine_spots`.
    """

    distance: float
    vertex: Int64Array
    object: Int32Array
    centre: Float64Array
    radius: Float64Array
    vertices: Int64Array
    area: Float64Array
    severity: Float32Array
    value: Float32Array
    usual: Float32Array
    signs: NDArray[np.uint8]
    guess: tuple[CauseKind, ...]
    first: Int64Array
    members: Int64Array
    left_out: int
    seconds: float
    seen: Float32Array | None = None
    unseen: BoolArray | None = None

    def __len__(self) -> int:
        return len(self.vertex)

    def members_of(self, spot: int) -> Int64Array:
        """The vertices of one spot, shape (v,)."""
        return self.members[self.first[spot] : self.first[spot + 1]]

    def signs_of(self, spot: int) -> tuple[str, ...]:
        """What is odd about one spot, some of `SIGNS`."""
        return tuple(name for bit, name in enumerate(SIGNS) if self.signs[spot] >> bit & 1)


def find_spots(
    result: BakeResult, *, distance: float | None = None, least: float = SEVERE_ENOUGH, most: int = MOST
) -> Spots:
    """Lists suspicious places.

    How grave a vertex is, is how much darker it is than what is usual nearby, along the surface or in space, less
    where AO varies a lot there anyway; steps at seams and large residuals count as well.

    Args:
        result: A bake.
        distance: The baked distance nearest to this one, in metres, is looked at; the shortest if None.
        least: Least severity of a vertex, in [0, 1].
        most: Spots to keep.
    """
    begin = time.perf_counter()
    distances = np.asarray(result.settings.column_distances)
    column = int(np.argmin(distances if distance is None else np.abs(distances - distance)))
    faces, normals = baked_faces(result)
    signs = vertex_signs(result, column, faces, normals)
    severity = vertex_severity(signs)
    reach = _reach(result, column)
    owner = np.repeat(np.arange(result.world.object_count), np.diff(result.world.first_vertex))
    label = cluster(severity >= least, faces.corners, result.world.positions, owner, reach)
    members = np.flatnonzero(label >= 0)
    order = np.lexsort((-severity[members], label[members]))
    members = members[order]
    begins = np.flatnonzero(np.diff(label[members], prepend=-1))
    peak = severity[members[begins]]
    area = np.add.reduceat(signs.area[members], begins) if len(begins) else np.zeros(0)
    # among equals, the larger; a spot of a square metre outweighs a speck by a fifth of the scale
    rank = np.argsort(-(peak + 0.1 * np.clip(np.log10(np.maximum(area, 1e-9)) + 2.0, -1.0, 2.0)), kind="stable")
    kept = rank[:most]
    runs = np.diff(np.append(begins, len(members)))
    chosen = [members[begins[spot] : begins[spot] + runs[spot]] for spot in kept]
    flat = np.concatenate(chosen) if chosen else np.zeros(0, np.int64)
    first = np.concatenate(([0], np.cumsum(runs[kept]))).astype(np.int64)
    return _described(result, signs, severity, flat, first, column, len(rank) - len(kept), begin)


def vertex_severity(signs: VertexSigns) -> Float32Array:
    """How grave each vertex is, shape (n,), in [0, 1]."""
    spread = np.nan_to_num(signs.surroundings.spread, nan=0.2)
    # a difference of less than the usual variation is no news
    dark = signs.contrast * np.clip(signs.contrast / (0.05 + 1.5 * spread), 0.0, 1.0)
    # a seam shows on both sides; the residual and the bounds tell of trouble even where nothing is dark
    seam = 0.8 * np.nan_to_num(signs.seam)
    misfit = 0.5 * np.nan_to_num(signs.residual) * (signs.contrast > 0.05)
    held = np.where(signs.held < 0, np.maximum(dark, 0.5 * signs.contrast), 0.0)
    severity = np.maximum.reduce([dark, np.where(seam >= _SEAM, seam, 0.0), misfit, held])
    # where nothing around is light, nobody may ever look: feet of walls, what lies under the ground
    severity *= 0.5 + 0.5 * np.clip(signs.brightest / 0.3, 0.0, 1.0)
    return np.where(np.isfinite(signs.ao), np.clip(severity, 0.0, 1.0), 0.0).astype(np.float32)


def sign_bits(signs: VertexSigns) -> NDArray[np.uint8]:
    """Bits of `SIGNS` of each vertex, shape (n,)."""
    with np.errstate(invalid="ignore"):
        flags: tuple[BoolArray, ...] = (
            signs.contrast > 0.15,
            signs.residual > _RESIDUAL,
            signs.filled,
            signs.margin > _MARGIN,
            signs.held != 0,
            signs.seam > _SEAM,
        )
    bits = np.zeros(len(signs.ao), np.uint8)
    for bit, flag in enumerate(flags):
        bits |= np.where(flag, np.uint8(1 << bit), np.uint8(0))
    return bits


def _described(
    result: BakeResult,
    signs: VertexSigns,
    severity: Float32Array,
    members: Int64Array,
    first: Int64Array,
    column: int,
    left_out: int,
    begin: float,
) -> Spots:
    world = result.world
    starts, runs = first[:-1], np.diff(first)
    spot = np.repeat(np.arange(len(starts)), runs)
    count = len(starts)
    vertex = members[starts] if count else np.zeros(0, np.int64)
    weight = np.maximum(severity[members].astype(np.float64), 1e-6)
    mass = np.bincount(spot, weight, count)
    position = world.positions[members]
    sums = np.stack([np.bincount(spot, weight * position[:, axis], count) for axis in range(3)], axis=1)
    centre = sums / np.where(mass > 0.0, mass, 1.0)[:, None]
    away = np.linalg.norm(position - centre[spot], axis=1)
    owner = (np.searchsorted(world.first_vertex, members, side="right") - 1).astype(np.int32)
    with np.errstate(invalid="ignore"):
        usual = np.fmax(signs.surroundings.near, signs.surroundings.along)
    return Spots(
        distance=float(result.settings.column_distances[column]),
        vertex=vertex,
        object=owner[starts] if count else np.zeros(0, np.int32),
        centre=centre,
        radius=np.maximum.reduceat(away, starts) if count else np.zeros(0),
        vertices=runs,
        area=np.add.reduceat(signs.area[members], starts) if count else np.zeros(0),
        severity=severity[vertex],
        value=signs.ao[vertex].astype(np.float32),
        usual=usual[vertex],
        signs=np.bitwise_or.reduceat(sign_bits(signs)[members], starts) if count else np.zeros(0, np.uint8),
        guess=guess_causes(result, signs, vertex),
        first=first,
        members=members,
        left_out=left_out,
        seconds=time.perf_counter() - begin,
    )


def _reach(result: BakeResult, column: int) -> float:
    """How far apart the vertices of one spot may lie: a share of the distance, and of the level."""
    extent = float(np.ptp(result.world.positions, axis=0).max()) or 1.0
    return min(0.1 * result.settings.column_distances[column], 0.25, extent / 50.0)
