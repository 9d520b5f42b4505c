"""What else a bake can be looked at by, besides its AO: one number or colour a vertex, with unit, range and legend."""

from __future__ import annotations

import enum
import zlib
from collections.abc import Callable, Mapping

import numpy as np

from bake.geometry import face_normals
from bake.types import BakeResult, BoolArray, Float32Array, Float64Array, Role, UInt8Array, VertexField, VertexState
from viewer.colormaps import BLUE_WHITE_ORANGE, CIVIDIS, WARNING, ColorMap
from viewer.fields import SurfaceField, distance_label

Swatches = tuple[tuple[tuple[int, int, int], str], ...]


class Inspection(enum.StrEnum):
    """What is looked at; the value is stored in settings."""

    RESIDUAL = "residual"
    TUG = "tug"
    HELD = "held"
    BACK_FACES = "back-faces"
    MARGIN = "margin"
    DENSITY = "density"
    RAYS = "rays"
    ERROR = "error"
    STATE = "state"
    ROLE = "role"
    OBJECT = "object"
    WELDS = "welds"
    NORMALS = "normals"
    WINDING = "winding"

    @property
    def heading(self) -> str:
        """What menus and legends say."""
        return _HEADINGS[self][0]

    @property
    def meaning(self) -> str:
        """One sentence for a tooltip."""
        return _HEADINGS[self][1]


_HEADINGS: Mapping[Inspection, tuple[str, str]] = {
    Inspection.RESIDUAL: ("Fit residual", "Root mean square of interpolated value minus sample on the faces around"),
    Inspection.TUG: ("Smoothing tug", "The value minus what it would be without smoothing: what neighbours pulled"),
    Inspection.HELD: (
        "Held values",
        "What the bounds 0 and 1 hold back: the mean of the samples around minus the value",
    ),
    Inspection.BACK_FACES: ("Back-face share", "Hits on the backs of faces over all hits, of the samples around"),
    Inspection.MARGIN: ("Margin to the threshold", "How far the samples around are from being judged the other way"),
    Inspection.DENSITY: ("Sample density", "Surface samples per square metre around"),
    Inspection.RAYS: ("Rays used", "Rays of the valid samples on the faces around"),
    Inspection.ERROR: (
        "Standard error",
        "Of the mean of the samples around, from their own scatter and the rays' noise",
    ),
    Inspection.STATE: ("How it was baked", "Baked from samples, filled from neighbours, or not used by any face"),
    Inspection.ROLE: ("Role", "What each object is to the bake"),
    Inspection.OBJECT: ("Object", "A colour of its own for every object"),
    Inspection.WELDS: ("Welds and creases", "Vertices at the same place that share a value, and those that do not"),
    Inspection.NORMALS: ("Normals", "Direction as colour: +X red, +Y green, +Z blue, a half where it is 0"),
    Inspection.WINDING: ("Winding", "Whether the vertex normal and the faces around agree about the outside"),
}

_ROLE_COLORS: Mapping[Role, tuple[int, int, int]] = {
    Role.STATIC: (200, 198, 192),
    Role.BLOCKER: (84, 88, 96),
    Role.RECEIVER: (240, 220, 130),
    Role.TREE: (46, 125, 80),
    Role.SHRUB: (140, 180, 70),
    Role.SMALL: (214, 140, 60),
    Role.LOD: (110, 130, 200),
    Role.IGNORE: (60, 40, 60),
}
_STATE_COLORS: Mapping[VertexState, tuple[tuple[int, int, int], str]] = {
    VertexState.BAKED: ((206, 206, 200), "baked"),
    VertexState.FILLED: ((0, 176, 240), "filled from neighbours"),
    VertexState.UNREFERENCED: ((255, 0, 255), "unreferenced"),
    VertexState.NOT_BAKED: ((104, 116, 132), "not baked (role)"),
}
_AGREES, _SLANTS, _AGAINST, _UNKNOWN = (206, 206, 200), (240, 180, 60), (216, 64, 74), (104, 116, 132)
_ALONE, _SHARED, _CREASED = (206, 206, 200), (70, 150, 110), (216, 110, 40)


