"""The report's section on trees, shrubs, small decorators and lower levels of detail."""

from __future__ import annotations

from html import escape

import numpy as np

from app.commands.html import table, tiles
from app.commands.summary import decorator_counts
from bake.decorator_types import SmallScalars
from bake.types import BakeResult
from viewer.fields import distance_label

_MOST_TREES = 200


def decorator_section(result: BakeResult) -> list[str]:
    """The section, heading included; nothing if the scene has none of them."""
    counts = decorator_counts(result)
    if not any(counts.values()):
        return []
    return ["<h2>Trees, shrubs and small decorators</h2>", _figures(counts), _trees(result), _scalars(result)]


def _figures(counts: dict[str, int | float]) -> str:
    names = {
        "trees": "trees",
        "tree_models": "tree models",
        "fog_boxes": "shrubs as boxes of fog",
        "shrubs": "shrubs with a value",
        "small": "small decorators",
        "lods": "lower levels of detail",
        "volume_bricks": "bricks of the tree volume",
        "volume_voxels": "voxels",
        "volume_filled_voxels": "voxels filled from neighbours",
    }
    items = [(f"{counts[key]:,}", name) for key, name in names.items() if counts[key]]
    if counts["volume_voxels"]:
        items.append((f"{counts['volume_memory_mb']:.2f} MB", "memory of the tree volume"))
    return tiles(items)


def _trees(result: BakeResult) -> str:
    """A row a tree, the worst fits first."""
    decorators = result.decorators
    if decorators is None or decorators.fits is None:
        return ""
    fits, distances = decorators.fits, result.settings.column_distances
    worst = np.nan_to_num(np.asarray(fits.rmse_product, np.float64), nan=np.inf).max(axis=1)
    order = np.argsort(-worst, kind="stable")[:_MOST_TREES]
    rows = [
        [
            escape(result.world.object_paths[int(fits.object[row])]),
            f"{int(fits.model[row])}",
            *(
                f"{values[row, column]:.4f}"
                for column in range(len(distances))
                for values in (fits.rmse_global, fits.rmse_product)
            ),
            f"{int(fits.terms[row].min())}",
        ]
        for row in order.tolist()
    ]
    errors = [f"{name}, {distance_label(d)}" for d in distances for name in ("global only", "local × global")]
    headings = ("tree", "model", *errors, "terms")
    note = (
        "<p>Root mean square error of the two models against the AO read from the tree volume; terms counts those of "
        f"the linear function that the tree's shape determines. {len(rows)} of {len(worst)} trees, worst first.</p>"
    )
    return table(headings, rows, numbers=range(1, len(headings))) + note


def _scalars(result: BakeResult) -> str:
    decorators = result.decorators
    if decorators is None:
        return ""
    kinds = {"small decorators": decorators.small_scalars, "shrubs": decorators.shrub_scalars}
    rows = [
        _scalar_row(name, part, column, distance)
        for name, part in kinds.items()
        if part is not None and len(part.object)
        for column, distance in enumerate(result.settings.column_distances)
    ]
    headings = ("one value each", "AO", "lowest", "median", "highest", "no surface around")
    return table(headings, rows, numbers=(2, 3, 4, 5)) if rows else ""


def _scalar_row(name: str, part: SmallScalars, column: int, distance: float) -> list[str]:
    low, middle, high = np.quantile(part.ao[:, column], (0.0, 0.5, 1.0))
    lost = int(np.count_nonzero(~np.asarray(part.found)))
    values = [f"{low:.3f}", f"{middle:.3f}", f"{high:.3f}"]
    return [f"{len(part.object):,} {name}", distance_label(distance), *values, f"{lost:,}"]
