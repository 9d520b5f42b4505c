"""Boxes in the view around what has changed since the bake."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from app.document import Document
from app.outliner_delegate import STALE_COLOR
from app.viewport import Viewport
from viewer.fog_view import box_corners, box_edges

_NAME = "stale"
MOST = 2000
"""Boxes that are drawn; after more, everything has changed and boxes say nothing."""


_MARGIN = 0.012
"""How much wider they are than what they are around, so that the box of what is selected is seen as well."""


class StaleMarks:
    """Follows a document.

    Args:
        document: Says which objects are stale or new.
        viewports: Where to draw.
    """

    def __init__(self, document: Document, viewports: Callable[[], Sequence[Viewport]]) -> None:
        self._document, self._viewports = document, viewports
        self._shown = True
        for event in (document.current_changed, document.world_changed, document.geometry_changed):
            event.connect(self.draw)

    def set_shown(self, shown: bool) -> None:
        """Draws them or not."""
        self._shown = shown
        self.draw()

    def boxes(self) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        """Corners of the boxes around stale and new objects, shape (k, 2, 3), metres from the world's origin."""
        current, world = self._document.current, self._document.world
        if current is None or world is None or self._document.result is None:
            return np.zeros((0, 2, 3))
        wanted = (current.stale | current.new) - current.gone
        if not wanted:
            return np.zeros((0, 2, 3))
        absent = self._document.absent()
        paths = enumerate(world.object_paths)
        return self._document.object_boxes(index for index, path in paths if path in wanted and not absent[index])[
            :MOST
        ]

    def draw(self) -> None:
        """Draws what is stale now."""
        boxes = self.boxes() if self._shown else np.zeros((0, 2, 3))
        shapes = None
        if len(boxes):
            margin = _MARGIN * (boxes[:, 1] - boxes[:, 0]).max(axis=1, keepdims=True)
            corners = box_corners(boxes[:, 0] - margin, boxes[:, 1] + margin)
            color = np.array(STALE_COLOR.getRgb()[:3], np.uint8)
            shapes = (corners, box_edges(len(boxes)), np.tile(color, (len(corners), 1)))
        for viewport in self._viewports():
            viewport.set_shapes(_NAME, shapes, width=1.0)
