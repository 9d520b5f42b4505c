"""What else a bake can be looked at by, besides its AO: one number or colour a vertex, with unit, range and legend."""

from __future__ import annotations

import enum
import zlib
from collections.abc import Callable, Mapping

import numpy as np

from bake.types import BakeResult, Float32Array, Float64Array, Role, UInt8Array, VertexField, VertexState
from viewer.around import Around
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
    kind: Inspection,
    result: BakeResult,
    field: VertexField,
    column: int,
    *,
    untugged: VertexField | None = None,
    around: Around | None = None,
) -> SurfaceField:
    """The numbers or colours of one kind.

    Args:
        kind: What.
        result: The bake.
        field: The vertex values in view.
        column: Which distance, where that matters.
        untugged: The values without smoothing; needed for `Inspection.TUG` alone.
        around: Of the same result, from one call to the next.
    """
    if kind is Inspection.TUG:
        assert untugged is not None
        values = (field.ao[:, column] - untugged.ao[:, column]).astype(np.float32)
        return _signed(kind, values, field, column, result)
    return _MAKERS[kind](kind, Around(result) if around is None else around, field, column)


def _residual(kind: Inspection, around: Around, field: VertexField, column: int) -> SurfaceField:
    misfit = _misfit(around, field, column)
    values = np.sqrt(around.mean(misfit * misfit, valid=True)).astype(np.float32)
    label = distance_label(_distance(around.result, column))
    return _scalar(kind, values, field, CIVIDIS, (0.0, _most(values)), "", label)


def _held(kind: Inspection, around: Around, field: VertexField, column: int) -> SurfaceField:
    ao = np.asarray(field.ao)[:, column]
    mean = around.mean(np.asarray(around.result.tally.ao)[:, column], valid=True)
    at_bound = (ao <= 0.0) | (ao >= 1.0)
    values = np.where(at_bound, mean - ao, np.where(np.isnan(ao), np.nan, 0.0))
    return _signed(kind, values, field, column, around.result)


def _back_faces(kind: Inspection, around: Around, field: VertexField, column: int) -> SurfaceField:
    values = around.mean(around.result.tally.back_face_share(), valid=False)
    return _scalar(kind, values, field, WARNING, (0.0, 1.0), "")


def _margin(kind: Inspection, around: Around, field: VertexField, column: int) -> SurfaceField:
    share, threshold = around.result.tally.back_face_share(), around.result.settings.back_face_threshold
    values = around.mean(np.abs(share - threshold), valid=False)
    return _scalar(kind, values, field, CIVIDIS, (0.0, threshold), "")


def _density(kind: Inspection, around: Around, field: VertexField, column: int) -> SurfaceField:
    area = around.total(around.result.samples.area, valid=False)
    values = np.divide(around.mass, area, out=np.full(len(area), np.nan), where=area > 0.0)
    return _scalar(kind, values, field, CIVIDIS, (0.0, _most(values)), "1/m²")


def _rays(kind: Inspection, around: Around, field: VertexField, column: int) -> SurfaceField:
    values = around.total(around.result.tally.rays, valid=True)
    return _scalar(kind, values, field, CIVIDIS, (0.0, _most(values)), "rays")


def _error(kind: Inspection, around: Around, field: VertexField, column: int) -> SurfaceField:
    misfit, count = _misfit(around, field, column), around.valid_mass
    square = around.mean(misfit * misfit, valid=True)
    values = np.sqrt(np.divide(square, count, out=np.full(len(count), np.nan), where=count > 0.0))
    label = distance_label(_distance(around.result, column))
    return _scalar(kind, values, field, CIVIDIS, (0.0, _most(values)), "", label)


def _state(kind: Inspection, around: Around, field: VertexField, column: int) -> SurfaceField:
    table = np.array([_STATE_COLORS[state][0] for state in VertexState], np.uint8)
    present = np.unique(field.state)
    swatches = tuple(_STATE_COLORS[VertexState(int(state))] for state in present)
    return _colored(kind, table[np.asarray(field.state)], swatches)


def _role(kind: Inspection, around: Around, field: VertexField, column: int) -> SurfaceField:
    world = around.result.world
    table = np.array([_ROLE_COLORS[role] for role in world.object_roles], np.uint8).reshape(-1, 3)
    there = [role for role in Role if role in world.object_roles]
    swatches = tuple((_ROLE_COLORS[role], role.value) for role in there)
    return _colored(kind, table[_owner(around.result)], swatches)


def _object(kind: Inspection, around: Around, field: VertexField, column: int) -> SurfaceField:
    seeds = np.array([zlib.crc32(path.encode()) for path in around.result.world.object_paths], np.uint32)
    channels = np.stack([(seeds >> shift & 0xFF) for shift in (0, 8, 16)], axis=1)
    table = (70 + channels * (170 / 255)).astype(np.uint8)  # neither black nor white: both mean something elsewhere
    return _colored(kind, table.reshape(-1, 3)[_owner(around.result)], ())


