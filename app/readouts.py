"""From a picked point to the strip and the probe: looked up again whenever what is shown changes."""

from __future__ import annotations

from app.document import Document
from app.probe_strip import ProbeStrip
from app.viewport import Viewport
from viewer.picking import Pick
from viewer.probe import Readout, read_out


class Readouts:
    """Keeps the readouts of the hovered and the clicked point exact.

    Args:
        document: Where the values come from.
        strip: Shows the hovered point.
    """

    def __init__(self, document: Document, strip: ProbeStrip) -> None:
        self._document, self._strip = document, strip
        self._hovered: Pick | None = None
        self._pinned: Pick | None = None
        for event in (
            document.field_changed,
            document.display_changed,
            document.threshold_changed,
            document.decorators_changed,
        ):
            event.connect(self._refresh)
        document.world_changed.connect(self._forget)
        document.pinned_changed.connect(self._on_pinned)

    @property
    def pinned(self) -> Pick | None:
        """The clicked point."""
        return self._pinned

    def follow(self, viewport: Viewport) -> None:
        """Reads points from a viewport too."""
        viewport.hovered.connect(self.hover)
        viewport.clicked.connect(self.click)

    def hover(self, pick: Pick | None) -> None:
        """Shows the point under the cursor."""
        self._hovered = pick
        self._strip.set_readout(self._read(pick))

    def click(self, pick: Pick | None) -> None:
        """Keeps a point and selects its object; a click on the background lets go of both."""
        document = self._document
        self._pinned = pick
        if pick is None or document.world is None:
            document.select(-1)
            document.pin(None)
        else:
            document.select(int(document.world.face_object[pick.face]))
            document.pin(self._read(pick))

    def _read(self, pick: Pick | None) -> Readout | None:
        document = self._document
        if pick is None or document.world is None:
            return None
        return read_out(
            document.world,
            pick,
            document.result,
            field=None if document.field is None else document.drawn(document.field),
            threshold=document.threshold,
            short_share=document.display.short_share,
            curve=document.display.curve,
            values=document.values,
            view=document.decorators,
        )

    def _refresh(self) -> None:
        self._strip.set_readout(self._read(self._hovered))
        if self._pinned is not None:
            self._document.pin(self._read(self._pinned))

    def _forget(self) -> None:
        self._hovered = self._pinned = None
        self._strip.set_readout(None)
        self._document.pin(None)

    def _on_pinned(self) -> None:
        if self._document.pinned is None:
            self._pinned = None
