"""What is measured at a spot before anybody names a cause: what it sees itself, and what its samples see and weigh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.explain.explainer import Explainer
from bake.explain.looks import Looks, covering, look
from bake.explain.types import Explanation
from bake.geometry import GRAZING_COSINE, face_normals
from bake.types import BoolArray, Float64Array, Int64Array, World

LOOK_RAYS = 128  # from the spot, to each side; divided among its points
MOST_POINTS = 8
HEAVY = 160  # samples whose rays are looked at one by one
INWARD = 0.1  # share of the way from a vertex to the middle of a face at which we look, and
MOST_INWARD = 5e-3  # metres at most


@dataclass(frozen=True, slots=True)
class Heavy:
    """The samples that weigh most, h of them.

    Attributes:
        row: Shape (h,), int64: row in the explanation's samples; they are traced.
        weight: Shape (h,), float64.
        ao: Shape (h,), float64: their AO at the distance looked at, without fog and trees.
        stopped: Shape (h,): share of their rays that meet anything.
        from_behind: Shape (h,): share of those that strike a face from behind, two-sided or not.
        mirrored: Shape (h,): share of rays that the shading normal sent below the face.
        covered: Shape (h,): share of rays that end on a parallel face within a millimetre.
        slant: Shape (h,): cosine between shading and face normal.
        face_normal: Shape (h, 3).
        hidden: Shape (h,), bool: something stands between the sample and the spot.
        covering: Object that covers most; -1 if none does.
    """

    row: Int64Array
    weight: Float64Array
    ao: Float64Array
    stopped: Float64Array
    from_behind: Float64Array
    mirrored: Float64Array
    covered: Float64Array
    slant: Float64Array
    face_normal: Float64Array
    hidden: BoolArray
    covering: int

    def without(self, left_out: BoolArray) -> float:
        """The value as the other samples have it: their weighted mean; NaN if they weigh next to nothing."""
        weight = np.where(left_out, 0.0, self.weight)
        return float(weight @ self.ao / weight.sum()) if weight.sum() > 0.05 else float("nan")


@dataclass(frozen=True, slots=True)
class Evidence:
    """Measured at one spot and one distance.

    Attributes:
        explanation: What is judged.
        column: Which distance.
        value: Baked AO without fog and trees, as far as the samples tell.
        front, behind: What the spot's points see, to the side of their faces and to the other.
        seen: AO of the front by rays from the spot itself.
        seen_behind: The same to the other side.
        faces: Shape (f,), int64: the faces around the spot's vertices.
        valid, invalid: Samples on them.
        invalid_share: Share of their area that invalid samples stand for.
        own_weight: What samples on them weigh.
        average: Value that the weighted average of the samples around has, without any smoothing.
        swing: Sum of the negative weights, as a positive number.
        slenderness: Largest ratio of longest edge to height of those faces.
        heavy: The samples that weigh most.
    """

    explanation: Explanation
    column: int
    value: float
    front: Looks
    behind: Looks
    seen: float
    seen_behind: float
    faces: Int64Array
    valid: int
    invalid: int
    invalid_share: float
    own_weight: float
    average: float
    swing: float
    slenderness: float
    heavy: Heavy

    @property
    def gap(self) -> float:
        """How much darker the value is than what can be seen from the spot."""
        return self.seen - self.value

    @property
    def unseen(self) -> bool:
        """Whether the spot itself lies where the back-face rule lets no sample be: inside or under something."""
        return float(self.front.proof.mean()) > 0.5 and float(self.front.stopped.mean()) > 0.02

    @property
    def distance(self) -> float:
        """The distance looked at, metres."""
        return self.explanation.distances[self.column]


def gather(explainer: Explainer, explanation: Explanation, column: int, receiving: Int64Array) -> Evidence:
    """Measures at a spot.

    Args:
        explainer: Of the bake.
        explanation: Of the spot.
        column: Which distance.
        receiving: Shape (m,): the world's face behind each row of the mapper's surface.
    """
    world, spot = explainer.result.world, explanation.spot
    faces = faces_around(explainer, explanation, receiving)
    looked = faces if spot.is_vertex else np.array([spot.face], np.int64)
    normals, area = face_normals(world.positions, world.faces[looked])
    points, at = _points(world, explanation, looked, area)
    owner = np.full(len(at), spot.object, np.int64)
    extent = _longest(world, looked)[at]
    rays = max(32, LOOK_RAYS // len(at))
    front = look(explainer.tracer, points, normals[at], owner, extent, rays)
    behind = look(explainer.tracer, points, -normals[at], owner, extent, rays)
    mass = area[at] / area[at].sum() if area[at].sum() > 0.0 else np.full(len(at), 1.0 / len(at))

    samples, result = explanation.samples, explainer.result
    on_faces = _samples_on(explainer, faces)
    valid = explainer.valid[on_faces]
    sampled = result.samples.area[on_faces].astype(np.float64)
    total = float(sampled.sum())
    average = explainer.mapper.equations(result.tally.ao, explainer.valid).average[:, column]
    heavy = _heavy(explainer, explanation, column)
    veil = float(heavy.weight @ (heavy.ao - samples.ao[heavy.row, column]))
    return Evidence(
        explanation=explanation,
        column=column,
        value=float(np.clip(explanation.value[column] + veil, 0.0, 1.0)),
        front=front,
        behind=behind,
        seen=float(mass @ front.ao[:, column]),
        seen_behind=float(mass @ behind.ao[:, column]),
        faces=faces,
        valid=int(valid.sum()),
        invalid=int(len(valid) - valid.sum()),
        invalid_share=float(sampled[~valid].sum()) / total if total > 0.0 else 1.0,
        own_weight=float(samples.weight[np.isin(samples.face, faces)].sum()),
        average=float(spot.weights @ average[explainer.mapper.surface.unknown[spot.vertices]]),
        swing=float(-np.minimum(samples.weight, 0.0).sum()),
        slenderness=_slenderness(world, faces),
        heavy=heavy,
    )


def faces_around(explainer: Explainer, explanation: Explanation, receiving: Int64Array) -> Int64Array:
    """The faces with area around the spot's vertices; its own face if there are none."""
    world, spot = explainer.result.world, explanation.spot
    unknown = np.unique(explainer.mapper.surface.unknown[spot.vertices[spot.weights > 1e-3]])
    found = receiving[explainer.adjoint.faces_around(unknown)]
    proper = found[face_normals(world.positions, world.faces[found])[1] > 0.0]
    return proper if len(proper) else np.array([spot.face], np.int64)


