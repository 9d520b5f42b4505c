"""The average's sums and searches, made in parts or with less work, against the plain way."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from bake.in_parts import AT_ONCE
from bake.solve.average import fill_by_rings, nearest_among
from bake.solve.mass import FaceMoments, square_error, sum_moments
from bake.solve.surface import by_component, component_order
from bake.types import SampleSet


def _samples(face: np.ndarray, random: np.random.Generator) -> SampleSet:
    weights = random.dirichlet(np.ones(3), len(face))[:, :2].astype(np.float32)
    area = random.random(len(face)).astype(np.float32)
    return SampleSet(face.astype(np.int32), weights, area, np.zeros(len(face), np.int32), np.zeros(1, np.uint32))


@pytest.mark.parametrize("is_sorted", [True, False])
@pytest.mark.parametrize("count", [0, 40, 3 * AT_ONCE + 5])
def test_moments_are_sums_over_the_samples_of_each_face(count: int, is_sorted: bool) -> None:
    """To the bit, in the samples' order, whether they come face by face or not."""
    random = np.random.default_rng(count)
    faces = count // 3 + 5
    face = random.integers(0, faces, count)
    samples = _samples(np.sort(face) if is_sorted else face, random)
    ao, valid = random.random((count, 2)).astype(np.float32), random.random(count) < 0.8
    row = np.where(samples.face % 7 == 3, -1, samples.face).astype(np.int64)
    moments = sum_moments(row, faces, samples, ao, valid)
    used = np.flatnonzero(valid & (row >= 0))
    phi = np.empty((3, len(used)))
    phi[:2] = samples.barycentric[used].T
    phi[2] = 1.0 - phi[0] - phi[1]
    area, values = samples.area[used].astype(np.float64), ao[used].astype(np.float64)

    def total(weights: np.ndarray) -> np.ndarray:
        return np.bincount(row[used], weights, faces).astype(np.float64)

    np.testing.assert_array_equal(moments.count, total(np.ones(len(used))))
    for i in range(3):
        j = (i + 1) % 3
        np.testing.assert_array_equal(moments.square[:, i], total(phi[i] * area * phi[i]))
        np.testing.assert_array_equal(moments.mixed[:, i], total(phi[i] * area * phi[j]))
        for k in range(2):
            np.testing.assert_array_equal(moments.value[:, i, k], total(phi[i] * area * values[:, k]))
    for k in range(2):
        np.testing.assert_array_equal(moments.value_square[:, k], total(area * values[:, k] * values[:, k]))
    np.testing.assert_array_equal(moments.mass, moments.square + moments.mixed + moments.mixed[:, [2, 0, 1]])


def test_square_error_is_the_sum_over_samples() -> None:
    """Of many faces, worked out in parts."""
    random = np.random.default_rng(3)
    faces = 2 * AT_ONCE + 7
    corners, samples = random.integers(0, 500, (faces, 3)), _samples(np.arange(faces), random)
    ao, values = random.random((faces, 2)).astype(np.float32), random.random((500, 2))
    moments: FaceMoments = sum_moments(np.arange(faces), faces, samples, ao, np.ones(faces, np.bool_))
    phi = np.column_stack((samples.barycentric, 1.0 - samples.barycentric.sum(axis=1, dtype=np.float64)))
    interpolated = np.einsum("mi,mik->mk", phi, values[corners])
    expected = (samples.area[:, None].astype(np.float64) * (interpolated - ao) ** 2).sum(axis=0)
    np.testing.assert_allclose(square_error(corners, values, moments), expected, rtol=1e-6)


@given(seed=st.integers(0, 2**32 - 1))
def test_the_nearest_is_the_first_in_any_order(seed: int) -> None:
    """Also where more are equally near than are looked at, as on one point; and where none are, nobody asks for it."""
    random = np.random.default_rng(seed)
    count = int(random.integers(2, 90))
    position = random.integers(0, int(random.integers(1, 5)), (count, 3)).astype(np.float64)
    if seed % 3 == 0:
        position += random.random((count, 3))
    is_known = random.random(count) < 0.8
    is_known[0] = True
    known, wanted = np.flatnonzero(is_known), np.flatnonzero(~is_known)
    rank = random.permutation(count) * 1000
    found = nearest_among(position, known, wanted, lambda: rank)
    distance = np.linalg.norm(position[known][None] - position[wanted][:, None], axis=2)
    for each, (row, one) in enumerate(zip(distance, found.tolist(), strict=True)):
        tied = known[row <= row.min() * (1.0 + 1e-9)]
        if len(tied) <= 32:
            assert one == tied[rank[tied].argmin()]
        else:
            by_rank = known[np.argsort(rank[known])]
            assert one == nearest_among(position, by_rank, wanted)[each]


@given(seed=st.integers(0, 2**32 - 1))
def test_unknowns_come_component_by_component(seed: int) -> None:
    """In the order of their components' first vertices, then of their own; also those without a face."""
    random = np.random.default_rng(seed)
    count, faces = int(random.integers(1, 30)), int(random.integers(0, 12))
    unknown = random.permutation(np.concatenate((np.arange(count), random.integers(-1, count, 10))))
    corners = random.integers(0, count, (faces, 3))
    ends = np.concatenate((corners[:, :2], corners[:, 1:]))
    graph = coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(count, count))
    label = connected_components(graph, directed=False)[1]
    appearance = np.array([np.flatnonzero(unknown == one)[0] for one in range(count)])
    begins = np.array([appearance[label == label[one]].min() for one in range(count)])
    expected = np.lexsort((appearance, begins))
    np.testing.assert_array_equal(np.argsort(component_order(unknown, corners, count)), expected)
    renumbered, turned, first = by_component(unknown, corners, count)
    place = np.empty(count, np.int64)
    place[expected] = np.arange(count)
    np.testing.assert_array_equal(renumbered, np.where(unknown >= 0, place[unknown], -1))
    np.testing.assert_array_equal(turned, place[corners])
    np.testing.assert_array_equal(np.diff(first), np.unique(begins, return_counts=True)[1])


def test_rings_fill_outwards() -> None:
    """Each ring takes the mean of the neighbours that had a value before it."""
    edges = np.array([[0, 1], [1, 2], [2, 3], [1, 3], [4, 5]])
    values, starved = np.array([[1.0], [0.0], [0.0], [0.5], [0.0], [0.0]]), np.array([0, 1, 1, 0, 1, 1], np.bool_)
    known = fill_by_rings(edges, values, starved)
    np.testing.assert_array_equal(known, [True, True, True, True, False, False])
    np.testing.assert_array_equal(values[:4, 0], [1.0, 0.75, 0.5, 0.5])
