"""The middle of the window: one viewport, or two side by side on one camera; below them a tree's models or LODs."""

from __future__ import annotations

from PyQt6.QtCore import Qt
from PyQt6.QtGui import QImage, QPainter
from PyQt6.QtWidgets import QSplitter, QVBoxLayout, QWidget

from app.document import Document
from app.jobs import Jobs
from app.lazy_picker import LazyPicker
from app.lod_compare import LodCompare
from app.navigation_styles import NavigationStyle
from app.side_by_side import SideBySide
from app.tree_compare import TreeCompare
from app.viewport import Viewport
from viewer.camera import Camera


class ViewArea(QWidget):
    """Owns the viewports. The second one exists only while two things are compared."""

    def __init__(self, picker: LazyPicker, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._picker = picker
        self._splitter = QSplitter(Qt.Orientation.Horizontal)
        self._splitter.setChildrenCollapsible(False)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        self._rows = QSplitter(Qt.Orientation.Vertical)
        self._rows.setChildrenCollapsible(False)
        self._rows.addWidget(self._splitter)
        layout.addWidget(self._rows)
        self.main = Viewport(picker)
        self.other: Viewport | None = None
        self.below: SideBySide | None = None
        self._splitter.addWidget(self.main)
        self.main.camera_changed.connect(self._follow_main)

    @property
    def viewports(self) -> list[Viewport]:
        """The viewports from left to right."""
        return [self.main] if self.other is None else [self.main, self.other]

    def set_style(self, style: NavigationStyle) -> None:
        """Changes what mouse buttons do."""
        for viewport in self.viewports:
            viewport.navigation.style = style

    def split(self) -> Viewport:
        """Opens the second viewport with the first one's camera; returns it."""
        if self.other is None:
            self.other = Viewport(self._picker)
            self.other.navigation.style = self.main.navigation.style
            self.other.camera_changed.connect(self._follow_other)
            self._splitter.addWidget(self.other)
            half = max(self._splitter.width() // 2, 1)
            self._splitter.setSizes([half, half])
            self.other.set_camera(self.main.camera)
        return self.other

    def unsplit(self) -> None:
        """Closes the second viewport."""
        if self.other is not None:
            self.other.close_view()
            self.other.setParent(None)
            self.other.deleteLater()
            self.other = None

    @property
    def trees(self) -> TreeCompare | None:
        """The comparison of tree models; None while it is not open."""
        return self.below if isinstance(self.below, TreeCompare) else None

    @property
    def lods(self) -> LodCompare | None:
        """The comparison of levels of detail; None while it is not open."""
        return self.below if isinstance(self.below, LodCompare) else None

    def compare_trees(self, document: Document) -> SideBySide:
        """Opens the comparison of tree models below the viewports; returns it."""
        return self._show_below(TreeCompare(document, self.main.camera))

    def compare_lods(self, document: Document, jobs: Jobs) -> SideBySide:
        """Opens the comparison of levels of detail below the viewports; returns it."""
        return self._show_below(LodCompare(document, self.main.camera, jobs))

    def _show_below(self, widget: SideBySide) -> SideBySide:
        self.close_below()
        self.below = widget
        self._rows.addWidget(widget)
        height = max(self._rows.height(), 2)
        self._rows.setSizes([height * 55 // 100, height * 45 // 100])
        return widget

    def close_below(self) -> None:
        """Closes what is open below the viewports."""
        if self.below is not None:
            self.below.close_view()
            self.below.setParent(None)
            self.below.deleteLater()
            self.below = None

    def picture(self) -> QImage:
        """All viewports as drawn, side by side."""
        pictures = [viewport.picture() for viewport in self.viewports]
        if len(pictures) == 1:
            return pictures[0]
        gap = 2
        width = sum(picture.width() for picture in pictures) + gap * (len(pictures) - 1)
        image = QImage(width, max(picture.height() for picture in pictures), QImage.Format.Format_RGB32)
        image.fill(Qt.GlobalColor.black)
        painter = QPainter(image)
        x = 0
        for picture in pictures:
            ratio = picture.devicePixelRatio()
            picture.setDevicePixelRatio(1.0)
            painter.drawImage(x, 0, picture)
            x += picture.width() + gap
            picture.setDevicePixelRatio(ratio)
        painter.end()
        return image

    def close_views(self) -> None:
        """Frees VTK's side of all viewports; must precede the end of the window."""
        self.close_below()
        self.unsplit()
        self.main.close_view()

    def _follow_main(self, camera: Camera) -> None:
        if self.other is not None:
            self.other.set_camera(camera)

    def _follow_other(self, camera: Camera) -> None:
        self.main.set_camera(camera)
