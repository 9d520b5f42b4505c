"""The outliner: tree, filter, order, selection and eyes, with many objects."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PyQt6.QtCore import QItemSelectionModel, QModelIndex, Qt
from PyQt6.QtTest import QAbstractItemModelTester
from PyQt6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot
from settling import settle

from app.document import Document
from app.object_tree import ObjectTree
from app.outliner import Outliner
from app.outliner_model import Column
from app.scene_state import SceneState
from bake.settings import BakeSettings
from bake.types import ObjectKeys, Role, World

gui = pytest.mark.gui


def make_world(paths: list[str], roles: list[Role] | None = None) -> World:
    """A triangle for each path; object i has i % 3 more."""
    count = len(paths)
    faces_of = 1 + np.arange(count) % 3
    first_face = np.concatenate(([0], np.cumsum(faces_of))).astype(np.int64)
    first_vertex = (3 * np.arange(count + 1)).astype(np.int64)
    face_object = np.repeat(np.arange(count, dtype=np.int32), faces_of)
    positions = np.repeat(np.arange(count, dtype=np.float64), 3)[:, None] + np.tile(np.eye(3), (count, 1))
    faces = (3 * face_object[:, None] + np.arange(3)).astype(np.int32)
    ones = np.ones(len(faces), bool)
    return World(
        origin=np.zeros(3),
        positions=positions,
        normals=np.zeros((3 * count, 3), np.float32),
        faces=faces,
        face_object=face_object,
        face_casts=ones,
        face_samples=ones,
        face_two_sided=~ones,
        face_openness=np.zeros(len(faces), np.float32),
        first_vertex=first_vertex,
        first_face=first_face,
        object_paths=tuple(paths),
        object_roles=tuple(roles or [Role.STATIC] * count),
        object_keys=(ObjectKeys(),) * count,
        object_hash=tuple(f"{index:032x}" for index in range(count)),
    )


PATHS = ["Level/Wall", "Level/Trees/oak_10", "Level/Trees/oak_9", "Sky", "Level/Tower", "Level/Tower/Door"]
ROLES = [Role.STATIC, Role.TREE, Role.TREE, Role.BLOCKER, Role.STATIC, Role.SMALL]


@pytest.fixture
def document() -> Document:
    """A document over a few objects."""
    document = Document()
    document.set_world(make_world(PATHS, ROLES))
    return document


@pytest.fixture
def outliner(document: Document, qtbot: QtBot) -> Outliner:
    """The outliner over it, watched by Qt's own tester of models."""
    outliner = Outliner(document)
    qtbot.addWidget(outliner)
    QAbstractItemModelTester(outliner.model, QAbstractItemModelTester.FailureReportingMode.Warning, outliner)
    outliner.show()
    return outliner


def _rows(outliner: Outliner, parent: QModelIndex | None = None) -> list[str]:
    model, parent = outliner.model, parent or QModelIndex()
    return [str(model.index(row, 0, parent).data()) for row in range(model.rowCount(parent))]


def _below(outliner: Outliner, *names: str) -> list[str]:
    index = QModelIndex()
    for name in names:
        index = outliner.model.index(_rows(outliner, index).index(name), 0, index)
    return _rows(outliner, index)


@given(st.lists(st.lists(st.sampled_from("ab1"), min_size=1, max_size=4).map("/".join), unique=True, max_size=12))
def test_every_object_has_its_place(paths: list[str]) -> None:
    """Paths come back from the tree, sums add up, and filtering keeps exactly what is wanted with its groups."""
    tree = ObjectTree(paths)
    assert [tree.path(node) for node in tree.node_of] == paths
    assert sorted(index for node in tree.children(-1) for index in tree.objects_below(node)) == list(range(len(paths)))
    totals = tree.totals(np.ones(len(paths), np.int64))
    assert sum(totals[node] for node in tree.children(-1)) == len(paths)
    wanted = np.arange(len(paths)) % 2 == 0
    tree.show(wanted, tree.name_key, descending=True)
    shown = {index for node in tree.children(-1) for index in tree.objects_below(node)}
    assert shown >= set(np.flatnonzero(wanted).tolist())
    assert all(tree.row(tree.node_of[index]) >= 0 for index in np.flatnonzero(wanted))


@gui
def test_objects_stand_below_their_groups(outliner: Outliner) -> None:
    """Groups hold objects; an object may hold others; triangles of groups are those of everything in them."""
    assert _rows(outliner) == ["Level", "Sky"]
    assert _below(outliner, "Level") == ["Wall", "Trees", "Tower"]
    assert _below(outliner, "Level", "Tower") == ["Door"]
    model = outliner.model
    assert model.index(0, Column.TRIANGLES).data() == "11"
    assert model.index_of(4, Column.ROLE).data() == "static"
    assert "oak_10" in model.index_of(1).data(Qt.ItemDataRole.ToolTipRole)


