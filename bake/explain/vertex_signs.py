"""What is odd about each vertex of a bake, all of them at once and without a ray."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.explain.neighbourhood import BakedFaces, Surroundings, mean_along, mean_near
from bake.geometry import face_normals
from bake.scene.weld import weld_positions
from bake.types import BakeResult, BoolArray, Float32Array, Float64Array, VertexState, World

SEAM_REACH = 1e-3
"""Metres within which two vertices are expected to agree if their normals do."""

CELL = 2.0
"""Largest edge of the neighbourhood in space, metres."""

MARGIN = 0.05
"""Samples whose back-face share lies this close to the threshold were near to being judged the other way."""


@dataclass(frozen=True, slots=True)
class VertexSigns:
    """Signs per vertex; NaN or False where a vertex has no value.

    Attributes:
        ao: Shape (n,), float64: the value looked at.
        area: Shape (n,), float64, m²: a third of the faces around.
        surroundings: What is usual nearby.
        contrast: Shape (n,), float32: how much darker it is than what is usual, never below 0.
        brightest: Shape (n,), float32: AO of the lightest valid sample on the faces around; 0 without any. Where that
            is dark too, the surface may be out of everybody's sight.
        residual: Shape (n,), float32: root mean square of (interpolated value - sample) on the faces around.
        invalid: Shape (n,), float32: share of the surface around whose samples are invalid.
        margin: Shape (n,), float32: share of it that was judged by less than `MARGIN`.
        back: Shape (n,), float32: mean back-face share of the samples around.
        held: Shape (n,), int8: -1 at the lower bound though the samples around are lighter, 1 at the upper though they
            are darker, else 0.
        filled: Shape (n,), bool.
        seam: Shape (n,), float32: largest step to a vertex at the same place with a like normal.
        slant: Shape (n,), float32: least cosine between the vertex normal and the faces around, which are turned to
            its side; 1 where it has none.
        slenderness: Shape (n,), float32: largest ratio of longest edge to height around.
    """

    ao: Float64Array
    area: Float64Array
    surroundings: Surroundings
    contrast: Float32Array
    brightest: Float32Array
    residual: Float32Array
    invalid: Float32Array
    margin: Float32Array
    back: Float32Array
    held: np.ndarray[tuple[int], np.dtype[np.int8]]
    filled: BoolArray
    seam: Float32Array
    slant: Float32Array
    slenderness: Float32Array


def baked_faces(result: BakeResult) -> tuple[BakedFaces, Float64Array]:
    """Faces whose corners all have values, and their normals, shape (m, 3)."""
    world = result.world
    known = result.field.state <= VertexState.FILLED
    face = np.flatnonzero(known[world.faces].all(axis=1))
    normals, area = face_normals(world.positions, world.faces[face])
    place = weld_positions(world.positions)
    corners = world.faces[face]
    return BakedFaces(face, corners.astype(np.int64), place[corners], place, area), normals


def vertex_signs(result: BakeResult, column: int, faces: BakedFaces, normals: Float64Array) -> VertexSigns:
    """Looks all vertices over.

    Args:
        result: A bake.
        column: Which distance.
        faces: From `baked_faces`.
        normals: Shape (m, 3): theirs.
    """
    world = result.world
    ao = result.field.ao[:, column].astype(np.float64)
    valid = result.tally.valid(result.settings.back_face_threshold)
    sampled = result.tally.ao[:, column]
    near, spread = mean_near(world, result.samples, sampled, valid, _cell(result, column))
    along = mean_along(faces, ao)
    usual = np.fmax(near, along)
    contrast = np.maximum(np.nan_to_num(usual - ao), 0.0).astype(np.float32)
    of_faces = _FaceMeans(result, faces, valid, column)
    mean = faces.to_vertices(of_faces.value, weight=of_faces.valid_area)
    held = np.zeros(len(ao), np.int8)
    held[(ao <= 0.0) & (mean > 0.05)] = -1
    held[(ao >= 1.0) & (mean < 0.95)] = 1
    area = np.zeros(len(ao))
    for corner in range(3):
        area += np.bincount(faces.corners[:, corner], faces.area / 3.0, len(ao))
    return VertexSigns(
        ao=ao,
        area=area,
        surroundings=Surroundings(along, near, spread),
        contrast=contrast,
        brightest=faces.most_at_vertices(of_faces.brightest),
        residual=np.sqrt(faces.to_vertices(of_faces.square, weight=of_faces.valid_area)).astype(np.float32),
        invalid=faces.to_vertices(of_faces.invalid).astype(np.float32),
        margin=faces.to_vertices(of_faces.margin).astype(np.float32),
        back=faces.to_vertices(of_faces.back).astype(np.float32),
        held=held,
        filled=result.field.state == VertexState.FILLED,
        seam=_seams(world, ao, faces, normals),
        slant=_slants(world, faces, normals),
        slenderness=_slenderness(world, faces),
    )


def _cell(result: BakeResult, column: int) -> float:
    """Edge of the cells: the distance itself, but at most `CELL` and a tenth of the level."""
    extent = float(np.ptp(result.world.positions, axis=0).max()) or 1.0
    return min(result.settings.column_distances[column], CELL, extent / 10.0)


class _FaceMeans:
    """Means over the samples of each baked face, shape (m,) each; 0 on faces without samples.

    Attributes:
        value, square: AO, and squared misfit, over the valid samples.
        valid_area: m² that they stand for.
        invalid, margin, back: Shares over all samples.
        brightest: AO of the lightest valid sample.
    """

    def __init__(self, result: BakeResult, faces: BakedFaces, valid: BoolArray, column: int) -> None:
        samples, tally, world = result.samples, result.tally, result.world
        begins = np.flatnonzero(np.diff(samples.face, prepend=-1))
        row = np.full(world.face_count, -1, np.int64)
        if len(begins):
            row[samples.face[begins]] = np.arange(len(begins))
        row = row[faces.face]
        area = samples.area.astype(np.float64)
        used = np.where(valid, area, 0.0)
        ao = tally.ao[:, column].astype(np.float64)
        value = result.field.ao[:, column].astype(np.float64)
        a, b, c = value[world.faces[samples.face]].T
        u, v = samples.barycentric.T
        error = np.nan_to_num(u * a + v * b + (1.0 - u - v) * c - ao)
        share = tally.back_face_share()
        doubtful = np.abs(share - result.settings.back_face_threshold) < MARGIN

        def total(weights: Float64Array) -> Float64Array:
            sums = np.add.reduceat(weights, begins) if len(begins) else np.zeros(0)
            return np.where(row >= 0, sums[row], 0.0) if len(sums) else np.zeros(len(row))

        def mean(weights: Float64Array, mass: Float64Array) -> Float64Array:
            return np.divide(total(weights), mass, out=np.zeros(len(mass)), where=mass > 0.0)

        self.valid_area, whole = total(used), total(area)
        self.value = mean(used * ao, self.valid_area)
        self.square = mean(used * error * error, self.valid_area)
        self.invalid = mean(area - used, whole)
        lightest = np.where(valid, tally.ao[:, column], np.float32(0.0))
        lightest = np.maximum.reduceat(lightest, begins) if len(begins) else np.zeros(1, np.float32)
        self.brightest = np.where(row >= 0, lightest[row], np.float32(0.0))
        self.margin = mean(np.where(doubtful, area, 0.0), whole)
        self.back = mean(area * share, whole)


def _seams(world: World, ao: Float64Array, faces: BakedFaces, normals: Float64Array) -> Float32Array:
    """Largest step between vertices within about `SEAM_REACH` whose faces look the same way, shape (n,)."""
    count = len(ao)
    used = np.zeros(count, np.bool_)
    used[faces.corners.ravel()] = True
    side = np.empty((count, 3))
    for axis in range(3):
        side[:, axis] = faces.to_vertices(normals[:, axis])
    chosen = np.flatnonzero(used)
    step = np.zeros(count, np.float32)
    # Normals rounded to the nearest of the 26 directions to neighbouring cells: like normals share one.
    direction = np.round(np.nan_to_num(side[chosen]) * 1.4).astype(np.int64) + 2
    facing = direction @ np.array([25, 5, 1])
    for shift in (0.0, 0.5):
        index = np.floor(world.positions[chosen] / SEAM_REACH + shift).astype(np.int64)
        key = (index * np.array([73856093, 19349663, 83492791])).sum(axis=1) * 128 + facing
        order = np.argsort(key, kind="stable")
        begins = np.flatnonzero(np.diff(key[order], prepend=key[order[0]] - 1)) if len(order) else np.zeros(0, np.int64)
        if not len(begins):
            continue
        value = ao[chosen[order]]
        run = np.repeat(np.arange(len(begins)), np.diff(np.append(begins, len(order))))
        highest, lowest = np.maximum.reduceat(value, begins)[run], np.minimum.reduceat(value, begins)[run]
        here = np.maximum(highest - value, value - lowest)
        step[chosen[order]] = np.maximum(step[chosen[order]], here)
    return step


def _slants(world: World, faces: BakedFaces, normals: Float64Array) -> Float32Array:
    """Least |cosine| between vertex normals and the faces around, shape (n,)."""
    least = np.ones(len(world.normals), np.float32)
    for corner in range(3):
        vertex = faces.corners[:, corner]
        cosine = np.abs(np.einsum("ij,ij->i", world.normals[vertex].astype(np.float64), normals)).astype(np.float32)
        known = world.normals[vertex].any(axis=1) & normals.any(axis=1)
        np.minimum.at(least, vertex[known], cosine[known])
    return least


def _slenderness(world: World, faces: BakedFaces) -> Float32Array:
    """Largest ratio of longest edge to height of the faces around, shape (n,)."""
    longest = np.zeros(len(faces.face))
    for corner in range(3):
        edge = world.positions[faces.corners[:, corner]] - world.positions[faces.corners[:, corner - 1]]
        longest = np.maximum(longest, np.einsum("ij,ij->i", edge, edge))
    ratio = np.divide(longest, 2.0 * faces.area, out=np.full(len(longest), 1e6), where=faces.area > 0.0)
    return faces.most_at_vertices(ratio.astype(np.float32))
