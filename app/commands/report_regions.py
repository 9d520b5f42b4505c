"""The report's section on dynamic regions."""

from __future__ import annotations

from html import escape

from app.commands.html import table, tiles
from app.commands.region_figures import region_counts, regions_content
from bake.types import BakeResult

_MOST_ROWS = 200


def region_section(result: BakeResult) -> list[str]:
    """The section, heading included; nothing if the result has no regions."""
    if result.regions is None:
        return []
    content = regions_content(result)
    return ["<h2>Dynamic regions</h2>", _figures(result), _regions(content["regions"]), _links(content["links"])]


def _figures(result: BakeResult) -> str:
    counts = region_counts(result)
    return tiles(
        [
            (f"{counts['regions']:,}", f"regions ({counts['origin']})"),
            (f"{counts['models']:,}", "models"),
            (f"{counts['links']:,}", "links"),
            (f"{counts['points_valid']:,}", "valid points"),
            (f"{counts['points_inside']:,}", "points that see too many back faces"),
            (f"{counts['mean_error']:.4f}", "mean error of the fit"),
            (f"{counts['mean_error_regularised']:.4f}", "mean error of the regularised models"),
            (f"{counts['worst_mismatch_before']:.3f}", "worst step at a boundary, as fitted"),
            (f"{counts['worst_mismatch_after']:.3f}", "worst step at a boundary, regularised"),
            (f"{counts['bytes'] / 1e3:,.1f} kB", "in the engine: linear harmonics of one function"),
        ]
    )


def _regions(regions: list[dict[str, object]]) -> str:
    """A row a region, the worst fits first."""
    order = sorted(regions, key=lambda item: -_known(item["fit_rmse"]))[:_MOST_ROWS]
    rows = [
        [
            escape(str(item["name"])),
            f"{item['valid_points']:,}",
            _number(item["fit_rmse"]),
            _number(item["regularised_rmse"]),
            escape(str(item["centre_kind"])),
            escape(f"model of {item['absorbed_by']}" if item["absorbed_by"] else ""),
            f"{item['bytes']:,}",
        ]
        for item in order
    ]
    headings = ("region", "valid points", "error", "regularised", "centre", "absorbed", "bytes")
    note = (
        "<p>Root mean square error of AO at a region's valid points over six normals, the largest over the distances. "
        f"{len(rows)} of {len(regions):,} regions, worst first.</p>"
    )
    return table(headings, rows, numbers=(1, 2, 3, 6)) + note


def _links(links: list[dict[str, object]]) -> str:
    """A row a boundary, the largest steps first."""
    if not links:
        return "<p>No region is linked to another.</p>"
    order = sorted(links, key=lambda item: -_known(item["mismatch_after"]))[:_MOST_ROWS]
    rows = [
        [
            escape(str(item["a"])),
            escape(str(item["b"])),
            f"{item['area']:.2f}",
            _number(item["mismatch_before"]),
            _number(item["mismatch_after"]),
        ]
        for item in order
    ]
    note = (
        "<p>How far two models are apart in the middle of their boundary: what a character would pop by without "
        f"blending. {len(rows)} of {len(links):,} boundaries, largest first.</p>"
    )
    return table(("region", "region", "area m²", "step as fitted", "regularised"), rows, numbers=(2, 3, 4)) + note


def _known(value: object) -> float:
    return value if isinstance(value, float) else float("inf")


def _number(value: object) -> str:
    return f"{value:.4f}" if isinstance(value, float) else "–"