def inspect(
    kind: Inspection, result: BakeResult, field: VertexField, column: int, *, untugged: VertexField | None = None
) -> SurfaceField:
    """The numbers or colours of one kind.

    Args:
        kind: What.
        result: The bake.
        field: The vertex values in view.
        column: Which distance, where that matters.
        untugged: The values without smoothing; needed for `Inspection.TUG` alone.
    """
    if kind is Inspection.TUG:
        assert untugged is not None
        values = (field.ao[:, column] - untugged.ao[:, column]).astype(np.float32)
        return _signed(kind, values, field, column, result)
    return _MAKERS[kind](kind, result, field, column)


class _Around:
    """Sums over the samples on the faces around each vertex, each sample counted by its barycentric weight."""

    def __init__(self, result: BakeResult, chosen: BoolArray) -> None:
        samples, self._count = result.samples, result.world.vertex_count
        self._chosen = np.flatnonzero(chosen)
        self._corners = np.asarray(result.world.faces)[np.asarray(samples.face)[self._chosen]]
        first, second = np.asarray(samples.barycentric, np.float64)[self._chosen].T
        self._weights = np.stack((first, second, 1.0 - first - second), axis=1)

    def total(self, values: np.ndarray) -> Float64Array:
        """Σ weight × value, shape (n,), of values of all samples."""
        weighted = self._weights * np.asarray(values, np.float64)[self._chosen, None]
        return np.bincount(self._corners.ravel(), weighted.ravel(), self._count).astype(np.float64)

    def mean(self, values: np.ndarray) -> Float64Array:
        """Weighted mean, shape (n,); NaN where no sample is near."""
        mass = self.total(np.ones(len(values)))
        return np.divide(self.total(values), mass, out=np.full(self._count, np.nan), where=mass > 0.0)


def _residual(kind: Inspection, result: BakeResult, field: VertexField, column: int) -> SurfaceField:
    around, misfit = _Around(result, _valid(result)), _misfit(result, field, column)
    values = np.sqrt(around.mean(misfit * misfit)).astype(np.float32)
    return _scalar(kind, values, field, CIVIDIS, (0.0, _most(values)), "", distance_label(_distance(result, column)))


def _held(kind: Inspection, result: BakeResult, field: VertexField, column: int) -> SurfaceField:
    ao = np.asarray(field.ao)[:, column]
    mean = _Around(result, _valid(result)).mean(np.asarray(result.tally.ao)[:, column])
    at_bound = (ao <= 0.0) | (ao >= 1.0)
    return _signed(kind, np.where(at_bound, mean - ao, np.where(np.isnan(ao), np.nan, 0.0)), field, column, result)


def _back_faces(kind: Inspection, result: BakeResult, field: VertexField, column: int) -> SurfaceField:
    every = np.ones(len(result.samples), np.bool_)
    values = _Around(result, every).mean(result.tally.back_face_share())
    return _scalar(kind, values, field, WARNING, (0.0, 1.0), "")


def _margin(kind: Inspection, result: BakeResult, field: VertexField, column: int) -> SurfaceField:
    every = np.ones(len(result.samples), np.bool_)
    share = result.tally.back_face_share()
    values = _Around(result, every).mean(np.abs(share - result.settings.back_face_threshold))
    return _scalar(kind, values, field, CIVIDIS, (0.0, result.settings.back_face_threshold), "")


def _density(kind: Inspection, result: BakeResult, field: VertexField, column: int) -> SurfaceField:
    every = np.ones(len(result.samples), np.bool_)
    around = _Around(result, every)
    area = around.total(result.samples.area)
    count = around.total(np.ones(len(every)))
    values = np.divide(count, area, out=np.full(len(area), np.nan), where=area > 0.0)
    return _scalar(kind, values, field, CIVIDIS, (0.0, _most(values)), "1/m²")


