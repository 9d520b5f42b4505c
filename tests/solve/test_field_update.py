"""Values that follow an edit, against those of a whole solve."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bake.settings import BakeSettings, MappingKind
from bake.solve import FieldKeeper, FieldUpdate, map_to_vertices
from bake.types import Role
from tests.solve.edit_cases import Level, Part, changed_rows, level_of, some_part, world_change
from tests.solve.solve_cases import grid
from tests.worlds import icosphere

EDITS = (
    "shadow", "move", "turn", "scale", "remove", "add", "replace", "role", "alpha key", "samples key", "weld key",
    "alpha", "mapping", "nothing",
)  # fmt: skip


def whole(level: Level) -> np.ndarray:
    """The values of a solve from nothing."""
    return map_to_vertices(level.world, level.samples, level.ao, level.valid, level.settings)


def edited(level: Level, edit: str, seed: int, shadow: np.ndarray, rng: np.random.Generator) -> Level:
    """The level after one edit."""
    parts, options = list(level.parts), level.settings
    at = int(rng.integers(len(parts)))
    part = parts[at]
    if edit == "move":
        parts[at] = replace(part, positions=part.positions + np.round(rng.uniform(-2, 2, 3), int(rng.integers(3))))
    elif edit == "turn":
        angle = rng.uniform(0, 6)
        turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        parts[at] = replace(part, positions=part.positions @ turn.T)
    elif edit == "scale":
        parts[at] = replace(part, positions=part.positions * rng.choice([0.5, 2.0, 1.1], 3))
    elif edit == "remove" and len(parts) > 1:
        del parts[at]
    elif edit == "add":
        parts.insert(at, some_part(f"added {seed}", rng, weld=True))
    elif edit == "replace":
        parts[at] = replace(some_part(part.path, rng), role=part.role, keys=part.keys)
    elif edit == "role":
        parts[at] = replace(part, role=Role.BLOCKER if part.role is Role.STATIC else Role.STATIC)
    elif edit == "alpha key":
        parts[at] = replace(part, keys=replace(part.keys, alpha=float(rng.choice([0.0, 0.3, 2.0]))))
    elif edit == "samples key":
        parts[at] = replace(part, keys=replace(part.keys, samples=int(rng.integers(1, 7))))
    elif edit == "weld key":
        parts[at] = replace(part, keys=replace(part.keys, weld=not part.keys.weld))
    elif edit == "alpha":
        options = replace(options, alpha=float(rng.choice([0.0, 0.01, 0.5])))
    elif edit == "mapping":
        options = replace(options, mapping=MappingKind.AVERAGE)
    elif edit == "shadow":
        shadow = shadow + rng.uniform(-1, 1, 4) * [1, 1, 1, 0.3]
    return level_of(tuple(parts), options, seed, shadow)


def follow(keeper: FieldKeeper, old: Level, new: Level, tolerance: float) -> FieldUpdate:
    """One update."""
    change = world_change(old.world, new.world)
    return keeper.updated(
        new.world, new.samples, new.ao, new.valid, change, changed_rows(old, new, change), new.settings,
        tolerance=tolerance,
    )  # fmt: skip


def keeper_of(level: Level) -> FieldKeeper:
    """Of a bake whose values are known."""
    return FieldKeeper(level.world, level.samples, level.ao, level.valid, level.settings, field=whole(level))


@given(
    seed=st.integers(0, 2**32 - 1),
    edits=st.lists(st.sampled_from(EDITS), min_size=1, max_size=4),
    tolerance=st.sampled_from([0.0, 1e-4]),
    weld=st.booleans(),
)
@settings(max_examples=60, deadline=None)
def test_edits_one_after_another_equal_a_whole_solve(seed: int, edits: list[str], tolerance: float, weld: bool) -> None:
    """Whatever the edits are: to 1e-5 with tolerance 0, within the tolerance and what is told otherwise."""
    rng = np.random.default_rng(seed)
    options = BakeSettings(alpha=float(rng.choice([0.0, 0.03, 0.3, 300.0])), weld_instances=weld)
    parts = tuple(some_part(f"part {i}", rng, weld=True) for i in range(int(rng.integers(2, 6))))
    parts = (replace(parts[0], role=Role.STATIC), *parts[1:])
    shadow = np.array([*rng.uniform(-2, 2, 3), 1.0])
    level = level_of(parts, options, seed, shadow)
    keeper = keeper_of(level)
    for edit in edits:
        after = edited(level, edit, seed, shadow, rng)
        update = follow(keeper, level, after, tolerance)
        expected = whole(after)
        assert update.bound <= max(tolerance, 1e-6)
        np.testing.assert_allclose(update.field.ao, expected.ao, atol=1e-5 if tolerance == 0 else 2 * tolerance)
        np.testing.assert_array_equal(update.field.state, expected.state)
        level, keeper = after, update.keeper


@pytest.mark.parametrize("alpha", [0.0, 0.03, 1.0])
def test_a_small_shadow_on_a_large_mesh_is_solved_for_on_a_patch(alpha: float) -> None:
    """Again and again: most of the mesh is left alone, and what is left out does not add up."""
    parts = (Part("ground", *grid(90, 90, size=18.0)), Part("ball", *icosphere(3, 0.8)))
    rng = np.random.default_rng(3)
    shadow = np.array([4.0, 4.0, 0.0, 1.0])
    level = level_of(parts, BakeSettings(alpha=alpha), 7, shadow)
    keeper = keeper_of(level)
    solved = 0
    for _ in range(6):
        shadow = shadow + np.array([*rng.uniform(-0.3, 0.6, 2), 0, 0.02])
        after = level_of(parts, level.settings, 7, shadow)
        update = follow(keeper, level, after, 2e-3)
        expected = whole(after)
        solved += update.solved
        assert np.nanmax(np.abs(update.field.ao - expected.ao)) <= max(update.bound, 1e-6) <= 2e-3
        np.testing.assert_array_equal(update.field.state, expected.state)
        np.testing.assert_allclose(update.field.report.rmse, expected.report.rmse, rtol=1e-2)
        assert update.field.report.unknowns == expected.report.unknowns
        assert update.field.report.limited_edges == expected.report.limited_edges
        same = np.setdiff1d(np.arange(after.world.vertex_count), update.vertices)
        np.testing.assert_array_equal(update.field.ao[same], keeper.field.ao[same])
        level, keeper = after, update.keeper
    assert 0 < solved < 0.6 * 6 * level.world.vertex_count
