"""Questions to the user that need a dialog."""

from __future__ import annotations

from pathlib import Path

from PyQt6.QtCore import Qt
from PyQt6.QtWidgets import QDialog, QFileDialog, QMessageBox, QWidget

from bake import __version__

EXPORT_FORMATS = {
    ".glb": "glTF with AO at its vertices",
    ".npz": "All numbers for NumPy",
    ".ply": "PLY with AO at its vertices",
    ".obj": "OBJ with AO as grey",
    ".vao": "Raw AO of the vertices",
}
"""Titles by suffix."""
SCENE_FILTER = "Scenes (*.glb *.gltf *.obj *.ply);;All files (*)"


def ask_for_scene(parent: QWidget, start: Path) -> Path | None:
    """A scene file to open."""
    name, _ = QFileDialog.getOpenFileName(parent, "Open scene", str(start), SCENE_FILTER)
    return Path(name) if name else None


def ask_for_result(parent: QWidget, start: Path) -> Path | None:
    """A result folder to open."""
    name = QFileDialog.getExistingDirectory(parent, "Open result folder", str(start))
    return Path(name) if name else None


def ask_where_to_save(parent: QWidget, suggestion: Path) -> Path | None:
    """A folder, yet to be made, for a copy of the result."""
    name, _ = QFileDialog.getSaveFileName(parent, "Save result as a new folder", str(suggestion))
    return Path(name) if name else None


def ask_for_picture(parent: QWidget, suggestion: Path) -> Path | None:
    """A PNG file for the view."""
    name, _ = QFileDialog.getSaveFileName(parent, "Save picture", str(suggestion), "PNG (*.png)")
    if not name:
        return None
    path = Path(name)
    return path if path.suffix else path.with_suffix(".png")


def ask_for_export(parent: QWidget, suggestion: Path) -> Path | None:
    """A file to export to; its suffix decides the format."""
    filters = ";;".join(f"{title} (*{suffix})" for suffix, title in EXPORT_FORMATS.items())
    name, chosen = QFileDialog.getSaveFileName(parent, "Export", str(suggestion), filters)
    if not name:
        return None
    path = Path(name)
    known = next((suffix for suffix, title in EXPORT_FORMATS.items() if chosen.startswith(title)), ".glb")
    return path if path.suffix else path.with_suffix(known)


def ask_for_page(parent: QWidget, suggestion: Path) -> Path | None:
    """An HTML file for a page."""
    name, _ = QFileDialog.getSaveFileName(parent, "Save review page", str(suggestion), "Pages (*.html)")
    if not name:
        return None
    path = Path(name)
    return path if path.suffix else path.with_suffix(".html")


def may_drop_bake(parent: QWidget, minutes: float) -> bool:
    """Whether a bake that runs for a while may be thrown away."""
    answer = QMessageBox.question(
        parent,
        "A bake is running",
        f"The bake has been running for {minutes:.0f} min. Quit and lose it?\nStored results stay as they are.",
        QMessageBox.StandardButton.Discard | QMessageBox.StandardButton.Cancel,
        QMessageBox.StandardButton.Cancel,
    )
    return answer == QMessageBox.StandardButton.Discard


def show_keys(parent: QWidget, text: str) -> None:
    """What keys and mouse do, as rich text; stays open beside the work."""
    _show(parent, "Keys and mouse", text)


def show_about(parent: QWidget) -> None:
    """Version and licence."""
    text = (
        f"<h3>Obscura {__version__}</h3><p>Bakes ambient obscurance for game levels and explains every value.</p>"
        "<p>Free software under the GNU General Public License, version 3.</p>"
    )
    _show(parent, "About Obscura", text)


def _show(parent: QWidget, title: str, text: str) -> None:
    box = QMessageBox(QMessageBox.Icon.NoIcon, title, text, QMessageBox.StandardButton.Close, parent)
    box.setModal(False)
    box.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
    box.show()


def show_dialog(dialog: QDialog) -> None:
    """Shows a dialog that takes the input of its window until it is closed, without waiting for it here."""
    dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
    dialog.open()
