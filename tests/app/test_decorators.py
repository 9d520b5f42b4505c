"""The window over a result with decorators: panel, marks, tables, comparison; and their absence without any."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from decorated_level import with_decorators
from pytestqt.qtbot import QtBot

from app.window import Window
from bake.types import BakeResult
from viewer.decorated import DecoratedValues
from viewer.decorator_view import ALL_LAYERS, FogColor, TreeShading, VoxelColor
from viewer.fields import Quantity

pytestmark = pytest.mark.gui


@pytest.fixture
def planted(window: Window, baked: BakeResult, qtbot: QtBot) -> Window:
    """A window over the small level with decorators."""
    window.document.open_scene(Path("small.obj"), Path("result"), {}, (), 1)
    window.document.set_result(with_decorators(baked), Path("result"))
    window.picker.finish()
    window.bench.show_panel("Decorators")
    return window


def _tree(window: Window) -> int:
    values = window.document.values
    assert values is not None
    assert values.decorators.fits is not None
    return int(values.decorators.fits.object[0])


def test_nothing_is_offered_without_decorators(shown: Window) -> None:
    """A result without decorators has no groups and no tables."""
    panel = shown.panels.decorators
    assert not any(group.isVisibleTo(panel) for group in panel._groups)
    assert panel._none.isVisibleTo(panel)
    assert shown.panels.instances.view.proxy.rowCount() == 0
    assert not shown.panels.instances._kind.isEnabled()


def test_trees_are_coloured_by_the_chosen_model(planted: Window, qtbot: QtBot) -> None:
    """The picture has the model's values at the tree's vertices, and the legend names it."""
    document, surface = planted.document, planted.area.main._surface
    assert surface is not None
    assert document.result is not None
    values = DecoratedValues(document.result)
    document.set_display(document.display.replaced(quantity=Quantity.DISTANCE, column=0))
    index = _tree(planted)
    span = slice(int(document.result.world.first_vertex[index]), int(document.result.world.first_vertex[index + 1]))
    combo = planted.panels.decorators.trees
    for shading in (TreeShading.PRODUCT, TreeShading.GOLD, TreeShading.LOCAL, TreeShading.LINEAR):
        combo.setCurrentIndex(combo.findData(shading))
        qtbot.waitUntil(lambda shading=shading: document.tree_shading is shading, timeout=10_000)
        expected = np.floor(np.clip(values.tree(0, shading)[:, 0], 0, 1) * 255 + 0.5).astype(np.uint8)
        np.testing.assert_array_equal(surface.colors[span, 0], expected)
        scale = planted.area.main.legend.scale
        assert scale is not None
        assert "trees: " in scale.note
    combo.setCurrentIndex(combo.findData(TreeShading.NONE))
    assert len(np.unique(surface.colors[span, 2])) > 0
    assert document.drawn(document.result.field).ao[span].size
    assert np.isnan(document.drawn(document.result.field).ao[span]).all()


def test_marks_come_with_their_legend(planted: Window) -> None:
    """Fog, bricks, voxels and slices appear on choice, each with its scale, and go again."""
    panel, main = planted.panels.decorators, planted.area.main
    panel.fog.setCurrentIndex(panel.fog.findData(FogColor.LOST))
    assert main._shapes["fog edges"].actor.GetVisibility()
    scale = main._scales["fog"].scale
    assert scale is not None
    assert scale.unit == "%"
    panel.fog.setCurrentIndex(panel.fog.findData(None))
    assert not main._shapes["fog edges"].actor.GetVisibility()
    assert not main._scales["fog"].isVisible()
    volume = panel.volume
    volume.bricks.setChecked(True)
    volume.voxels.setCurrentIndex(volume.voxels.findData(VoxelColor.AO))
    assert main._shapes["bricks"].actor.GetVisibility()
    assert main._points["voxels"].actor.GetVisibility()
    volume.slice.setChecked(True)
    assert planted.document.decorators.layer != ALL_LAYERS
    assert not main._points["voxels"].actor.GetVisibility()
    assert main._shapes["slice"].actor.GetVisibility()
    volume.layer.setValue(0)
    assert planted.document.decorators.layer == int(volume._layers[0])
    assert volume._height.text().endswith(" m")


def test_clicked_voxel_shows_its_harmonics(planted: Window) -> None:
    """A click on a voxel draws its sphere and lists its values; it can be forgotten."""
    main, volume = planted.area.main, planted.panels.decorators.volume
    volume.voxels.setCurrentIndex(volume.voxels.findData(VoxelColor.VALIDITY))
    voxels = planted.presenter.decorators._voxels
    assert voxels is not None
    top = int(np.argmax(voxels.positions[:, 1]))
    main.ray_clicked.emit(voxels.positions[top] + np.array([0.0, 3.0, 0.0]), np.array([0.0, -1.0, 0.0]), None)
    assert planted.document.decorators.voxel == top
    assert main._shapes["glyph"].actor.GetVisibility()
    assert f"Voxel {top:,}" in volume._voxel.text()
    volume._forget.click()
    assert not main._shapes["glyph"].actor.GetVisibility()


def test_table_selects_and_lists_errors(planted: Window) -> None:
    """The table of trees has a row each; choosing one selects the tree."""
    planted.panels.decorators.table_requested.emit("Trees")
    table = planted.panels.instances
    assert table.view.proxy.rowCount() == 2
    table.view.selectRow(0)
    world = planted.document.world
    assert world is not None
    assert world.object_paths[planted.document.selected] == "Buried"
    table.set_kind("Fog boxes")
    assert table.view.proxy.rowCount() == 2
    table.view.selectRow(0)
    assert world.object_paths[planted.document.selected] == "Flipped"


def test_three_models_side_by_side(planted: Window) -> None:
    """The selected tree is drawn three times with the error of each model; it closes without a trace."""
    planted.document.select(_tree(planted))
    planted.panels.decorators._models.click()
    trees = planted.area.trees
    assert trees is not None
    assert len(trees.surfaces) == 3
    assert "0.2000" in trees.captions[0].text()
    assert "0.1000" in trees.captions[1].text()
    assert "Crate" in trees.title.text()
    gold = trees.surfaces[2].colors
    assert len(np.unique(gold, axis=0)) == 1
    planted.actions_by_id["tree-models"].trigger()
    assert planted.area.trees is None


def test_values_of_many_trees_are_made_off_the_thread(planted: Window, qtbot: QtBot) -> None:
    """Until gold is made the trees keep their colours and the legend says so; then picture and legend follow."""
    document, main = planted.document, planted.area.main
    document.set_display(document.display.replaced(quantity=Quantity.DISTANCE, column=0))
    assert main._surface is not None
    before = main._surface.colors.copy()
    document.set_decorators(document.decorators.replaced(trees=TreeShading.GOLD))
    assert document.tree_shading is TreeShading.PRODUCT
    np.testing.assert_array_equal(main._surface.colors, before)
    assert main.legend.scale is not None
    assert "being made" in main.legend.scale.note
    qtbot.waitUntil(lambda: document.tree_shading is TreeShading.GOLD, timeout=10_000)
    assert (main._surface.colors != before).any()
    assert main.legend.scale is not None
    assert "being made" not in main.legend.scale.note


def test_levels_side_by_side(planted: Window, qtbot: QtBot) -> None:
    """The finest level and the lower one are drawn beside each other, with what the lower one is off by."""
    world, document = planted.document.world, planted.document
    assert world is not None
    document.select(world.object_paths.index("Room"))
    planted.actions_by_id["lod-levels"].trigger()
    lods = planted.area.lods
    assert lods is not None
    assert len(lods.surfaces) == 2
    room, ground = world.object_paths.index("Room"), world.object_paths.index("Ground")
    counts = [int(world.first_face[i + 1] - world.first_face[i]) for i in (ground, room)]
    assert [surface.face_count for surface in lods.surfaces] == counts
    qtbot.waitUntil(lambda: "off by" in lods.captions[1].text(), timeout=10_000)
    assert "Finest" in lods.captions[0].text()
    assert "Ground" in lods.title.text()
    document.select(-1)
    assert "Ground" in lods.title.text()
    planted.panels.decorators.models_requested.emit()
    assert planted.area.lods is None
    assert planted.area.trees is not None
    assert not planted.actions_by_id["lod-levels"].isChecked()
    planted.panels.decorators.lods_requested.emit()
    planted.actions_by_id["lod-levels"].trigger()
    assert planted.area.below is None


def test_levels_and_ticks_agree(planted: Window) -> None:
    """Choosing a level changes what is drawn and the ticks of the list; ticking one oneself shows as such."""
    panel, document = planted.panels.decorators, planted.document
    world = document.world
    assert world is not None
    ground, room = world.object_paths.index("Ground"), world.object_paths.index("Room")
    assert panel.level.currentText() == "Finest"
    panel.level.setCurrentIndex(1)
    panel.level.activated.emit(1)
    assert (bool(document.visible[ground]), bool(document.visible[room])) == (False, True)
    assert planted.document.visible[room]
    document.set_visible(np.ones(world.object_count, bool))
    assert panel.level.currentText() == "As ticked in Objects"


def test_values_survive_another_threshold(planted: Window) -> None:
    """Trees and lower LODs keep their values while the threshold is moved."""
    document = planted.document
    assert document.result is not None
    field = document.result.field
    document.set_field(dataclasses.replace(field, ao=np.array(field.ao)))
    assert document.field is not None
    index = _tree(planted)
    begin = int(document.result.world.first_vertex[index])
    assert np.isfinite(document.drawn(document.field).ao[begin]).all()
