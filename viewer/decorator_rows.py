"""What there is to say about one decorator: lines for the probe, numbers for the tables."""

from __future__ import annotations

import numpy as np

from bake.decorator_types import SmallScalars
from bake.types import BakeResult
from viewer.decorated import DecoratedValues
from viewer.decorator_view import TREE_WORDS, DecoratorView, TreeShading
from viewer.fields import distance_label


def decorator_rows(result: BakeResult, values: DecoratedValues, index: int, vertex: int) -> list[tuple[str, str]]:
    """Label and text of each line about a decorator; empty for other objects.

    Args:
        result: The bake.
        values: Its decorators' values.
        index: The object.
        vertex: The vertex to be exact about, counted within the object.
    """
    rows: list[tuple[str, str]] = []
    decorators = values.decorators
    tree = values.tree_row(index)
    if tree >= 0:
        rows += _tree_rows(values, tree, vertex)
    if decorators.fog is not None:
        for box in np.flatnonzero(decorators.fog.object == index):
            used, given = float(decorators.fog.density[box]), float(decorators.fog.given_density[box])
            lost = f", {1.0 - used / given:.0%} lost to overlap" if given > 0.0 and used < given else ""
            rows.append(("Fog density", f"{used:.3f} of {given:.3f} 1/m{lost}"))
    for part in (decorators.shrub_scalars, decorators.small_scalars):
        text = scalar_text(part, index)
        if text:
            rows.append(("Scalar", text))
    return rows


def decorator_line(result: BakeResult, values: DecoratedValues, index: int, vertex: int) -> str:
    """The same on one line; a tree's factors with their product at the vertex."""
    rows = decorator_rows(result, values, index, vertex)
    if values.tree_row(index) < 0:
        return "  ·  ".join(f"{label}: {text}" for label, text in rows)
    local, total, product, *gold = (text for _, text in rows)
    line = f"v{vertex}: local {local} × global {total} = {product}"
    return line + "".join(f"  ·  gold {text}" for text in gold[:1])


def _tree_rows(values: DecoratedValues, tree: int, vertex: int) -> list[tuple[str, str]]:
    """The factors of the stored model and their product at a vertex, and what the volume says there."""
    words = {
        "Local": values.local_ao(tree),
        "Global": values.global_ao(tree),
        "Product": values.tree(tree, TreeShading.PRODUCT),
    }
    if values.has(TreeShading.GOLD):
        words["Gold"] = values.tree(tree, TreeShading.GOLD)
    return [(f"{word} (v{vertex})", "  ".join(_number(value) for value in ao[vertex])) for word, ao in words.items()]


def scalar_text(part: SmallScalars | None, index: int) -> str:
    """A small decorator's values; empty if it is none."""
    if part is None:
        return ""
    found = np.flatnonzero(part.object == index)
    if not len(found):
        return ""
    row = int(found[0])
    note = "" if part.found[row] else "  (no baked surface around: open)"
    return "  ".join(_number(value) for value in part.ao[row]) + note


def state_word(values: DecoratedValues, index: int, view: DecoratorView) -> str:
    """How the vertices of an object came by the values in view; empty where the field says it."""
    if values.tree_row(index) >= 0:
        return TREE_WORDS[view.trees]
    parts = (values.decorators.shrub_scalars, values.decorators.small_scalars)
    is_small = any(part is not None and bool((part.object == index).any()) for part in parts)
    return "scalar" if is_small and view.scalars else ""


def tree_errors(result: BakeResult, values: DecoratedValues, tree: int, shading: TreeShading) -> str:
    """RMSE per distance of a tree's model against the signal traced on it, as one line; empty for local AO."""
    fits = values.decorators.fits
    if fits is None:
        return ""
    known = {
        TreeShading.LINEAR: fits.rmse_global,
        TreeShading.PRODUCT: fits.rmse_product,
        TreeShading.GOLD: fits.rmse_volume,
    }
    if shading not in known:
        return ""
    errors = known[shading][tree]
    labels = map(distance_label, result.settings.column_distances)
    return "  ·  ".join(f"{label}: {error:.4f}" for error, label in zip(errors, labels, strict=True))


def _number(value: float) -> str:
    return "—" if np.isnan(value) else f"{value:.4f}"