def _welds(kind: Inspection, around: Around, field: VertexField, column: int) -> SurfaceField:
    world, ao = around.result.world, np.asarray(field.ao)
    owner = _owner(around.result)
    positions = np.asarray(world.positions) + 0.0  # -0.0 and 0.0 are one place
    sorted_by = _by_place(positions, owner)
    steps = np.diff(positions[sorted_by], axis=0, prepend=np.nan).any(axis=1)
    begins = np.flatnonzero(steps | (np.diff(owner[sorted_by], prepend=-1) != 0))
    value = np.nan_to_num(ao[:, 0], nan=-1.0)
    spread = np.maximum.reduceat(value[sorted_by], begins) - np.minimum.reduceat(value[sorted_by], begins)
    count = np.diff(begins, append=len(value))
    several, split = (np.repeat(wanted, count) for wanted in (count > 1, spread > 1e-6))
    colors = np.full((world.vertex_count, 3), _ALONE, np.uint8)
    colors[sorted_by[several]] = _SHARED
    colors[sorted_by[several & split]] = _CREASED
    swatches = (
        (_ALONE, "alone at its place"),
        (_SHARED, "share one value"),
        (_CREASED, "crease or seam: values differ"),
    )
    return _colored(kind, colors, swatches)


def _normals(kind: Inspection, around: Around, field: VertexField, column: int) -> SurfaceField:
    colors = np.clip(127.5 * (np.asarray(around.result.world.normals) + 1.0), 0.0, 255.0).astype(np.uint8)
    return _colored(kind, colors, (((255, 127, 127), "+X"), ((127, 255, 127), "+Y"), ((127, 127, 255), "+Z")))


def _winding(kind: Inspection, around: Around, field: VertexField, column: int) -> SurfaceField:
    world = around.result.world
    faces, places, normals = np.asarray(world.faces), _axes(world.positions), _axes(world.normals)
    slants, against = (np.zeros(world.vertex_count, np.bool_) for _ in range(2))
    for begin in range(0, len(faces), _BLOCK):  # axis by axis in blocks that stay in the cache: several times as fast
        corners = _axes(faces[begin : begin + _BLOCK])
        first, second, third = ([axis.take(corner) for axis in places] for corner in corners)
        u, v = ([end - start for start, end in zip(first, other, strict=True)] for other in (second, third))
        face = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
        half = 0.5 * np.sqrt(face[0] * face[0] + face[1] * face[1] + face[2] * face[2])
        for corner in corners:
            along = sum(axis.take(corner) * side for axis, side in zip(normals, face, strict=True))
            slants[corner[along < half]] = True
            against[corner[along < 0.0]] = True
    colors = np.full((world.vertex_count, 3), _AGREES, np.uint8)
    colors[slants] = _SLANTS
    colors[against] = _AGAINST
    colors[~np.asarray(world.normals).any(axis=1)] = _UNKNOWN
    swatches = ((_AGREES, "agree"), (_SLANTS, "over 60° apart"), (_AGAINST, "opposed"), (_UNKNOWN, "no normal"))
    return _colored(kind, colors, swatches)


_BLOCK = 1 << 15
_Maker = Callable[[Inspection, Around, VertexField, int], SurfaceField]
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


def _misfit(around: Around, field: VertexField, column: int) -> Float64Array:
    """Interpolated value minus sample, shape (samples,); 0 where a corner has no value."""
    fitted = around.at_samples(np.asarray(field.ao)[:, column])
    return np.nan_to_num(fitted - np.asarray(around.result.tally.ao)[:, column])


def _owner(result: BakeResult) -> np.ndarray:
    return np.repeat(np.arange(result.world.object_count), np.diff(result.world.first_vertex))


def _by_place(positions: Float64Array, owner: np.ndarray) -> np.ndarray:
    """An order in which vertices of an object at one place stand together, shape (n,).

    They are sorted by one number that places hardly share, and only where some share it by all of their coordinates.
    """
    x, y, z = positions.T  # element by element: the same coordinates must give the same number to the bit
    number = x + 1.6180339887 * y + 2.7182818285 * z + 0.5772156649 * owner
    order = np.argsort(number, kind="stable")
    shared = np.diff(number[order], prepend=np.nan) == 0.0
    shared[:-1] |= shared[1:]
    some = order[shared]
    order[shared] = some[np.lexsort((owner[some], *positions[some].T, number[some]))]
    return order


def _axes(vectors: np.ndarray) -> list[np.ndarray]:
    """The columns of an array of shape (n, 3), each in one piece."""
    return [np.ascontiguousarray(axis) for axis in np.asarray(vectors).T]


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