@gui
def test_filter_finds_path_role_and_state(outliner: Outliner, document: Document) -> None:
    """All words must be in path or role; states and roles can be asked for by name."""
    visible = document.visible.copy()
    visible[3] = False
    document.set_visible(visible)
    for text, expected in (
        ("oak", [1, 2]),
        ("level SMALL", [5]),
        ("role:tree", [1, 2]),
        ("is:hidden", [3]),
        ("is:shown tower", [4, 5]),
        ("is:stale", []),
        ("nowhere", []),
        ("", list(range(6))),
    ):
        outliner.filter.setText(text)
        found = [index for index in range(6) if outliner.model.index_of(index).isValid()]
        assert set(expected) <= set(found)
        assert outliner.model.shown_count == len(expected)
    outliner.filter.setText("oak")
    assert outliner.tree.isExpanded(outliner.model.index(0, 0))


@gui
def test_siblings_are_sorted(outliner: Outliner) -> None:
    """By name as people count, by number, and back to the order of the scene."""
    outliner.model.sort(Column.NAME, Qt.SortOrder.AscendingOrder)
    assert _below(outliner, "Level", "Trees") == ["oak_9", "oak_10"]
    outliner.model.sort(Column.NAME, Qt.SortOrder.DescendingOrder)
    assert _rows(outliner) == ["Sky", "Level"]
    outliner.model.sort(Column.TRIANGLES, Qt.SortOrder.DescendingOrder)
    assert _below(outliner, "Level") == ["Trees", "Tower", "Wall"]
    outliner.model.sort(-1)
    assert _below(outliner, "Level") == ["Wall", "Trees", "Tower"]


@gui
def test_selection_goes_both_ways(outliner: Outliner, document: Document) -> None:
    """Rows select objects, a group all that is in it; what others select is shown and scrolled to."""
    selection = outliner.tree.selectionModel()
    assert selection is not None
    flag = QItemSelectionModel.SelectionFlag
    trees = outliner.model.index_of(1).parent()
    selection.select(trees, flag.ClearAndSelect | flag.Rows)
    assert document.selection == (1, 2)
    assert selection.isSelected(trees)  # still the group, not its objects
    selection.select(outliner.model.index_of(3), flag.Select | flag.Rows)
    assert document.selection == (1, 2, 3)
    document.select_all((0, 5), 5)
    assert outliner.is_chosen(0)
    assert outliner.is_chosen(5)
    assert not selection.isSelected(trees)
    assert "2 selected" in outliner._count.text()
    outliner.filter.setText("wall")
    assert document.selection == (0, 5)
    outliner.filter.clear()
    assert outliner.is_chosen(5)
    document.select(-1)
    assert not selection.hasSelection()


@gui
def test_eyes_hide_groups_and_selections(outliner: Outliner, document: Document) -> None:
    """An eye hides its row with all below; one of several selected rows hides all of them; groups show halves."""
    outliner._toggle(outliner.model.index_of(1).parent())
    np.testing.assert_array_equal(document.visible, [True, False, False, True, True, True])
    outliner.toggle(1)
    assert 0.0 < outliner.model.index(0, 0).data(257) < 1.0
    document.select_all((0, 3))
    outliner.toggle(3)
    np.testing.assert_array_equal(document.visible, [False, True, False, False, True, True])
    outliner.toggle(3)
    np.testing.assert_array_equal(document.visible, [True, True, False, True, True, True])


@gui
def test_stale_objects_are_marked(outliner: Outliner, document: Document) -> None:
    """What has changed since the bake has a mark and says how; so do the groups above it."""
    objects = {path: (role, ObjectKeys(), "") for path, role in zip(PATHS, ROLES, strict=True)}
    objects["Level/Wall"] = (Role.BLOCKER, ObjectKeys(), "")
    state = SceneState({}, BakeSettings(), objects, stale=frozenset({"Level/Wall"}), gone=frozenset({"Sky"}))
    document.set_current(state)
    model = outliner.model
    assert model.index_of(0).data(256)
    assert "baked as static, now blocker" in model.index_of(0).data(Qt.ItemDataRole.ToolTipRole)
    assert "no longer" in model.index_of(3).data(Qt.ItemDataRole.ToolTipRole)
    assert model.index_of(0).parent().data(256)
    assert not model.index_of(1).data(256)
    assert "1 changed, 1 gone" in outliner._count.text()
    outliner.filter.setText("is:stale")
    assert model.shown_count == 2


@gui
def test_twenty_thousand_objects_need_no_widgets(qtbot: QtBot) -> None:
    """A large scene fills, filters, sorts and selects without a widget a row."""
    paths = [f"Level/Block_{index // 500}/house_{index % 500}" for index in range(20_000)]
    document = Document()
    outliner = Outliner(document)
    qtbot.addWidget(outliner)
    outliner.resize(300, 700)
    outliner.show()
    header = outliner.tree.header()
    assert header is not None
    document.set_world(make_world(paths))
    outliner.filter.setText("house_499")
    assert outliner.model.shown_count == 40
    outliner.filter.clear()
    header.setSortIndicator(0, Qt.SortOrder.DescendingOrder)
    document.select(12_345)
    assert outliner.name_of(12_345) == "house_345"
    document.select_all(range(20_000))
    document.set_visible(np.zeros(20_000, bool))
    settle()
    assert outliner.model.shown_count == 20_000
    assert len(outliner.tree.findChildren(QWidget)) < 20
    assert document.selection == tuple(range(20_000))
