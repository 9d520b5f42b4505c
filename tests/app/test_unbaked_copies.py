"""A copy that is not baked yet stands beside what is: views and previews of the stored values go on working."""

from __future__ import annotations

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from app.window import Window
from bake.types import VertexState

PATIENCE_MS = 180_000

pytestmark = pytest.mark.gui


@pytest.fixture
def copied(opened: Window, qtbot: QtBot) -> Window:
    """A window in which a crate was just duplicated."""
    document = opened.document
    assert document.world is not None
    document.select(document.world.object_paths.index("Crate"))
    opened.bench.show_panel("Object")
    qtbot.waitUntil(lambda: document.current is not None and document.current.scene is not None, timeout=PATIENCE_MS)
    opened.actions_by_id["inspect-density"].trigger()
    qtbot.waitUntil(lambda: document.inspection is not None, timeout=PATIENCE_MS)
    count = document.world.object_count
    opened.actions_by_id["duplicate"].trigger()
    qtbot.waitUntil(
        lambda: document.world is not None and document.world.object_count == count + 1, timeout=PATIENCE_MS
    )
    return opened


def test_previews_are_made_of_the_stored_values(copied: Window, qtbot: QtBot) -> None:
    """Another smoothing, the other mapping and another threshold: the copy has no value in any of them."""
    document = copied.document
    assert document.stored is not None
    assert document.world is not None
    assert document.result is not None
    stored, count = document.stored.world.vertex_count, document.world.vertex_count
    assert stored < count == len(document.result.field.state)
    copied.controller.solve_alpha(0.5)
    qtbot.waitUntil(lambda: document.is_preview, timeout=PATIENCE_MS)
    assert document.field is not None
    assert len(document.field.state) == count
    assert np.isnan(document.field.ao[stored:]).all()
    assert (document.field.state[stored:] == VertexState.UNREFERENCED).all()
    copied.controller.compare(True)
    qtbot.waitUntil(lambda: document.other is not None, timeout=PATIENCE_MS)
    assert document.other is not None
    assert len(document.other.state) == count


def test_views_are_made_again_for_the_copy(copied: Window, qtbot: QtBot) -> None:
    """What is looked at besides AO belongs to the geometry in view, at every moment."""
    document = copied.document
    assert document.world is not None
    qtbot.waitUntil(lambda: document.inspection is not None, timeout=PATIENCE_MS)
    assert document.inspection is not None
    assert len(document.inspection.not_baked) == document.world.vertex_count
    for name in ("inspect-tug", "inspect-residual", "inspect-density"):
        copied.actions_by_id[name].trigger()
        qtbot.waitUntil(lambda: document.inspection is not None, timeout=PATIENCE_MS)
        assert len(document.inspection.not_baked) == document.world.vertex_count
