"""The regions in view: as baked or made again, what of them is shown, and which points were switched by hand."""

from __future__ import annotations

import enum

import numpy as np

from app.document import Document
from app.events import Event
from app.region_models import pending_bits, reachable_bits
from bake.region_types import Regions
from bake.regions.packed import INDEX_BYTES, MODEL_BYTES
from bake.settings import BakeSettings
from bake.types import BoolArray
from viewer.region_view import RegionView


class Tool(enum.Enum):
    """What the mouse does in the view besides moving the camera."""

    NONE = "none"
    PROBE = "probe"
    """A click places the probe."""
    BRUSH = "brush"
    """A drag switches grid points."""
    PATH = "path"
    """A click adds a point to the path of a walk."""


class RegionState:
    """State of one window's regions. Setters emit the event of what they changed, after the change.

    Attributes:
        document: What is open.
        baked: The regions of the result in view; None if it has none.
        regions: Those in view: the baked ones, or models made again without tracing.
        settings: With which the models in view are made; None without regions.
        bits: Validity of every grid point as switched by hand, shape (r · 512,), bool; None without regions.
        pending: Points that are switched on but wait for the next bake to be traced, shape (r · 512,), bool.
        energies: Energy before and after each sweep of the regularisation in view; empty as baked.
        view: What of it is shown.
        tool: What the mouse does in the view.
        brush_on: Whether the brush switches points on, rather than off.
        brush_radius: Metres around the point under the cursor.
        version: Grows whenever `regions` or `bits` change: what was drawn of an earlier one is out of date.
    """

    def __init__(self, document: Document) -> None:
        self.document = document
        self.baked: Regions | None = None
        self.regions: Regions | None = None
        self.settings: BakeSettings | None = None
        self.bits: BoolArray | None = None
        self._baked_bits: BoolArray | None = None
        self.pending: BoolArray | None = None
        self.energies = np.zeros(0)
        self.view = RegionView()
        self.tool = Tool.NONE
        self.brush_on = False
        self.brush_radius = 0.3
        self.version = 0

        self.opened: Event[[]] = Event()
        """Other regions, or none, are in view."""
        self.regions_changed: Event[[]] = Event()
        """The same regions have other models or points."""
        self.settings_changed: Event[[]] = Event()
        """The models are wanted with other settings."""
        self.bits_changed: Event[[]] = Event()
        """Points were switched."""
        self.view_changed: Event[[]] = Event()
        self.tool_changed: Event[[]] = Event()
        document.result_changed.connect(self._on_result)
        document.opened.connect(self._on_result)
        self._on_result()

    def events(self) -> tuple[Event[[]], ...]:
        """All events."""
        return (
            self.opened, self.regions_changed, self.settings_changed, self.bits_changed, self.view_changed,
            self.tool_changed,
        )  # fmt: skip

    def close(self) -> None:
        """Stops following the document."""
        for event in (self.document.result_changed, self.document.opened):
            event.disconnect(self._on_result)
        for event in self.events():
            event.clear()

    @property
    def is_edited(self) -> bool:
        """Whether points were switched since the bake."""
        return self.baked is not None and self.bits is not None and self.bits is not self._baked_bits

    @property
    def is_preview(self) -> bool:
        """Whether the models in view are not the stored ones."""
        return self.regions is not self.baked

    @property
    def region_bytes(self) -> np.ndarray:
        """Memory that each region takes in an engine, shape (r,), int64; an absorbed one needs no model of its own."""
        regions = self.regions
        if regions is None:
            return np.zeros(0, np.int64)
        own = np.asarray(regions.owner) == np.arange(len(regions.graph))
        return np.where(own, MODEL_BYTES + INDEX_BYTES, INDEX_BYTES)

    def set_view(self, view: RegionView) -> None:
        """Changes what is shown."""
        if view != self.view:
            self.view = view
            self.view_changed.emit()

    def set_settings(self, settings: BakeSettings) -> None:
        """Asks for models made with other settings; they follow by `set_regions`."""
        if settings != self.settings:
            self.settings = settings
            self.settings_changed.emit()

    def set_bits(self, bits: BoolArray) -> None:
        """Switches grid points; the models follow by `set_regions`."""
        if self.baked is None or self._baked_bits is None:
            return
        self.bits = self._baked_bits if np.array_equal(bits, self._baked_bits) else bits
        self.pending = pending_bits(self.baked, self.bits)
        self.version += 1
        self.bits_changed.emit()

    def set_regions(self, regions: Regions, energies: np.ndarray) -> None:
        """Shows the same regions with other models."""
        self.regions, self.energies = regions, energies
        self.version += 1
        self.regions_changed.emit()

    def set_tool(self, tool: Tool) -> None:
        """Changes what the mouse does in the view."""
        if tool is not self.tool:
            self.tool = tool
            self.tool_changed.emit()

    def use_tool(self, tool: Tool, on: bool) -> None:
        """Takes a tool up, or puts it away if it is the one in use."""
        if on:
            self.set_tool(tool)
        elif self.tool is tool:
            self.set_tool(Tool.NONE)

    def set_brush(self, *, on: bool | None = None, radius: float | None = None) -> None:
        """Changes which way the brush switches, or how much of a region it covers."""
        self.brush_on = self.brush_on if on is None else on
        self.brush_radius = self.brush_radius if radius is None else radius
        self.tool_changed.emit()

    def _on_result(self) -> None:
        result = self.document.result
        regions = None if result is None else result.regions
        if regions is None and self.baked is None:
            return
        if regions is not None and regions is self.baked:
            return
        kept = self.view
        same = regions is not None and self.baked is not None and regions.graph.names == self.baked.graph.names
        self.baked = self.regions = regions
        self.settings = None if result is None or regions is None else result.settings
        self._baked_bits = None if regions is None else reachable_bits(regions)
        self.bits, self.pending = self._baked_bits, None
        if regions is not None and self._baked_bits is not None:
            self.pending = pending_bits(regions, self._baked_bits)
        self.energies = np.zeros(0)
        columns = 1 if result is None else result.settings.distance_count
        self.view = kept.replaced(column=min(kept.column, columns - 1))
        if not same:
            self.view = self.view.replaced(region=-1, link=-1, probe=None, probe_region=-1)
        self.set_tool(Tool.NONE)
        self.version += 1
        self.opened.emit()
