"""Readouts hold the numbers of the arrays."""

from __future__ import annotations

import numpy as np
import pytest

from bake.types import BakeResult
from viewer.picking import Pick
from viewer.probe import read_out
from viewer.tone import RemapCurve


@pytest.mark.parametrize("face", [0, 100, 290, -1])
def test_readout_is_exact(baked: BakeResult, face: int) -> None:
    """Interpolated values, corners, counts and position come from the arrays, not from colours."""
    world, field, samples, tally = baked.world, baked.field, baked.samples, baked.tally
    face %= world.face_count
    weights = np.array([0.2, 0.5, 0.3])
    corners = np.asarray(world.faces[face])
    position = weights @ np.asarray(world.positions[corners])
    shown = read_out(world, Pick(face, tuple(weights), tuple(position), 1.0), baked, short_share=0.03)
    np.testing.assert_allclose(shown.ao, weights @ field.ao[corners], rtol=1e-6)
    np.testing.assert_allclose(shown.corner_ao, field.ao[corners], rtol=1e-6)
    np.testing.assert_allclose(shown.position, position + world.origin)
    assert shown.nearest == 1
    mine = np.asarray(samples.face) == face
    assert shown.samples == mine.sum()
    assert shown.rays == tally.rays[mine].sum()
    assert shown.invalid == (~tally.valid(baked.settings.back_face_threshold))[mine].sum()
    owner = world.face_object[face]
    assert shown.object == world.object_paths[owner]
    assert shown.object_face == face - world.first_face[owner]
    assert shown.blended == pytest.approx(0.03 * shown.ao[0] + 0.97 * shown.ao[1], abs=1e-6)


def test_readout_without_a_result_names_the_place(baked: BakeResult) -> None:
    """Before a bake there is geometry to read, and no number is made up."""
    shown = read_out(baked.world, Pick(3, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0), None)
    assert shown.object == "Ground"
    assert shown.ao == ()
    assert all("AO" not in label for label, _ in shown.rows())


def test_lines_and_rows_say_the_same(baked: BakeResult) -> None:
    """The short and the long form carry the same interpolated values; a curve shows in the blend only."""
    pick = Pick(20, (0.3, 0.3, 0.4), (0.0, 0.0, 0.0), 1.0)
    shown = read_out(baked.world, pick, baked, curve=RemapCurve(exponent=2.0))
    rows = dict(shown.rows())
    assert f"2 m: {shown.ao[0]:.4f}" in shown.line()
    assert rows["AO at 2 m"] == f"{shown.ao[0]:.4f}"
    assert rows["AO at 300 m"] == f"{shown.ao[1]:.4f}"
    assert shown.blended < shown.ao[1]
