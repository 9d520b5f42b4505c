"""Two results at once, and the runtime preview, in the window."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pytestqt.qtbot import QtBot
from settling import settle
from small_level import OPTIONS

from app.compare_panel import CompareMode
from app.parts.comparison import ComparisonPart
from app.window import Window
from bake.pipeline import BakeRequest, run_bake
from viewer.fields import Quantity
from viewer.runtime_light import ambient_map

PATIENCE_MS = 180_000

pytestmark = pytest.mark.gui


@pytest.fixture(scope="module")
def other_folder(level: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small level without its crate, with a taller box buried, baked with fewer rays."""
    folder = tmp_path_factory.mktemp("other")
    text = level.read_text().split("\no ")
    kept = [part for part in text if not part.startswith("Crate")]
    removed = sum(line.startswith("v ") for part in text if part.startswith("Crate") for line in part.splitlines())
    after = [part.split("\n", 1)[0] for part in text[text.index(next(p for p in text if p.startswith("Crate"))) + 1 :]]
    lines = "\no ".join(kept).splitlines()
    name = ""
    for number, line in enumerate(lines):
        name = line[2:] if line.startswith("o ") else name
        if line.startswith("f ") and name in after:
            lines[number] = "f " + " ".join(str(int(word) - removed) for word in line.split()[1:])
    scene = folder / "small.obj"
    scene.write_text("\n".join(lines) + "\n")
    for _ in run_bake(BakeRequest(scene, folder / "result", OPTIONS)):
        pass
    return folder / "result"


@pytest.fixture
def comparison(shown: Window, qtbot: QtBot, other_folder: Path) -> ComparisonPart:
    """The window, comparing."""
    part = shown.bench.part(ComparisonPart)
    part.open(other_folder)
    qtbot.waitUntil(lambda: part.compared is not None, timeout=PATIENCE_MS)
    return part


def test_a_comparison_begins_side_by_side(shown: Window, comparison: ComparisonPart) -> None:
    """Both results stand side by side; what the other has not is not due a value there, and is counted."""
    other, compared = shown.document.other, comparison.compared
    assert shown.area.other is not None and other is not None and compared is not None
    assert "This" in shown.area.main.caption.text() and "Other" in shown.area.other.caption.text()
    assert "4 of 5 objects match, 1 only here" in compared.other.match.summary
    world = compared.wanted.result.world
    crate = next(index for index, path in enumerate(world.object_paths) if "Crate" in path)
    assert np.isnan(other.ao[world.first_vertex[crate] : world.first_vertex[crate + 1]]).all()
    assert comparison.panel.table.columns.rowCount() == 5


def test_the_table_counts_what_changed(shown: Window, comparison: ComparisonPart, qtbot: QtBot) -> None:
    """Numbers of a row are those of the vertices of its object; a click selects it and flies there."""
    compared, document = comparison.compared, shown.document
    assert compared is not None and document.field is not None and document.other is not None
    world, changes = compared.wanted.result.world, compared.changes
    ground = next(index for index, path in enumerate(world.object_paths) if "Ground" in path)
    span = slice(world.first_vertex[ground], world.first_vertex[ground + 1])
    column = compared.wanted.column
    difference = (document.field.ao[span, column] - document.other.ao[span, column]).astype(np.float64)
    difference = difference[np.isfinite(difference)]
    assert changes.largest[ground] == pytest.approx(np.abs(difference).max())
    assert changes.mean[ground] == pytest.approx(difference.mean(), abs=1e-6)
    assert changes.largest[ground] > 0.05
    before = shown.area.main.camera
    table = comparison.panel.table
    table.selectRow(table.columns.table_row(ground))
    assert document.selected == ground
    qtbot.waitUntil(lambda: shown.area.main.camera != before, timeout=PATIENCE_MS)


