"""The few HTML and SVG pieces that the report is made of; every text that comes in is escaped."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape

from viewer.histogram import Histogram

STYLE = """
:root { color-scheme: light dark; --ink: #1d2530; --quiet: #66717f; --line: #dde2e8; --paper: #ffffff;
  --panel: #f5f7f9; --accent: #2f6fb0; --bad: #b3400a; }
@media (prefers-color-scheme: dark) { :root { --ink: #e4e8ed; --quiet: #95a0ae; --line: #333b46; --paper: #161a20;
  --panel: #1e242c; --accent: #6ea8df; --bad: #f09a5b; } }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 1180px; padding: 2.5rem 1.5rem 5rem; background: var(--paper); color: var(--ink);
  font: 15px/1.5 system-ui, "Segoe UI", "Helvetica Neue", Arial, sans-serif; }
h1 { font-size: 1.7rem; margin: 0; font-weight: 650; overflow-wrap: anywhere; }
h2 { font-size: 1.15rem; margin: 3rem 0 .8rem; font-weight: 650; }
p, figcaption, .quiet { color: var(--quiet); margin: .3rem 0; }
.tiles { display: grid; grid-template-columns: repeat(auto-fill, minmax(150px, 1fr)); gap: .7rem; margin-top: 1.6rem; }
.tile { background: var(--panel); border-radius: 8px; padding: .7rem .9rem; }
.tile b { display: block; font-size: 1.25rem; font-weight: 620; font-variant-numeric: tabular-nums; }
.pictures { display: grid; grid-template-columns: repeat(auto-fit, minmax(360px, 1fr)); gap: 1rem; }
figure { margin: 0; }
img { width: 100%; height: auto; border-radius: 6px; display: block; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th { text-align: left; font-weight: 600; color: var(--quiet); border-bottom: 1px solid var(--line); }
th, td { padding: .32rem .9rem .32rem 0; vertical-align: top; }
td { border-bottom: 1px solid var(--line); overflow-wrap: anywhere; }
td.number, th.number { text-align: right; white-space: nowrap; }
.bar { background: var(--accent); height: .6rem; border-radius: 2px; min-width: 1px; margin-top: .45rem; }
.bad { color: var(--bad); }
.hash { font: 12px ui-monospace, Consolas, monospace; }
svg { width: 100%; height: auto; background: var(--panel); border-radius: 6px; }
svg rect { fill: var(--accent); } svg text { fill: var(--quiet); font-size: 11px; }
details { margin-top: .6rem; } summary { cursor: pointer; color: var(--accent); }
"""

Cell = str | tuple[str, str]
"""Escaped HTML of a table cell, or that and its class."""


def page(title: str, body: Iterable[str]) -> str:
    """A whole page that refers to nothing outside itself."""
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n<title>{escape(title)}</title>\n'
        f"<style>{STYLE}</style>\n</head>\n<body>\n{chr(10).join(body)}\n</body>\n</html>\n"
    )


def table(headings: Sequence[str], rows: Iterable[Sequence[Cell]], *, numbers: Sequence[int] = ()) -> str:
    """A table; `numbers` are the columns that are aligned right."""
    head = "".join(
        f"<th{_class('number' if i in numbers else '')}>{escape(text)}</th>" for i, text in enumerate(headings)
    )
    lines: list[str] = []
    for row in rows:
        cells: list[str] = []
        for i, cell in enumerate(row):
            content, kind = (cell, "") if isinstance(cell, str) else cell
            cells.append(
                f"<td{_class(' '.join(filter(None, ['number' if i in numbers else '', kind])))}>{content}</td>"
            )
        lines.append(f"<tr>{''.join(cells)}</tr>")
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{"".join(lines)}</tbody></table></div>'


def tiles(items: Iterable[tuple[str, str]]) -> str:
    """Key figures: pairs of value and what it is."""
    boxes = (
        f'<div class="tile"><b>{escape(value)}</b><span class="quiet">{escape(name)}</span></div>'
        for value, name in items
    )
    return f'<div class="tiles">{"".join(boxes)}</div>'


def picture(jpeg: bytes, caption: str) -> str:
    """An embedded picture."""
    data = base64.b64encode(jpeg).decode()
    text = escape(caption)
    return f'<figure><img src="data:image/jpeg;base64,{data}" alt="{text}"><figcaption>{text}</figcaption></figure>'


def bar(share: float) -> str:
    """A bar whose length is a share of its cell."""
    return f'<div class="bar" style="width:{100 * min(max(share, 0.0), 1.0):.1f}%"></div>'


def histogram_svg(histogram: Histogram, caption: str) -> str:
    """A histogram with its ends labelled."""
    width, height, floor = 512.0, 150.0, 130.0
    step = width / len(histogram.shares)
    top = float(histogram.shares.max()) or 1.0
    bars = "".join(
        f'<rect x="{i * step:.2f}" y="{floor - floor * share / top * 0.96:.2f}" width="{step * 0.86:.2f}" '
        f'height="{floor * share / top * 0.96:.2f}"/>'
        for i, share in enumerate(histogram.shares.tolist())
        if share > 0
    )
    labels = "".join(
        f'<text x="{x}" y="{height - 5}" text-anchor="{anchor}">{value}</text>'
        for x, anchor, value in ((4, "start", "0 closed"), (width / 2, "middle", "0.5"), (width - 4, "end", "1 open"))
    )
    text = escape(caption)
    svg = f'<svg viewBox="0 0 {width:g} {height:g}" role="img" aria-label="{text}">{bars}{labels}</svg>'
    return f"<figure>{svg}<figcaption>{text}</figcaption></figure>"


def _class(name: str) -> str:
    return f' class="{name}"' if name else ""
