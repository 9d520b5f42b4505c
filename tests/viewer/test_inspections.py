"""What a bake can be looked at by besides AO, on the small level."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from bake.types import BakeResult, VertexState
from viewer.inspections import Inspection, inspect


@pytest.mark.parametrize("kind", [kind for kind in Inspection if kind is not Inspection.TUG])
def test_every_kind_has_a_value_or_a_colour_per_vertex(baked: BakeResult, kind: Inspection) -> None:
    """Each view covers all vertices and says what its colours mean."""
    found = inspect(kind, baked, baked.field, 0)
    count = baked.world.vertex_count
    assert found.title
    assert found.inspected
    if found.rgb is None:
        assert found.values.shape == (count,)
        assert found.low < found.high
        assert np.isfinite(found.values[baked.field.state == VertexState.BAKED]).all()
    else:
        assert found.rgb.shape == (count, 3)
    assert found.colors(found.color_map, found.low, found.high).shape == (count, 3)


def test_residual_is_zero_where_samples_are_met(baked: BakeResult) -> None:
    """Samples that lie on the interpolated values leave no residual and no error."""
    samples, world = baked.samples, baked.world
    ao = np.nan_to_num(baked.field.ao, nan=0.5)
    first, second = samples.barycentric.T
    weights = np.stack((first, second, 1.0 - first - second), axis=1)
    met = np.einsum("sc,sck->sk", weights, ao[world.faces[samples.face]]).astype(np.float32)
    exact = dataclasses.replace(baked, tally=dataclasses.replace(baked.tally, ao=met))
    for kind in (Inspection.RESIDUAL, Inspection.ERROR):
        values = inspect(kind, exact, dataclasses.replace(baked.field, ao=ao), 0).values
        assert np.nanmax(values) < 1e-5


def test_density_counts_samples_by_area(baked: BakeResult) -> None:
    """Density times the area around adds up to the number of samples."""
    values = inspect(Inspection.DENSITY, baked, baked.field, 0).values.astype(np.float64)
    samples = baked.samples
    first, second = samples.barycentric.T.astype(np.float64)
    weights = np.stack((first, second, 1.0 - first - second), axis=1) * samples.area[:, None]
    area = np.bincount(baked.world.faces[samples.face].ravel(), weights.ravel(), baked.world.vertex_count)
    assert np.nansum(values * area) == pytest.approx(len(samples), rel=1e-3)


def test_tug_is_the_difference_to_no_smoothing(baked: BakeResult) -> None:
    """The tug is the value minus the value without smoothing."""
    untugged = dataclasses.replace(baked.field, ao=baked.field.ao - np.float32(0.125))
    values = inspect(Inspection.TUG, baked, baked.field, 1, untugged=untugged).values
    assert np.allclose(values[np.isfinite(values)], 0.125, atol=1e-6)


def test_winding_finds_normals_against_faces(baked: BakeResult) -> None:
    """A flipped vertex normal is marked as opposed, the others as before."""
    before = inspect(Inspection.WINDING, baked, baked.field, 0).rgb
    normals = baked.world.normals.copy()
    normals[0] *= -1.0
    flipped = dataclasses.replace(baked, world=dataclasses.replace(baked.world, normals=normals))
    after = inspect(Inspection.WINDING, flipped, baked.field, 0).rgb
    assert before is not None
    assert after is not None
    assert tuple(after[0]) == (216, 64, 74)
    assert (before[1:] == after[1:]).all()
