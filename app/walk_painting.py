"""Paints a walk over time: curves of AO and of steps, regions, pops and the axis of time."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from PyQt6.QtCore import QPointF, QRectF, Qt
from PyQt6.QtGui import QColor, QPainter, QPalette, QPen, QPolygonF

from app.walk_state import WalkView
from bake.types import Float32Array, Float64Array
from bake.walk import STEP_BOUND, Pop, Variant, Walk
from viewer.walk_curves import COLORS, Curve, ao_curve, ao_range, step_curve
from viewer.walk_rows import facing

LEFT, RIGHT, TOP, BOTTOM, _GAP = 60, 10, 14, 20, 6
_STEPS_SHARE = 0.36
_STEPS_FROM = 130  # pixels of height below which there is no room for the steps
_LEAST_STEP, _LARGEST_STEP = 1e-5, 1.0
_MOST_POPS = 400
"""Pops marked at most, those of most codes."""
_ORDER = (
    Variant.TRUTH, Variant.RAW, Variant.REGULARISED, Variant.BLENDED, Variant.SPATIAL, Variant.SPATIAL_BLENDED,
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class PlotLayout:
    """Where things are in a plot of a size in pixels.

    Attributes:
        width, height: Of the whole.
        begin, end: Time at the plot's left and right edge, s.
    """

    width: int
    height: int
    begin: float
    end: float

    @property
    def upper(self) -> QRectF:
        """The plot of AO."""
        height = float(self.height - TOP - BOTTOM)
        if self.height >= _STEPS_FROM:
            height = height * (1.0 - _STEPS_SHARE) - _GAP
        return QRectF(LEFT, TOP, self.width - LEFT - RIGHT, max(height, 1.0))

    @property
    def lower(self) -> QRectF:
        """The plot of steps; empty where there is no room for it."""
        if self.height < _STEPS_FROM:
            return QRectF()
        top = self.upper.bottom() + _GAP
        return QRectF(LEFT, top, self.width - LEFT - RIGHT, self.height - BOTTOM - top)

    def x(self, time: float) -> float:
        """Where a time is."""
        return LEFT + (time - self.begin) / (self.end - self.begin) * (self.width - LEFT - RIGHT)

    def time(self, x: float) -> float:
        """The time at a place."""
        return self.begin + (x - LEFT) / max(self.width - LEFT - RIGHT, 1) * (self.end - self.begin)


class WalkPainter:
    """Paints one walk; keeps what does not depend on the span.

    Args:
        walk: What is painted.
        steps: What `largest_steps` gives of each variant.
    """

    def __init__(self, walk: Walk, steps: Mapping[Variant, Float32Array]) -> None:
        self._walk, self._steps = walk, steps

    def paint(
        self, painter: QPainter, layout: PlotLayout, view: WalkView, pops: Sequence[Pop], palette: QPalette
    ) -> None:
        """Paints everything but the moment in view."""
        walk, upper, lower = self._walk, layout.upper, layout.lower
        for plot in (upper, lower):
            painter.fillRect(plot, palette.color(QPalette.ColorRole.Base))
        self._paint_regions(painter, layout, palette)
        low, high = ao_range(walk, view.variants, view.normal, layout.begin, layout.end)
        shown = [variant for variant in _ORDER if variant in view.variants and variant in walk.ao]
        painter.save()
        painter.setClipRect(upper)
        for variant in shown:
            curve = ao_curve(walk, variant, view.normal, layout.begin, layout.end, int(upper.width()))
            _paint_curve(painter, curve, _pen(variant, palette), layout, upper, lambda v: (v - low) / (high - low))
        painter.restore()
        marks = ((f"{high:.2f}", upper.top() + 7), (f"{low:.2f}", upper.bottom() - 7))
        _paint_frame(painter, upper, marks, f"AO {facing(view.normal)}", palette)
        if not lower.isEmpty():
            self._paint_steps(painter, shown, layout, lower, palette)
        _paint_pops(painter, layout, pops)
        _paint_times(painter, layout, palette)

    def _paint_regions(self, painter: QPainter, layout: PlotLayout, palette: QPalette) -> None:
        """A faint line where the region changes; none where they would run together."""
        changes = self._walk.time[np.flatnonzero(np.diff(self._walk.region)) + 1]
        changes = changes[(changes >= layout.begin) & (changes <= layout.end)]
        if len(changes) > layout.upper.width() / 4:
            return
        painter.setPen(QPen(palette.color(QPalette.ColorRole.Mid), 1, Qt.PenStyle.DotLine))
        for time in changes.tolist():
            for plot in (layout.upper, layout.lower):
                painter.drawLine(QPointF(layout.x(time), plot.top()), QPointF(layout.x(time), plot.bottom()))

    def _paint_steps(
        self, painter: QPainter, shown: Sequence[Variant], layout: PlotLayout, plot: QRectF, palette: QPalette
    ) -> None:
        def at(value: float) -> float:
            return plot.bottom() - float(_log_share(np.array(value))) * plot.height()

        painter.save()
        painter.setClipRect(plot)
        painter.setPen(QPen(palette.color(QPalette.ColorRole.WindowText), 1, Qt.PenStyle.DashLine))
        painter.drawLine(QPointF(plot.left(), at(STEP_BOUND)), QPointF(plot.right(), at(STEP_BOUND)))
        for variant in shown:
            if variant is Variant.TRUTH:
                continue  # what it steps by is mostly the noise of its rays
            curve = step_curve(self._walk, self._steps[variant], layout.begin, layout.end, int(plot.width()))
            _paint_curve(painter, curve, _pen(variant, palette), layout, plot, _log_share)
        painter.restore()
        _paint_frame(painter, plot, (("0.1", at(1e-1)), ("0.001", at(1e-3))), "step", palette)


def variant_color(variant: Variant, palette: QPalette) -> QColor:
    """The colour of a variant; the truth has that of text."""
    if variant is Variant.TRUTH:
        return QColor(palette.color(QPalette.ColorRole.WindowText))
    return QColor(*COLORS[variant])


def _pen(variant: Variant, palette: QPalette) -> QPen:
    color = variant_color(variant, palette)
    if variant is Variant.TRUTH:
        color.setAlpha(110)
        return QPen(color, 3.0)
    return QPen(color, 1.3)


def _paint_curve(
    painter: QPainter,
    curve: Curve,
    pen: QPen,
    layout: PlotLayout,
    plot: QRectF,
    share: Callable[[Float64Array], Float64Array],
) -> None:
    painter.setPen(pen)
    for piece in curve.pieces:
        xs = plot.left() + (piece[:, 0] - layout.begin) / (layout.end - layout.begin) * plot.width()
        ys = plot.bottom() - share(piece[:, 1]) * plot.height()
        painter.drawPolyline(QPolygonF([QPointF(x, y) for x, y in zip(xs.tolist(), ys.tolist(), strict=True)]))


def _paint_frame(
    painter: QPainter, plot: QRectF, marks: Sequence[tuple[str, float]], label: str, palette: QPalette
) -> None:
    painter.setPen(palette.color(QPalette.ColorRole.WindowText))
    for text, y in marks:
        box = QRectF(16, y - 8, LEFT - 20, 16)
        painter.drawText(box, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter, text)
    painter.save()
    painter.translate(8, plot.center().y())
    painter.rotate(-90)
    painter.drawText(QRectF(-60, -8, 120, 16), Qt.AlignmentFlag.AlignCenter, label)
    painter.restore()
    painter.setPen(QPen(palette.color(QPalette.ColorRole.Mid), 1))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawRect(plot)


def _paint_pops(painter: QPainter, layout: PlotLayout, pops: Sequence[Pop]) -> None:
    """A triangle above the curves for each pop, in its variant's colour, larger where it jumps more."""
    painter.setPen(Qt.PenStyle.NoPen)
    in_view = [pop for pop in pops if layout.begin <= pop.time <= layout.end]
    for pop in reversed(in_view[:_MOST_POPS]):
        x, size = layout.x(pop.time), 3.0 + 0.5 * min(math.log2(max(pop.codes, 1.0)), 5.0)
        top = TOP - 1 - 1.8 * size
        painter.setBrush(QColor(*COLORS[pop.variant]))
        painter.drawPolygon(QPolygonF([QPointF(x, TOP - 1), QPointF(x - size, top), QPointF(x + size, top)]))