def test_modes_and_flicker(shown: Window, comparison: ComparisonPart) -> None:
    """Wipe draws both up to the line, difference is signed, flicker shows the other alone, end shows this alone."""
    registry, document = shown.bench.registry, shown.document
    registry["compare-wipe"].trigger()
    assert shown.area.other is None and comparison.layer is not None
    assert comparison.layer.line.isVisible() and comparison.layer.is_shown
    comparison.layer.line.moved.emit(0.25)
    assert comparison.layer.share == 0.25
    settle()
    registry["compare-difference"].trigger()
    assert document.display.quantity is Quantity.DIFFERENCE and not comparison.layer.is_shown
    field = document.shown()
    assert field is not None and field.color_map.diverging and field.missing_count == 0
    registry["compare-flip"].trigger()
    assert comparison.mode is CompareMode.ONE and comparison.layer.is_shown
    assert "Other" in shown.area.main.caption.text()
    assert not comparison.layer.line.isVisible()
    registry["compare-flip"].trigger()
    assert not comparison.layer.is_shown and "This" in shown.area.main.caption.text()
    registry["compare-end"].trigger()
    assert document.other is None and comparison.compared is None and comparison.layer is None
    assert not shown.area.main.caption.isVisible()


def test_wipe_draws_both(shown: Window, comparison: ComparisonPart) -> None:
    """Left of the line the picture is that of this result, right of it that of the other."""
    area, registry = shown.area, shown.bench.registry

    def picture() -> np.ndarray:
        settle()
        image = area.main.view.grabFramebuffer()
        pointer = image.constBits()
        assert pointer is not None
        data = np.frombuffer(pointer.asstring(image.sizeInBytes()), np.uint8)
        return data.reshape(image.height(), image.bytesPerLine())[:, : 4 * image.width()].reshape(
            image.height(), image.width(), 4
        )[..., :3]

    registry["compare-one"].trigger()
    this = picture()
    registry["compare-flip"].trigger()
    other = picture()
    registry["compare-wipe"].trigger()
    both = picture()
    middle = both.shape[1] // 2
    assert (this != other).any()
    assert np.array_equal(both[:, : middle - 2], this[:, : middle - 2])
    assert np.array_equal(both[:, middle + 2 :], other[:, middle + 2 :])


def test_the_other_mapping_takes_over(shown: Window, comparison: ComparisonPart, qtbot: QtBot) -> None:
    """Comparing mappings ends the comparison of results, and the other way round."""
    shown.bench.registry["compare"].trigger()
    assert comparison.compared is None
    qtbot.waitUntil(lambda: shown.document.other is not None, timeout=PATIENCE_MS)
    assert shown.document.other_name == ""
    shown.bench.registry["compare"].trigger()


def test_no_result_is_said(shown: Window, qtbot: QtBot, tmp_path: Path) -> None:
    """A folder that is no result is refused with the reason, and nothing is compared."""
    part = shown.bench.part(ComparisonPart)
    part.open(tmp_path)
    qtbot.waitUntil(lambda: bool(shown.banner.isVisible()), timeout=PATIENCE_MS)
    assert part.compared is None and not shown.bench.registry["compare-wipe"].isEnabled()


def test_runtime_preview(shown: Window, qtbot: QtBot) -> None:
    """AO dims the ambient light of the chosen hour; the values themselves stay."""
    from app.parts.runtime import RuntimePart

    document, panel = shown.document, shown.bench.part(RuntimePart).panel
    shown.bench.show_panel("Runtime")
    before = document.shown()
    shown.bench.registry["runtime"].trigger()
    panel.hour.setValue(18 * 12)
    assert document.display.hour == 18.0 and document.shown() is before and before is not None
    surface = shown.area.main.surface
    assert surface is not None
    assert np.array_equal(surface.colors, before.colors(ambient_map(18.0), 0.0, 1.0, shown.area.main.relief))
    panel.play.setChecked(True)
    qtbot.waitUntil(lambda: document.display.hour != 18.0, timeout=PATIENCE_MS)
    shown.bench.registry["runtime"].trigger()
    assert document.display.hour is None and not panel.play.isChecked()