def _points(
    world: World, explanation: Explanation, faces: Int64Array, area: Float64Array
) -> tuple[Float64Array, Int64Array]:
    """Points of the spot to look from, and the row of the face of each: a little inside each of its largest faces."""
    spot = explanation.spot
    if not spot.is_vertex:
        return spot.position[None], np.zeros(1, np.int64)
    at = np.sort(np.argsort(-area, kind="stable")[:MOST_POINTS])
    inward = world.positions[world.faces[faces[at]]].mean(axis=1) - spot.position
    length = np.maximum(np.linalg.norm(inward, axis=1, keepdims=True), 1e-12)
    return spot.position + inward * np.minimum(INWARD, MOST_INWARD / length), at


def _longest(world: World, faces: Int64Array) -> Float64Array:
    corners = world.positions[world.faces[faces]]
    return np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)


def _slenderness(world: World, faces: Int64Array) -> float:
    longest, area = _longest(world, faces), face_normals(world.positions, world.faces[faces])[1]
    return float((longest**2 / np.maximum(2.0 * area, 1e-12 * longest**2 + 1e-300)).max(initial=1.0))


def _samples_on(explainer: Explainer, faces: Int64Array) -> Int64Array:
    """All samples on some faces, valid or not."""
    of = explainer.result.samples.face
    begin, end = np.searchsorted(of, faces), np.searchsorted(of, faces, side="right")
    runs = [np.arange(a, b, dtype=np.int64) for a, b in zip(begin.tolist(), end.tolist(), strict=True)]
    return np.concatenate(runs) if runs else np.zeros(0, np.int64)


def _heavy(explainer: Explainer, explanation: Explanation, column: int) -> Heavy:
    world, samples, rays = explainer.result.world, explanation.samples, explanation.rays
    count = min(HEAVY, len(rays.sample))
    row = np.arange(count)
    traced = rays.first(count)
    face_normal = face_normals(world.positions, world.faces[samples.face[row]])[0]
    first = np.maximum(traced.first_face, 0)
    struck = traced.first_face >= 0
    cosine = np.zeros(struck.shape)
    if struck.any():
        cosine[struck] = np.einsum(
            "ij,ij->i",
            face_normals(world.positions, world.faces[first[struck]])[0],
            traced.direction[struck].astype(np.float64),
        )
    hits = np.maximum(struck.sum(axis=1), 1)
    normals = np.repeat(face_normal, struck.shape[1], axis=0)
    flat = traced.face.ravel(), traced.distance.ravel(), traced.direction.reshape(-1, 3).astype(np.float64)
    close = covering(world, *flat, normals).reshape(struck.shape)
    coverers = traced.object[close]
    return Heavy(
        row=row,
        weight=samples.weight[row],
        ao=traced.rho[:, :, column].mean(axis=1, dtype=np.float64),
        stopped=struck.mean(axis=1),
        from_behind=(cosine > GRAZING_COSINE).sum(axis=1) / hits,
        mirrored=traced.mirrored.mean(axis=1),
        covered=close.mean(axis=1),
        slant=np.einsum("ij,ij->i", samples.normal[row], face_normal),
        face_normal=face_normal,
        hidden=_hidden(explainer, explanation, row, face_normal),
        covering=int(np.bincount(coverers).argmax()) if len(coverers) else -1,
    )


def _hidden(explainer: Explainer, explanation: Explanation, row: Int64Array, normals: Float64Array) -> BoolArray:
    """Whether anything stands between each sample and the spot, both lifted off the surface by a little."""
    spot, samples = explanation.spot, explanation.samples
    away = samples.distance[row]
    lift = np.clip(0.05 * away, 1e-3, 0.02)[:, None]
    start = spot.position + lift * spot.normal
    end = samples.position[row] + lift * normals
    way = end - start
    length = np.maximum(np.linalg.norm(way, axis=1), 1e-9)
    hidden = np.zeros(len(row), np.bool_)
    # rays have one longest distance for all, so the hit is held against each length
    hits = explainer.tracer.nearest(
        np.ascontiguousarray(start, np.float32),
        np.ascontiguousarray(way / length[:, None], np.float32),
        float(length.max(initial=0.0)) + 1e-3,
    )
    hidden[:] = (hits.face >= 0) & (hits.distance < 0.999 * length) & (away > 5e-3)
    return hidden
