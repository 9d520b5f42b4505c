"""The report: one page that says what was baked, how it went and what deserves a look."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path

import numpy as np

from app.commands.html import bar, histogram_svg, page, picture, table, tiles
from app.commands.pictures import Picture
from app.commands.progress import duration
from app.commands.report_decorators import decorator_section
from app.commands.report_regions import region_section
from app.commands.summary import bake_summary, mrays_per_second
from bake.results.exported_ao import object_means
from bake.types import BakeResult
from viewer.fields import distance_label
from viewer.histogram import histogram_of, vertex_areas

_BINS = 64
_DARKEST = 20
_MOST_FINDINGS = 300
_SEVERITIES = {"set-aside": 0, "warning": 1, "info": 2}


def report_page(result: BakeResult, folder: Path, pictures: Sequence[Picture], *, lead: Sequence[str] = ()) -> str:
    """The report as HTML that needs no other file.

    Args:
        result: What was baked.
        folder: Where it is stored.
        pictures: Views of it; none if nothing could draw them.
        lead: HTML that comes first, such as what a reviewer saw.
    """
    body = [
        f"<h1>{escape(result.scene_path.name)}</h1>",
        f"<p>Ambient obscurance of {escape(str(result.scene_path))}, stored in {escape(str(folder))}.</p>",
        *lead,
        _key_figures(result, folder),
        "<h2>Views</h2>",
        _pictures(pictures),
        "<h2>Distribution over the surface</h2>",
        _histograms(result),
        "<h2>Stages</h2>",
        _stages(result),
        "<h2>Darkest objects</h2>",
        _darkest(result),
        *decorator_section(result),
        *region_section(result),
        "<h2>Findings</h2>",
        _findings(result),
        "<h2>Settings</h2>",
        _settings(result),
        "<h2>Made with</h2>",
        _provenance(result),
    ]
    return page(f"{result.scene_path.name}: ambient obscurance", body)


def _key_figures(result: BakeResult, folder: Path) -> str:
    figures = bake_summary(result, folder, sum(stage.seconds for stage in result.stages))
    vertices, samples = figures["vertices"], figures["samples"]
    invalid = 100 * samples["invalid"] / max(samples["total"], 1)
    return tiles(
        [
            (f"{result.world.object_count:,}", "objects"),
            (f"{result.world.face_count:,}", "faces"),
            (f"{vertices['total']:,}", "vertices"),
            (f"{vertices['filled']:,}", "vertices filled from neighbours"),
            (f"{samples['total']:,}", "surface samples"),
            (f"{invalid:.1f} %", "invalid samples"),
            (f"{figures['rays'] / 1e6:,.1f} M", "rays"),
            (f"{figures['mrays_per_s']:.2f}", "Mrays/s"),
            (duration(figures["seconds"]), f"{result.tracer} on {result.device}"),
            (f"{figures['peak_memory_mb']:,.0f} MB", "peak memory"),
        ]
    )


def _pictures(pictures: Sequence[Picture]) -> str:
    if not pictures:
        return (
            "<p>No pictures: nothing on this machine could draw off screen. "
            "The command <code>doctor</code> says what is missing.</p>"
        )
    views = "".join(picture(item.jpeg, f"{item.view}, AO at {item.distance}") for item in pictures)
    note = "White is open, black is closed, slate received no AO of its own; a faint headlight shows the shapes."
    return f'<div class="pictures">{views}</div><p>{note}</p>'


def _histograms(result: BakeResult) -> str:
    areas = vertex_areas(result.world.positions, result.world.faces)
    figures: list[str] = []
    for column, distance in enumerate(result.settings.column_distances):
        histogram = histogram_of(result.field.ao[:, column], areas, 0.0, 1.0, _BINS)
        mean = "no values" if histogram.is_empty else f"mean {histogram.mean:.3f} by area"
        figures.append(histogram_svg(histogram, f"AO at {distance_label(distance)}, {mean}"))
    return f'<div class="pictures">{"".join(figures)}</div>'


def _stages(result: BakeResult) -> str:
    total = sum(stage.seconds for stage in result.stages)
    rows: list[list[str]] = []
    for stage in result.stages:
        ran = stage.status == "ran"
        rows.append(
            [
                escape(stage.name),
                f"{stage.seconds:.2f}" if ran else escape(stage.status),
                bar(stage.seconds / total) if ran and total else "",
                f"{stage.rays:,}" if stage.rays else "",
                f"{mrays_per_second([stage]):.2f}" if stage.rays else "",
                f"{stage.peak_memory_mb:,.0f}" if stage.peak_memory_mb else "",
                escape(stage.why),
            ]
        )
    rows.append(["<b>total</b>", f"<b>{total:.2f}</b>", "", "", "", "", ""])
    headings = ("stage", "seconds", "share of the time", "rays", "Mrays/s", "peak MB", "")
    return table(headings, rows, numbers=(1, 3, 4, 5))


def _darkest(result: BakeResult) -> str:
    world, samples = result.world, result.samples
    means = object_means(result)
    longest = int(np.argmax(result.settings.column_distances))
    known = np.flatnonzero(~np.isnan(means[:, longest]))
    order = known[np.argsort(means[known, longest], kind="stable")][:_DARKEST]
    owner = world.face_object[samples.face]
    totals = np.bincount(owner, minlength=world.object_count)
    valid = result.tally.valid(result.settings.back_face_threshold)
    invalid = np.bincount(owner[~valid], minlength=world.object_count)
    if not len(order):
        return "<p>No object received AO.</p>"
    rows = [
        [
            escape(world.object_paths[i]),
            *(f"{value:.3f}" for value in means[i]),
            f"{world.first_vertex[i + 1] - world.first_vertex[i]:,}",
            f"{totals[i]:,}",
            f"{100 * invalid[i] / max(totals[i], 1):.1f} %",
        ]
        for i in order.tolist()
    ]
    labels = [f"AO {distance_label(distance)}" for distance in result.settings.column_distances]
    headings = ("object", *labels, "vertices", "samples", "invalid")
    note = f"<p>Means over the surface; the {len(rows)} darkest of {len(known):,} by the longest distance.</p>"
    return table(headings, rows, numbers=range(1, len(headings))) + note


def _findings(result: BakeResult) -> str:
    findings = sorted(result.findings, key=lambda item: (_SEVERITIES.get(item.severity, 1), -item.count))
    if not findings:
        return "<p>Nothing was welded, dropped, filled or found odd.</p>"
    rows = [
        [
            (escape(item.severity), "bad" if item.severity != "info" else ""),
            escape(item.object),
            escape(item.what),
            f"{item.count:,}",
            escape(item.detail),
        ]
        for item in findings[:_MOST_FINDINGS]
    ]
    rest = len(findings) - len(rows)
    note = f"<p>… and {rest:,} more of lesser weight; the result's manifest lists them all.</p>" if rest else ""
    return table(("", "object", "finding", "count", ""), rows, numbers=(3,)) + note


def _settings(result: BakeResult) -> str:
    rows = [[escape(option), escape(_shown(value))] for option, value in result.settings.to_json().items()]
    return table(("option", "value"), rows)


def _shown(value: object) -> str:
    if value is None or value == []:
        return "–"
    if isinstance(value, list):
        return ", ".join(f"{item:g}" if isinstance(item, float) else str(item) for item in value)
    return str(value)


def _provenance(result: BakeResult) -> str:
    versions = table(("library", "version"), [[escape(k), escape(v)] for k, v in sorted(result.versions.items())])
    hashes = table(
        ("file", "SHA-256"),
        [[escape(name), (escape(digest or "absent"), "hash")] for name, digest in sorted(result.files.items())],
    )
    return f"{versions}<details><summary>Files of the scene</summary>{hashes}</details>"
