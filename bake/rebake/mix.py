"""Some objects or triangles of a result as an earlier one had them: what a rebake changed is turned down in part."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from bake.decorator_types import Decorators, SmallScalars
from bake.types import (
    BakeResult,
    BoolArray,
    Float32Array,
    Float64Array,
    Int32Array,
    Int64Array,
    Tally,
    VertexField,
    World,
)

A = TypeVar("A", np.float32, np.uint16)


def with_former(
    result: BakeResult, former: BakeResult, paths: Collection[str], *, faces: BoolArray | None = None
) -> BakeResult:
    """A result in which some objects have the values and samples of an earlier one; they are marked stale.

    Objects that the earlier result does not have, or has with other triangles, stay as they are.

    Args:
        result: The latest.
        former: An earlier one, with the same distances.
        paths: The objects.
        faces: Shape (m,), of the latest: the only triangles of them whose samples and vertices are taken over, and that
            is what a tree or a small decorator needs one of to be taken over; all if None.

    Returns:
        `result` itself if none of the objects can be taken over.
    """
    pairs = _pairs(result, former, paths)
    if faces is not None:
        chosen = np.asarray(faces)
        pairs = [(new, old) for new, old in pairs if chosen[_span(result.world.first_face, new)].any()]
    if not pairs or result.settings.distance_count != former.settings.distance_count:
        return result
    ao, state = np.array(result.field.ao), np.array(result.field.state)
    for new, old in pairs:
        own = _vertices_of(result.world, new, faces)
        theirs = own + int(former.world.first_vertex[old] - result.world.first_vertex[new])
        ao[own], state[own] = former.field.ao[theirs], former.field.state[theirs]
    stale = {*result.stale, *(result.world.object_paths[new] for new, _ in pairs)}
    return replace(
        result,
        field=VertexField(ao, state, result.field.report),
        tally=_tally(result, former, pairs, faces),
        decorators=_decorators(result, former, pairs),
        stale=tuple(path for path in result.world.object_paths if path in stale),
    )


def faces_within(world: World, low: Float64Array, high: Float64Array) -> BoolArray:
    """Triangles whose middle lies in a box, shape (m,).

    Args:
        world: Theirs.
        low, high: Shape (3,): the box's corners, metres from the world's origin.
    """
    middle = np.asarray(world.positions)[np.asarray(world.faces)].mean(axis=1)
    return np.asarray(((middle >= low) & (middle <= high)).all(axis=1))


def differing_vertices(result: BakeResult, other: BakeResult, *, least: float = 1.0 / 512.0) -> int:
    """How many vertices of two results of the same world have values that differ by more than `least`."""
    mine, others = result.field.ao, other.field.ao
    differs = (np.isfinite(mine) != np.isfinite(others)) | (np.abs(mine - others) > least)
    return int(differs.any(axis=1).sum())


def differing_objects(result: BakeResult, former: BakeResult, *, least: float = 1.0 / 512.0) -> tuple[str, ...]:
    """Paths of the objects with a vertex whose value differs by more than `least`, or that only `result` has."""
    known = {path: index for index, path in enumerate(former.world.object_paths)}
    found: list[str] = []
    for index, path in enumerate(result.world.object_paths):
        own = result.field.ao[_span(result.world.first_vertex, index)]
        theirs = former.field.ao[_span(former.world.first_vertex, known[path])] if path in known else own[:0]
        if own.shape != theirs.shape:
            found.append(path)
            continue
        differs = np.isfinite(own) != np.isfinite(theirs)
        if differs.any() or (len(own) and np.nanmax(np.abs(own - theirs), initial=0.0) > least):
            found.append(path)
    return tuple(found)


def _pairs(result: BakeResult, former: BakeResult, paths: Collection[str]) -> list[tuple[int, int]]:
    """Numbers of the objects in both results, where their meshes have the same size."""
    wanted, known = set(paths), {path: index for index, path in enumerate(former.world.object_paths)}
    sizes = [(np.diff(one.world.first_vertex), np.diff(one.world.first_face)) for one in (result, former)]
    return [
        (new, known[path])
        for new, path in enumerate(result.world.object_paths)
        if path in wanted
        and path in known
        and all(sizes[0][which][new] == sizes[1][which][known[path]] for which in (0, 1))
    ]  # fmt: skip


def _span(first: Int64Array, index: int) -> slice:
    return slice(int(first[index]), int(first[index + 1]))


def _vertices_of(world: World, number: int, faces: BoolArray | None) -> Int64Array:
    """Vertices of an object: all of them, or those of its chosen triangles."""
    own = _span(world.first_vertex, number)
    if faces is None:
        return np.arange(own.start, own.stop, dtype=np.int64)
    mine = _span(world.first_face, number)
    return np.unique(np.asarray(world.faces)[mine][faces[mine]]).astype(np.int64)


def _samples_of(result: BakeResult, index: int) -> slice:
    faces = _span(result.world.first_face, index)
    begin, end = np.searchsorted(result.samples.face, (faces.start, faces.stop)).tolist()
    return slice(begin, end)


def _tally(result: BakeResult, former: BakeResult, pairs: list[tuple[int, int]], faces: BoolArray | None) -> Tally:
    """The samples' values, where an object has the same samples on the same triangles."""
    rows: list[tuple[Int64Array, Int64Array]] = []
    for new, old in pairs:
        own, theirs = _samples_of(result, new), _samples_of(former, old)
        shift = int(result.world.first_face[new] - former.world.first_face[old])
        here, there = result.samples.face[own], former.samples.face[theirs]
        if len(here) == len(there) and np.array_equal(here, there + shift):
            kept = np.arange(len(here)) if faces is None else np.flatnonzero(faces[here])
            rows.append((kept + own.start, kept + theirs.start))

    def taken(mine: NDArray[A], other: NDArray[A]) -> NDArray[A]:
        array = np.array(mine)
        for own, theirs in rows:
            array[own] = other[theirs]
        return array

    tally, others = result.tally, former.tally
    return Tally(
        ao=taken(tally.ao, others.ao),
        rays=taken(tally.rays, others.rays),
        hits=taken(tally.hits, others.hits),
        back_faces=taken(tally.back_faces, others.back_faces),
    )


