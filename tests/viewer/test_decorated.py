"""Values of trees and small decorators: exact against the stored numbers, and only where they belong."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from decorated_level import OPEN_SHARE, with_decorators

from bake.types import BakeResult, Role, VertexField, VertexState
from viewer.decorated import DecoratedValues
from viewer.decorator_rows import decorator_line, decorator_rows, state_word, tree_errors
from viewer.decorator_view import DecoratorView, TreeShading
from viewer.instance_rows import KINDS, available_kinds, instance_columns
from viewer.lods import (
    at_level,
    finest_objects,
    level_count,
    level_differences,
    levels_of,
    lod_levels,
    shown_level,
    vertices_of,
)
from viewer.picking import Pick
from viewer.probe import read_out


@pytest.fixture(scope="module")
def decorated(baked: BakeResult) -> BakeResult:
    """The small level with decorators."""
    return with_decorators(baked)


def _span(result: BakeResult, index: int) -> slice:
    return slice(int(result.world.first_vertex[index]), int(result.world.first_vertex[index + 1]))


def test_product_is_local_times_the_linear_function(decorated: BakeResult) -> None:
    """Every vertex of a tree has L (y0 + y·(x - centre)), exactly from the stored numbers."""
    values, found = DecoratedValues(decorated), decorated.decorators
    assert found is not None
    assert found.fits is not None
    for row, index in enumerate(found.fits.object):
        offsets = decorated.world.positions[_span(decorated, index)] - found.fits.centre[row]
        y = found.fits.coefficients[row]
        expected = found.models[0].local_ao * (y[0] + offsets @ y[1:])
        np.testing.assert_allclose(values.tree(row, TreeShading.PRODUCT), expected, rtol=1e-5)
        np.testing.assert_array_equal(values.tree(row, TreeShading.LOCAL), found.models[0].local_ao)


def test_constant_volume_gives_constant_gold_and_linear(decorated: BakeResult) -> None:
    """Where ρ is the same in all directions and places, gold and its best linear function are that constant."""
    values = DecoratedValues(decorated)
    np.testing.assert_allclose(values.tree(1, TreeShading.GOLD), OPEN_SHARE, atol=1e-5)
    np.testing.assert_allclose(values.tree(1, TreeShading.LINEAR), OPEN_SHARE, atol=1e-5)


def test_surfaces_keep_their_values(decorated: BakeResult) -> None:
    """Decorating changes decorators' vertices only, and nothing at all where nothing is asked for."""
    values, field = DecoratedValues(decorated), decorated.field
    assert values.decorate(field, DecoratorView(trees=TreeShading.NONE, scalars=False)) is field
    drawn = values.decorate(field, DecoratorView())
    roles = np.repeat([role.value for role in decorated.world.object_roles], np.diff(decorated.world.first_vertex))
    same = ~np.isin(roles, [Role.TREE.value, Role.SHRUB.value])
    np.testing.assert_array_equal(drawn.ao[same], field.ao[same])
    np.testing.assert_array_equal(drawn.state[same], field.state[same])
    assert np.all(drawn.ao[roles == Role.SHRUB.value] == np.float32(0.4))
    assert np.all(drawn.state[roles == Role.TREE.value] == VertexState.BAKED)
    assert np.isnan(field.ao[roles == Role.TREE.value]).all()


def test_lods_keep_the_stored_values_on_other_fields(decorated: BakeResult) -> None:
    """A field solved for another threshold knows no lower LODs: they stay as stored."""
    room = decorated.world.object_paths.index("Room")
    other_ao, other_state = np.array(decorated.field.ao), np.array(decorated.field.state)
    other_ao[_span(decorated, room)], other_state[_span(decorated, room)] = np.nan, VertexState.NOT_BAKED
    other = VertexField(other_ao, other_state, decorated.field.report)
    drawn = DecoratedValues(decorated).decorate(other, DecoratorView())
    np.testing.assert_array_equal(drawn.ao[_span(decorated, room)], decorated.field.ao[_span(decorated, room)])


def test_probe_tells_the_factors_of_a_tree(decorated: BakeResult) -> None:
    """Local, global, product and gold of the nearest vertex, and no samples, for a point on a tree."""
    values, view, found = DecoratedValues(decorated), DecoratorView(), decorated.decorators
    assert found is not None
    assert found.fits is not None
    index = int(found.fits.object[1])
    face = int(decorated.world.first_face[index])
    pick = Pick(face, (0.1, 0.7, 0.2), (0.0, 0.0, 0.0), 1.0)
    drawn = values.decorate(decorated.field, view)
    readout = read_out(decorated.world, pick, decorated, field=drawn, values=values, view=view)
    vertex = readout.vertices[1]
    product = values.tree(1, TreeShading.PRODUCT)
    corners = np.asarray(decorated.world.faces[face])
    np.testing.assert_allclose(readout.ao, np.array(pick.barycentric) @ drawn.ao[corners], rtol=1e-6)
    rows = dict(readout.rows())
    assert rows[f"Product (v{vertex})"] == "  ".join(f"{value:.4f}" for value in product[vertex])
    assert f"{OPEN_SHARE:.4f}" in rows[f"Gold (v{vertex})"]
    assert "Samples" not in rows
    assert readout.corner_states == ("local × global",) * 3
    assert f"local {values.local_ao(1)[vertex, 0]:.4f}" in readout.line()
    assert state_word(values, index, DecoratorView(trees=TreeShading.GOLD)) == "gold"