def _paint_times(painter: QPainter, layout: PlotLayout, palette: QPalette) -> None:
    step = _round_step((layout.end - layout.begin) / max(layout.upper.width() / 70.0, 1.0))
    decimals = max(0, -math.floor(math.log10(step)))
    bottom = layout.height - BOTTOM
    painter.setPen(palette.color(QPalette.ColorRole.WindowText))
    for number in range(math.ceil(layout.begin / step), math.floor(layout.end / step) + 1):
        x = layout.x(number * step)
        painter.drawLine(QPointF(x, bottom), QPointF(x, bottom + 3))
        text = f"{number * step:.{decimals}f} s"
        painter.drawText(QRectF(x - 30, bottom + 3, 60, 16), Qt.AlignmentFlag.AlignHCenter, text)


def _log_share(value: Float64Array) -> Float64Array:
    """Where steps stand on the logarithmic axis, 0 to 1."""
    clipped = np.clip(value, _LEAST_STEP, _LARGEST_STEP)
    return np.log(clipped / _LEAST_STEP) / math.log(_LARGEST_STEP / _LEAST_STEP)


def _round_step(least: float) -> float:
    """The next of 1, 2, 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(max(least, 1e-6)))
    return next(power * factor for factor in (1.0, 2.0, 5.0, 10.0) if power * factor >= least * (1.0 - 1e-9))
