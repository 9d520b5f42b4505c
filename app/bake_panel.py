"""The bake's settings with its buttons; says what is wrong before anything starts."""

from __future__ import annotations

from pathlib import Path

from PyQt6.QtCore import Qt, pyqtSignal
from PyQt6.QtWidgets import QApplication, QFrame, QHBoxLayout, QLabel, QPushButton, QScrollArea, QVBoxLayout, QWidget

from app.command import bake_command
from app.document import Document
from app.elided_label import ElidedLabel
from app.settings_form import SettingsForm
from bake.errors import SettingsError
from bake.settings import BakeSettings


class BakePanel(QWidget):
    """Asks for a bake with the settings of its form."""

    bake_requested = pyqtSignal(object)  # BakeSettings
    cancel_requested = pyqtSignal()
    command_copied = pyqtSignal(str)

    def __init__(self, document: Document, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._document = document
        self._baking = False
        self.form = SettingsForm()
        self.form.changed.connect(self.refresh)
        scroll = QScrollArea()
        scroll.setWidgetResizable(True)
        scroll.setFrameShape(QFrame.Shape.NoFrame)
        scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        inner = QWidget()
        padding = QVBoxLayout(inner)
        padding.setContentsMargins(6, 6, 10, 6)
        padding.addWidget(self.form)
        scroll.setWidget(inner)
        self._message = QLabel()
        self._message.setWordWrap(True)
        self._target = ElidedLabel(mode=Qt.TextElideMode.ElideMiddle)
        self._bake = QPushButton("Bake")
        self._bake.setDefault(True)
        self._bake.setToolTip("Bake the scene with these settings (Ctrl+B)")
        self._bake.clicked.connect(self.request_bake)
        self._cancel = QPushButton("Cancel")
        self._cancel.setToolTip("Stop the bake; the stored result stays as it was (Esc)")
        self._cancel.clicked.connect(self.cancel_requested)
        self._copy = QPushButton("Copy as command")
        self._copy.setToolTip("The command line that does the same bake, for scripts and other machines")
        self._copy.clicked.connect(self.copy_command)
        buttons = QHBoxLayout()
        buttons.addWidget(self._bake, 1)
        buttons.addWidget(self._cancel)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 4)
        layout.addWidget(scroll, 1)
        bottom = QVBoxLayout()
        bottom.setContentsMargins(6, 0, 6, 2)
        bottom.addWidget(self._message)
        bottom.addWidget(self._target)
        bottom.addLayout(buttons)
        bottom.addWidget(self._copy)
        layout.addLayout(bottom)
        document.opened.connect(self._on_opened)
        document.result_changed.connect(self._on_result)
        self.refresh()

    def set_baking(self, baking: bool) -> None:
        """Bake and Cancel take turns."""
        self._baking = baking
        self.refresh()

    def settings(self) -> BakeSettings | None:
        """The settings as edited; None where they are not valid."""
        try:
            return self.form.settings()
        except SettingsError:
            return None

    def request_bake(self) -> None:
        """Asks for a bake, unless something is missing."""
        settings = self.settings()
        if settings is not None and self._bake.isEnabled():
            self.bake_requested.emit(settings)

    def copy_command(self) -> None:
        """Puts the equivalent command line on the clipboard."""
        settings, document = self.settings(), self._document
        clipboard = QApplication.clipboard()
        if settings is None or document.scene_path is None or document.result_path is None or clipboard is None:
            return
        text = bake_command(document.scene_path, document.result_path, settings, document.side_file_settings)
        clipboard.setText(text)
        self.command_copied.emit(text)

    def set_threshold(self, threshold: float) -> None:
        """Takes over a back-face threshold."""
        self.form.editor("back_face_threshold").set_value(threshold)
        self.refresh()

    def refresh(self) -> None:
        """Follows the form and the document."""
        document = self._document
        error = self.form.validate()
        usable = error is None and document.scene_path is not None
        self._bake.setEnabled(usable and not self._baking)
        self._cancel.setEnabled(self._baking)
        self._copy.setEnabled(usable)
        self._bake.setText("Bake" if document.result is None else "Bake again")
        self._message.setText(self._status(error))
        self._message.setVisible(bool(self._message.text()))
        self._message.setObjectName("fieldError" if error is not None else "hint")
        _polish(self._message)
        self._show_target(document.result_path)

    def _status(self, error: SettingsError | None) -> str:
        if error is not None:
            return str(error)
        result, settings = self._document.result, self.settings()
        if self._document.scene_path is None:
            return "Open a scene to bake it."
        if result is None or settings is None:
            return ""
        own, wanted = result.settings.to_json(), settings.to_json()
        differing = [option for option, value in wanted.items() if own.get(option) != value]
        if not differing:
            return ""
        return (
            f"The result in view was baked with another {', '.join(option.replace('-', ' ') for option in differing)}."
        )

    def _show_target(self, path: Path | None) -> None:
        self._target.setVisible(path is not None)
        if path is not None:
            self._target.setText(f"→ {path}")
            self._target.setToolTip(f"The result goes to {path}")

    def _on_opened(self) -> None:
        self.form.set_settings(self._document.scene_settings)
        self.refresh()

    def _on_result(self) -> None:
        if self._document.result is not None:
            self.form.set_settings(self._document.result.settings)
        self.refresh()


def _polish(widget: QWidget) -> None:
    """Applies the style sheet again after the object name changed."""
    style = widget.style()
    if style is not None:
        style.unpolish(widget)
        style.polish(widget)
