"""The numbers of trees, fog boxes, scalars and LODs, column by column."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bake.types import BakeResult
from viewer.fields import distance_label
from viewer.fog_view import lost_share
from viewer.lods import finest_objects, lod_levels

KINDS = ("Trees", "Fog boxes", "Scalars", "LODs")


@dataclass(frozen=True, slots=True)
class Column:
    """One column of a table.

    Attributes:
        heading: With its unit.
        texts: What the cells show.
        keys: What they are sorted by.
        tip: What the column means.
    """

    heading: str
    texts: Sequence[str]
    keys: Sequence[Any]
    tip: str = ""


def available_kinds(result: BakeResult) -> list[str]:
    """The tables that a result has rows for."""
    found = result.decorators
    has = {
        "Trees": found is not None and found.fits is not None,
        "Fog boxes": found is not None and found.fog is not None,
        "Scalars": found is not None and (found.shrub_scalars is not None or found.small_scalars is not None),
        "LODs": bool(lod_levels(result.world)),
    }
    return [kind for kind in KINDS if has[kind]]


def instance_columns(result: BakeResult, kind: str) -> list[Column]:
    """The columns of one of the available kinds; the first names the object."""
    makers: dict[str, Callable[[BakeResult], list[Column]]] = {
        "Trees": _trees,
        "Fog boxes": _fog,
        "Scalars": _scalars,
        "LODs": _lods,
    }
    return makers[kind](result)


def _trees(result: BakeResult) -> list[Column]:
    assert result.decorators is not None
    fits = result.decorators.fits
    assert fits is not None
    columns = [_objects(result, fits.object), _numbers("Model", fits.model, "{:.0f}", "Trees of one mesh share it")]
    for number, metres in enumerate(result.settings.column_distances):
        label = distance_label(metres)
        tip = f"RMSE against the signal traced on the tree at {label}"
        for name, errors, what in (
            ("Global", fits.rmse_global, "of the best linear function alone"),
            ("Product", fits.rmse_product, "of local × global, which is stored"),
            ("Volume", fits.rmse_volume, "of the volume that the model was fitted to"),
        ):
            columns.append(_numbers(f"{name} {label}", errors[:, number], "{:.4f}", f"{tip}, {what}"))
    terms = fits.terms.min(axis=1)
    columns.append(_numbers("Terms", terms, "{:.0f} of 4", "How many numbers of the fit the tree's shape determined"))
    return columns


def _fog(result: BakeResult) -> list[Column]:
    assert result.decorators is not None
    fog = result.decorators.fog
    assert fog is not None
    size = np.asarray(fog.maximum) - np.asarray(fog.minimum)
    texts = [f"{x:.2f} × {y:.2f} × {z:.2f}" for x, y, z in size.tolist()]
    return [
        _objects(result, fog.object),
        _numbers("Given [1/m]", fog.given_density, "{:.3f}", "What the object or the settings ask for"),
        _numbers("Traced [1/m]", fog.density, "{:.3f}", "What the rays met"),
        _numbers("Lost to overlap", 100.0 * lost_share(fog), "{:.0f} %", "Share that overlap with other boxes took"),
        Column("Size [m]", texts, size.prod(axis=1).tolist(), "Edges of the box; sorted by volume"),
    ]


def _scalars(result: BakeResult) -> list[Column]:
    assert result.decorators is not None
    parts = [part for part in (result.decorators.shrub_scalars, result.decorators.small_scalars) if part is not None]
    index = np.concatenate([part.object for part in parts])
    ao = np.concatenate([part.ao for part in parts])
    found = np.concatenate([part.found for part in parts])
    roles = [str(result.world.object_roles[number]) for number in index]
    columns = [_objects(result, index), Column("Role", roles, roles)]
    for number, metres in enumerate(result.settings.column_distances):
        label = distance_label(metres)
        columns.append(_numbers(f"AO at {label}", ao[:, number], "{:.4f}", "Baked AO of the surface around it"))
    texts = ["yes" if hit else "no: open" for hit in found]
    columns.append(Column("Met a surface", texts, texts, "Whether its sphere met a baked surface"))
    return columns


def _lods(result: BakeResult) -> list[Column]:
    world = result.world
    rows: list[tuple[int, int, str]] = []
    for of, lower in lod_levels(world).items():
        rows += [(index, 0, "") for index in finest_objects(world, of)]
        rows += [(index, level, of) for level, index in enumerate(lower, 1)]
    index = np.array([row[0] for row in rows], np.int64)
    levels = [row[1] for row in rows]
    columns = [
        _objects(result, index),
        Column("Level", ["finest" if level == 0 else f"LOD {level}" for level in levels], levels),
        Column("Of", [row[2] for row in rows], [row[2] for row in rows], "The finest level that it stands for"),
        _numbers("Triangles", np.diff(world.first_face)[index], "{:,.0f}"),
    ]
    ao = np.asarray(result.field.ao)
    for number, metres in enumerate(result.settings.column_distances):
        means = [_mean(ao[world.first_vertex[i] : world.first_vertex[i + 1], number]) for i in index]
        tip = "Mean over the vertices"
        columns.append(_numbers(f"Mean AO at {distance_label(metres)}", np.array(means), "{:.4f}", tip))
    return columns


def _mean(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else float("nan")


def _objects(result: BakeResult, index: np.ndarray) -> Column:
    paths = [result.world.object_paths[number] for number in index]
    return Column("Object", paths, paths)


def _numbers(heading: str, values: np.ndarray, form: str, tip: str = "") -> Column:
    numbers = np.asarray(values, np.float64).tolist()
    return Column(heading, ["—" if number != number else form.format(number) for number in numbers], numbers, tip)