def _rays(kind: Inspection, result: BakeResult, field: VertexField, column: int) -> SurfaceField:
    values = _Around(result, _valid(result)).total(result.tally.rays)
    return _scalar(kind, values, field, CIVIDIS, (0.0, _most(values)), "rays")


def _error(kind: Inspection, result: BakeResult, field: VertexField, column: int) -> SurfaceField:
    around, misfit = _Around(result, _valid(result)), _misfit(result, field, column)
    count = around.total(np.ones(len(misfit)))
    square = around.mean(misfit * misfit)
    values = np.sqrt(np.divide(square, count, out=np.full(len(count), np.nan), where=count > 0.0))
    return _scalar(kind, values, field, CIVIDIS, (0.0, _most(values)), "", distance_label(_distance(result, column)))


def _state(kind: Inspection, result: BakeResult, field: VertexField, column: int) -> SurfaceField:
    table = np.array([_STATE_COLORS[state][0] for state in VertexState], np.uint8)
    present = np.unique(field.state)
    swatches = tuple(_STATE_COLORS[VertexState(int(state))] for state in present)
    return _colored(kind, table[np.asarray(field.state)], swatches)


def _role(kind: Inspection, result: BakeResult, field: VertexField, column: int) -> SurfaceField:
    world = result.world
    table = np.array([_ROLE_COLORS[role] for role in world.object_roles], np.uint8).reshape(-1, 3)
    there = [role for role in Role if role in world.object_roles]
    swatches = tuple((_ROLE_COLORS[role], role.value) for role in there)
    return _colored(kind, table[_owner(result)], swatches)


def _object(kind: Inspection, result: BakeResult, field: VertexField, column: int) -> SurfaceField:
    seeds = np.array([zlib.crc32(path.encode()) for path in result.world.object_paths], np.uint32)
    channels = np.stack([(seeds >> shift & 0xFF) for shift in (0, 8, 16)], axis=1)
    table = (70 + channels * (170 / 255)).astype(np.uint8)  # neither black nor white: both mean something elsewhere
    return _colored(kind, table.reshape(-1, 3)[_owner(result)], ())


def _welds(kind: Inspection, result: BakeResult, field: VertexField, column: int) -> SurfaceField:
    world, ao = result.world, np.asarray(field.ao)
    owner = _owner(result)
    keys = np.column_stack((world.positions, owner)) + 0.0  # -0.0 and 0.0 are one place
    _, place, count = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    place = place.reshape(-1)
    value = np.nan_to_num(ao[:, 0], nan=-1.0)
    order = np.argsort(place, kind="stable")
    begins = np.flatnonzero(np.diff(place[order], prepend=-1))
    spread = np.maximum.reduceat(value[order], begins) - np.minimum.reduceat(value[order], begins)
    several, split = (count > 1)[place], (spread > 1e-6)[place]
    colors = np.full((world.vertex_count, 3), _ALONE, np.uint8)
    colors[several] = _SHARED
    colors[several & split] = _CREASED
    swatches = (
        (_ALONE, "alone at its place"),
        (_SHARED, "share one value"),
        (_CREASED, "crease or seam: values differ"),
    )
    return _colored(kind, colors, swatches)


def _normals(kind: Inspection, result: BakeResult, field: VertexField, column: int) -> SurfaceField:
    colors = np.clip(127.5 * (np.asarray(result.world.normals) + 1.0), 0.0, 255.0).astype(np.uint8)
    return _colored(kind, colors, (((255, 127, 127), "+X"), ((127, 255, 127), "+Y"), ((127, 127, 255), "+Z")))


