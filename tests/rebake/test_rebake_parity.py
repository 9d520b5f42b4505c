"""A rebake gives what a whole bake gives."""

from __future__ import annotations

import pytest

from bake.bench.rebake_edits import KINDS, RandomEdits
from bake.bench.rebake_error import rebake_errors
from bake.rebake.session import RebakeSession
from tests.rebake.small_scene import CPU, SETTINGS, baked, drained, small_scene


@pytest.mark.parametrize("seed", range(3))
def test_random_edits_without_bound_equal_whole_bakes(seed: int) -> None:
    """With the bound at 0, one edit of each kind after the other gives the values of a whole bake."""
    scene = small_scene()
    edits = RandomEdits(scene, SETTINGS, seed)
    kinds = sorted(KINDS)
    order = [kinds[(5 * i + seed) % len(kinds)] for i in range(len(kinds))]
    with RebakeSession(baked(scene), scene, CPU, bound=0.0) as session:
        for kind in order:
            edit = edits.next(kind)
            outcome = drained(session.rebake(edit.scene, edit.settings))
            errors = rebake_errors(outcome.result, baked(edit.scene, edit.settings))
            assert max(error.largest for error in errors.values()) <= 1e-5, (kind, edit.object, errors)