def _decorators(result: BakeResult, former: BakeResult, pairs: list[tuple[int, int]]) -> Decorators | None:
    """Trees and small decorators, where both results have them."""
    mine, other = result.decorators, former.decorators
    if mine is None or other is None:
        return mine
    fits = mine.fits
    if fits is not None and other.fits is not None:
        coefficients = np.array(fits.coefficients)
        for row, old_row in _rows(fits.object, other.fits.object, pairs):
            coefficients[row] = other.fits.coefficients[old_row]
        fits = replace(fits, coefficients=coefficients)
    return replace(
        mine,
        fits=fits,
        shrub_scalars=_scalars(mine.shrub_scalars, other.shrub_scalars, pairs),
        small_scalars=_scalars(mine.small_scalars, other.small_scalars, pairs),
    )


def _scalars(
    mine: SmallScalars | None, other: SmallScalars | None, pairs: list[tuple[int, int]]
) -> SmallScalars | None:
    if mine is None or other is None:
        return mine
    ao: Float32Array = np.array(mine.ao)
    found = np.array(mine.found)
    for row, old_row in _rows(mine.object, other.object, pairs):
        ao[row], found[row] = other.ao[old_row], other.found[old_row]
    return SmallScalars(mine.object, ao, found)


def _rows(objects: Int32Array, others: Int32Array, pairs: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Rows of two tables that are about the same object."""
    here = {int(index): row for row, index in enumerate(objects)}
    there = {int(index): row for row, index in enumerate(others)}
    return [(here[new], there[old]) for new, old in pairs if new in here and old in there]
