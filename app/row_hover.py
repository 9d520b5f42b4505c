"""Which row of a table the cursor rests on."""

# pyright: reportIncompatibleMethodOverride=false
# (the stubs call every parameter of Qt's event handlers a0)

from __future__ import annotations

from PyQt6.QtCore import QEvent, QModelIndex, QObject, QTimer, pyqtSignal

from app.tables import RowsView

REST_MS = 120
"""A row that is only crossed is not meant."""


class RowHover(QObject):
    """Tells once the cursor rests on another row, or has left.

    Args:
        view: The table; it is the parent as well.
    """

    rested = pyqtSignal(int)
    """Row in source order, -1 for none."""

    def __init__(self, view: RowsView) -> None:
        super().__init__(view)
        self._view, self._row, self._told = view, -1, -1
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(REST_MS)
        self._timer.timeout.connect(self._tell)
        view.setMouseTracking(True)
        view.entered.connect(self._on_entered)
        view.viewportEntered.connect(lambda: self._meant(-1))
        view.rows.modelReset.connect(self._on_reset)
        viewport = view.viewport()
        assert viewport is not None
        viewport.installEventFilter(self)

    def eventFilter(self, watched: QObject | None, event: QEvent | None) -> bool:
        """Notices that the cursor leaves."""
        if event is not None and event.type() is QEvent.Type.Leave:
            self._meant(-1)
        return False

    def _on_entered(self, index: QModelIndex) -> None:
        self._meant(self._view.proxy.mapToSource(index).row())

    def _on_reset(self) -> None:
        self._timer.stop()
        self._row = self._told = -1

    def _meant(self, row: int) -> None:
        self._row = row
        self._timer.start()

    def _tell(self) -> None:
        if self._row != self._told:
            self._told = self._row
            self.rested.emit(self._row)