def test_probe_tells_fog_and_scalar_of_a_shrub(decorated: BakeResult) -> None:
    """Given and used density with what overlap took, and the scalar with its warning."""
    values = DecoratedValues(decorated)
    index = decorated.world.object_paths.index("Flipped")
    rows = decorator_rows(decorated, values, index, 0)
    assert rows[0] == ("Fog density", "0.750 of 1.000 1/m, 25% lost to overlap")
    assert rows[1] == ("Fog density", "0.800 of 0.800 1/m")
    assert rows[2][1].startswith("0.4000")
    assert "no baked surface" in rows[2][1]
    assert decorator_rows(decorated, values, decorated.world.object_paths.index("Ground"), 0) == []
    assert decorator_line(decorated, values, index, 0).startswith("Fog density: 0.750")


def test_tables_have_the_stored_numbers(decorated: BakeResult, baked: BakeResult) -> None:
    """Each kind lists its instances; a result without decorators has no tables."""
    assert available_kinds(baked) == []
    assert available_kinds(decorated) == list(KINDS)
    trees = {column.heading: column for column in instance_columns(decorated, "Trees")}
    assert list(trees["Object"].texts) == ["Crate", "Buried"]
    assert list(trees["Product 2 m"].texts) == ["0.1000"] * 2
    fog = {column.heading: column for column in instance_columns(decorated, "Fog boxes")}
    assert list(fog["Lost to overlap"].texts) == ["25 %", "0 %"]
    assert [column.heading for column in instance_columns(decorated, "LODs")][:3] == ["Object", "Level", "Of"]
    assert instance_columns(decorated, "Scalars")[-1].texts == ["no: open"]
    values = DecoratedValues(decorated)
    assert "0.2000" in tree_errors(decorated, values, 0, TreeShading.LINEAR)
    assert "0.0500" in tree_errors(decorated, values, 0, TreeShading.GOLD)
    assert tree_errors(decorated, values, 0, TreeShading.LOCAL) == ""


def test_levels_replace_each_other(decorated: BakeResult) -> None:
    """Showing a level shows that level alone of what has LODs, and leaves the rest."""
    world = decorated.world
    ground, room = world.object_paths.index("Ground"), world.object_paths.index("Room")
    assert lod_levels(world) == {"Ground": [room]}
    assert level_count(world) == 1
    assert finest_objects(world, "Ground") == [ground]
    visible = np.ones(world.object_count, bool)
    visible[room] = False
    assert shown_level(world, visible) == 0
    lower = at_level(world, visible, 1)
    assert (bool(lower[ground]), bool(lower[room])) == (False, True)
    assert shown_level(world, lower) == 1
    np.testing.assert_array_equal(at_level(world, lower, 0), visible)
    both = np.ones(world.object_count, bool)
    assert shown_level(world, both) == -1


def test_without_decorators_nothing_is_known(baked: BakeResult) -> None:
    """No trees, no models, no rows; a mismatched model gives no value instead of a wrong one."""
    values = DecoratedValues(baked)
    assert values.has(TreeShading.NONE)
    assert not values.has(TreeShading.PRODUCT)
    assert values.decorate(baked.field, DecoratorView()) is baked.field
    broken = with_decorators(baked)
    assert broken.decorators is not None
    model = dataclasses.replace(broken.decorators.models[0], local_ao=np.ones((3, 2), np.float32))
    broken = dataclasses.replace(broken, decorators=dataclasses.replace(broken.decorators, models=(model,)))
    assert np.isnan(DecoratedValues(broken).tree(0, TreeShading.PRODUCT)).all()


def test_levels_know_their_siblings_and_how_far_they_are(decorated: BakeResult) -> None:
    """Either level names both; a copy of the finest level differs by nothing, a shifted value by the shift."""
    world = decorated.world
    ground, room = world.object_paths.index("Ground"), world.object_paths.index("Room")
    levels = levels_of(world, room)
    assert levels == levels_of(world, ground)
    assert levels is not None
    assert (levels.finest, levels.lower) == ((ground,), (room,))
    assert levels_of(world, world.object_paths.index("Crate")) is None
    ao = np.full(decorated.field.ao.shape, 0.5, np.float32)
    ao[vertices_of(world, (room,))] = 0.7
    np.testing.assert_allclose(level_differences(world, ao, levels)[0], 0.2, atol=1e-6)
    ao[vertices_of(world, (ground,))] = np.nan
    assert np.isnan(level_differences(world, ao, levels)[0]).all()
