"""The mass matrix and the right-hand side, both from the same samples.

With φ_s the barycentric weights of sample s on the three corners of its face and dA_s the area it stands for,

    M = Σ dA_s φ_s φ_sᵀ,    b = Σ dA_s AO_s φ_s,    m = Σ dA_s φ_s (the row sums of M: the lumped mass).

Taking M from the samples rather than from the face's area makes M 1 = m exactly, so that constants are reproduced
however few the samples; with an analytic M the sampling error of b goes straight into the values.

Reference: NVIDIA's baking sample, which notes the same choice; the projection is Sloan et al. 2013, equation 2, and
Kavan et al. 2011, "Least Squares Vertex Baking".
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from bake.in_parts import AT_ONCE, in_parts, in_spans
from bake.solve.scatter import scatter_add
from bake.solve.surface import Surface
from bake.types import BoolArray, Float32Array, Float64Array, Int64Array, SampleSet


@dataclass(frozen=True, slots=True)
class FaceMoments:
    """Sums over the valid samples of each receiving face.

    Attributes:
        count: Shape (m,), float64: samples.
        square: Shape (m, 3), float64, m²: Σ dA φ_i² for corners 0, 1, 2.
        mixed: Shape (m, 3), float64, m²: Σ dA φ_i φ_j for corners (0, 1), (1, 2), (2, 0).
        value: Shape (m, 3, k), float64, m²: Σ dA AO φ_i.
        value_square: Shape (m, k), float64, m²: Σ dA AO².
    """

    count: Float64Array
    square: Float64Array
    mixed: Float64Array
    value: Float64Array
    value_square: Float64Array

    @property
    def mass(self) -> Float64Array:
        """Σ dA φ_i, shape (m, 3), m²."""
        mass = self.square + self.mixed
        for i in range(3):
            mass[:, i] += self.mixed[:, i - 1]
        return mass

    def only(self, faces: Int64Array) -> FaceMoments:
        """The sums of some faces."""
        return FaceMoments(
            self.count[faces], self.square[faces], self.mixed[faces], self.value[faces], self.value_square[faces]
        )

    def between(self, begin: int, end: int) -> FaceMoments:
        """The sums of consecutive faces, shared."""
        here = slice(begin, end)
        return FaceMoments(
            self.count[here], self.square[here], self.mixed[here], self.value[here], self.value_square[here]
        )

    def with_faces(self, faces: Int64Array, found: FaceMoments) -> FaceMoments:
        """Sums with those of some faces replaced."""
        arrays: list[Float64Array] = []
        for name in ("count", "square", "mixed", "value", "value_square"):
            values: Float64Array = getattr(self, name).copy()
            values[faces] = getattr(found, name)
            arrays.append(values)
        return FaceMoments(*arrays)


def face_moments(surface: Surface, samples: SampleSet, ao: Float32Array, valid: BoolArray) -> FaceMoments:
    """Sums the valid samples face by face, in float64.

    Args:
        surface: The welded surface.
        samples: Shape (n,).
        ao: Shape (n, k), float32, in [0, 1].
        valid: Shape (n,), bool.
    """
    return sum_moments(surface.row[samples.face], len(surface.corners), samples, ao, valid)


def sum_moments(row: Int64Array, faces: int, samples: SampleSet, ao: Float32Array, valid: BoolArray) -> FaceMoments:
    """The same for any numbering of faces.

    Args:
        row: Shape (n,), int64: the face of each sample; -1 for samples to pass over.
        faces: How many there are.
        samples, ao, valid: As for `face_moments`.
    """
    columns = ao.shape[1]
    used = np.flatnonzero(valid & (row >= 0))
    row = row[used]
    count, square, mixed = np.zeros(faces), np.zeros((faces, 3)), np.zeros((faces, 3))
    value, value_square = np.zeros((faces, 3, columns)), np.zeros((faces, columns))

    def part(begin: int, end: int) -> None:
        own, first = used[begin:end], int(row[begin:end].min())
        here = row[begin:end] - first
        rows = slice(first, first + int(here.max()) + 1)
        area = samples.area[own].astype(np.float64)
        phi = np.empty((3, len(own)))
        phi[:2] = samples.barycentric[own].T
        phi[2] = 1.0 - phi[0] - phi[1]
        count[rows] = np.bincount(here)
        weighted = phi * area
        for i in range(3):
            square[rows, i] = np.bincount(here, weighted[i] * phi[i])
            mixed[rows, i] = np.bincount(here, weighted[i] * phi[(i + 1) % 3])
        for k in range(columns):
            column = ao[own, k].astype(np.float64)
            for i in range(3):
                value[rows, i, k] = np.bincount(here, weighted[i] * column)
            value_square[rows, k] = np.bincount(here, area * column * column)

    in_spans(part, _spans_of_rows(row))
    return FaceMoments(count, square, mixed, value, value_square)


def _spans_of_rows(row: Int64Array) -> list[tuple[int, int]]:
    """Parts of samples that share no face: where they come face by face, as they mostly do; else one part."""
    if not len(row):
        return []
    if len(row) <= AT_ONCE or not (row[1:] >= row[:-1]).all():
        return [(0, len(row))]
    begins = np.unique(np.searchsorted(row, row[::AT_ONCE]))
    return list(pairwise([*begins.tolist(), len(row)]))


def at_corners(surface: Surface, per_corner: Float64Array) -> Float64Array:
    """Sums values at face corners, shape (m, 3), into their unknowns, shape (u,)."""
    return scatter_add(surface.corners, per_corner, surface.unknown_count)


def mass_entries(surface: Surface, moments: FaceMoments) -> tuple[Float64Array, Float64Array]:
    """Diagonal, shape (u,), and edge entries, shape (e,), of the mass matrix.

    The corners of a face that are one unknown have no edge; their mixed entries fall on the diagonal, twice.
    """
    return spread_pairs(surface, at_corners(surface, moments.square), moments.mixed)


def spread_pairs(surface: Surface, diagonal: Float64Array, mixed: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Brings entries between corners (0, 1), (1, 2), (2, 0) of the faces to their edges; see `mass_entries`."""
    edge = surface.face_edge
    proper = edge >= 0
    entries = scatter_add(edge[proper], mixed[proper], len(surface.edges))
    if not proper.all():
        diagonal = diagonal + scatter_add(surface.corners[~proper], 2.0 * mixed[~proper], surface.unknown_count)
    return diagonal, entries


def right_hand_side(surface: Surface, moments: FaceMoments) -> Float64Array:
    """b, shape (u, k)."""
    columns = moments.value.shape[2]
    return np.stack([at_corners(surface, moments.value[:, :, k]) for k in range(columns)], axis=1)


def square_error(corners: Int64Array, values: Float64Array, moments: FaceMoments) -> Float64Array:
    """Σ dA (interpolated value - sample)² over some faces, shape (k,), m², from their sums."""
    errors = np.zeros(values.shape[1])
    squares, products = np.empty(corners.shape), np.empty(corners.shape)
    for k in range(values.shape[1]):
        column = np.ascontiguousarray(values[:, k])

        def part(begin: int, end: int, k: int = k, column: Float64Array = column) -> None:
            here = slice(begin, end)
            x = column.take(corners[here])
            turned = np.empty_like(x)
            turned[:, :2], turned[:, 2] = x[:, 1:], x[:, 0]
            squares[here] = moments.square[here] * x * x + 2.0 * moments.mixed[here] * x * turned
            np.multiply(moments.value[here, :, k], x, out=products[here])

        in_parts(part, len(corners))
        errors[k] = squares.sum() - 2.0 * products.sum() + moments.value_square[:, k].sum()
    return errors
