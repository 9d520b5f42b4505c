"""What changed between two bakes, object by object, and as columns of a table."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.types import Float32Array, Float64Array, Int64Array, World
from viewer.compare_match import Match, Pairing
from viewer.instance_rows import Column

STEP = 1.0 / 255.0
"""A change that a picture of 8 bits can show; smaller ones do not count as changed."""

SORTED_BY = 3
"""The column of the largest change."""


@dataclass(frozen=True, slots=True)
class Changes:
    """Differences of AO by object, this bake minus the other.

    Attributes:
        compared: Shape (o,), vertices with a value in both.
        changed: Shape (o,), those that differ by more than `STEP`.
        mean: Shape (o,), signed; NaN where nothing can be compared.
        largest: Shape (o,), of the absolute difference.
        rms: Shape (o,), root of the mean square.
        worst: Shape (o,), vertex of the largest change, -1 where there is none.
    """

    compared: Int64Array
    changed: Int64Array
    mean: Float64Array
    largest: Float64Array
    rms: Float64Array
    worst: Int64Array


def changes_of(world: World, values: Float32Array, others: Float32Array) -> Changes:
    """Rolls the differences up to objects.

    Args:
        world: Whose vertices these are.
        values, others: Shape (n,), AO; NaN where there is none.
    """
    objects = world.object_count
    owner = np.repeat(np.arange(objects), np.diff(world.first_vertex))
    difference = np.asarray(values, np.float64) - np.asarray(others, np.float64)
    both = np.flatnonzero(np.isfinite(difference))
    owner, difference = owner[both], difference[both]
    size = np.abs(difference)
    compared = np.bincount(owner, minlength=objects)
    per = np.where(compared > 0, np.maximum(compared, 1), np.nan)
    largest = np.full(objects, np.nan)
    worst = np.full(objects, -1, np.int64)
    if len(both):
        first = np.flatnonzero(np.r_[True, owner[1:] != owner[:-1]])  # vertices stand in the order of their objects
        peak = np.maximum.reduceat(size, first)
        largest[owner[first]] = peak
        at = np.flatnonzero(size == np.repeat(peak, np.diff(np.r_[first, len(size)])))
        worst[owner[at[::-1]]] = both[at[::-1]]
    return Changes(
        compared=compared,
        changed=np.bincount(owner[size > STEP], minlength=objects),
        mean=np.bincount(owner, difference, objects) / per,
        largest=largest,
        rms=np.sqrt(np.bincount(owner, difference**2, objects) / per),
        worst=worst,
    )


def change_columns(world: World, match: Match, changes: Changes) -> list[Column]:
    """A row an object of this world, in its order, then one for each that only the other has."""
    extra = len(match.missing)
    paths = [*world.object_paths, *match.missing]
    words: list[str] = []
    for pairing, compared, changed in zip(match.pairing, changes.compared, changes.changed, strict=True):
        kind = Pairing(pairing)
        if kind in (Pairing.RESIZED, Pairing.ALONE):
            words.append(kind.words)
        elif not compared:
            words.append("no values to compare")
        elif kind is Pairing.MOVED:
            words.append(kind.words)
        else:
            words.append("changed" if changed else "as before")
    words += ["only there"] * extra
    share = 100.0 * changes.changed / np.where(changes.compared > 0, np.maximum(changes.compared, 1), np.nan)
    return [
        Column("Object", paths, paths),
        Column("State", words, words, "Objects match by path where their numbers of vertices are equal"),
        _numbers("Mean Δ", changes.mean, "{:+.4f}", extra, "This bake minus the other; above 0 it is brighter here"),
        _numbers("Largest |Δ|", changes.largest, "{:.4f}", extra, "Of all vertices of the object"),
        _numbers("RMS Δ", changes.rms, "{:.4f}", extra, "Root of the mean square over the vertices"),
        _numbers("Changed", changes.changed, "{:,.0f}", extra, "Vertices that differ by more than 1/255"),
        _numbers("Changed [%]", share, "{:.1f}", extra, "Of the vertices with a value in both"),
    ]


def overall(changes: Changes) -> str:
    """All objects in one line."""
    compared = int(changes.compared.sum())
    if not compared:
        return "no vertex has a value in both"
    square = np.nansum(changes.rms**2 * changes.compared) / compared
    mean = np.nansum(changes.mean * changes.compared) / compared
    return (
        f"{int(changes.changed.sum()):,} of {compared:,} vertices changed, mean {mean:+.4f}, "
        f"RMS {np.sqrt(square):.4f}, largest {np.nanmax(changes.largest):.4f}"
    )


def _numbers(heading: str, values: np.ndarray, form: str, extra: int, tip: str) -> Column:
    numbers = [*np.asarray(values, np.float64).tolist(), *[float("nan")] * extra]
    return Column(heading, ["—" if number != number else form.format(number) for number in numbers], numbers, tip)