def _winding(kind: Inspection, result: BakeResult, field: VertexField, column: int) -> SurfaceField:
    world = result.world
    faces = np.asarray(world.faces)
    normals, _ = face_normals(world.positions, faces)
    least = np.ones(world.vertex_count, np.float64)
    for corner in range(3):
        cosine = np.einsum("ij,ij->i", np.asarray(world.normals, np.float64)[faces[:, corner]], normals)
        np.minimum.at(least, faces[:, corner], cosine)
    colors = np.full((world.vertex_count, 3), _AGREES, np.uint8)
    colors[least < 0.5] = _SLANTS
    colors[least < 0.0] = _AGAINST
    colors[~np.asarray(world.normals).any(axis=1)] = _UNKNOWN
    swatches = ((_AGREES, "agree"), (_SLANTS, "over 60° apart"), (_AGAINST, "opposed"), (_UNKNOWN, "no normal"))
    return _colored(kind, colors, swatches)


_Maker = Callable[[Inspection, BakeResult, VertexField, int], SurfaceField]
_MAKERS: Mapping[Inspection, _Maker] = {
    Inspection.RESIDUAL: _residual,
    Inspection.HELD: _held,
    Inspection.BACK_FACES: _back_faces,
    Inspection.MARGIN: _margin,
    Inspection.DENSITY: _density,
    Inspection.RAYS: _rays,
    Inspection.ERROR: _error,
    Inspection.STATE: _state,
    Inspection.ROLE: _role,
    Inspection.OBJECT: _object,
    Inspection.WELDS: _welds,
    Inspection.NORMALS: _normals,
    Inspection.WINDING: _winding,
}


def _valid(result: BakeResult) -> BoolArray:
    return result.tally.valid(result.settings.back_face_threshold)


def _misfit(result: BakeResult, field: VertexField, column: int) -> Float64Array:
    """Interpolated value minus sample, shape (samples,); 0 where a corner has no value."""
    samples = result.samples
    a, b, c = np.asarray(field.ao, np.float64)[np.asarray(result.world.faces)[np.asarray(samples.face)], column].T
    first, second = np.asarray(samples.barycentric, np.float64).T
    fitted = first * a + second * b + (1.0 - first - second) * c
    return np.nan_to_num(fitted - np.asarray(result.tally.ao)[:, column])


def _owner(result: BakeResult) -> np.ndarray:
    return np.repeat(np.arange(result.world.object_count), np.diff(result.world.first_vertex))


def _distance(result: BakeResult, column: int) -> float:
    return result.settings.column_distances[column]


def _most(values: np.ndarray) -> float:
    known = np.asarray(values)[np.isfinite(values)]
    return max(float(np.quantile(known, 0.995)), 1e-6) if len(known) else 1.0


def _scalar(
    kind: Inspection,
    values: np.ndarray,
    field: VertexField,
    color_map: ColorMap,
    ends: tuple[float, float],
    unit: str,
    label: str = "",
) -> SurfaceField:
    title = f"{kind.heading} at {label}" if label else kind.heading
    state = np.asarray(field.state)
    unsampled = state == VertexState.NOT_BAKED
    filled = np.isnan(values) & (state == VertexState.FILLED)
    return SurfaceField(
        title, np.where(filled, np.nan, values).astype(np.float32), unsampled, *ends, color_map, unit, inspected=True
    )


def _signed(kind: Inspection, values: np.ndarray, field: VertexField, column: int, result: BakeResult) -> SurfaceField:
    reach = max(_most(np.abs(values)), 1e-3)
    title = f"{kind.heading} at {distance_label(_distance(result, column))}"
    not_baked = np.asarray(field.state) == VertexState.NOT_BAKED
    return SurfaceField(
        title, np.asarray(values, np.float32), not_baked, -reach, reach, BLUE_WHITE_ORANGE, inspected=True
    )


def _colored(kind: Inspection, colors: UInt8Array, swatches: Swatches) -> SurfaceField:
    nothing: Float32Array = np.zeros(0, np.float32)
    return SurfaceField(
        kind.heading, nothing, np.zeros(len(colors), np.bool_), rgb=colors, swatches=swatches, inspected=True
    )
