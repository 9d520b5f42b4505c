"""Everything there is to say about one point of a baked surface; exact numbers from the arrays, never from colours."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from bake.types import BakeResult, VertexField, VertexState, World
from viewer.decorated import DecoratedValues
from viewer.decorator_rows import decorator_line, decorator_rows, state_word
from viewer.decorator_view import DecoratorView
from viewer.fields import distance_label
from viewer.picking import Pick
from viewer.tone import RemapCurve, blend

STATE_WORDS = {
    VertexState.BAKED: "baked",
    VertexState.FILLED: "filled from neighbours",
    VertexState.UNREFERENCED: "unreferenced",
    VertexState.NOT_BAKED: "not baked",
}


@dataclass(frozen=True, slots=True)
class Readout:
    """What is known at a point.

    Attributes:
        object, role: Path and role of the object hit.
        face: Index of the triangle in the world; `object_face` counts within the object.
        vertices: The three corners, as vertex numbers within the object.
        barycentric: Weights of the corners.
        position: World metres.
        distances: Labels of the AO columns; empty without a result.
        ao: Interpolated AO per distance.
        blended: The blended and remapped value; NaN without a result.
        nearest: Which corner (0-2) weighs most.
        corner_ao: AO of each corner per distance.
        corner_states: How each corner came by its value.
        samples, invalid: Surface samples on the triangle, and those above the back-face threshold.
        rays, hits, back_faces: Summed over the triangle's samples.
        decorator: Label and text of what is known of the object as a decorator.
        decorator_line: The same in short.
        is_sampled: Whether the object takes surface samples.
    """

    object: str
    role: str
    face: int
    object_face: int
    vertices: tuple[int, int, int]
    barycentric: tuple[float, float, float]
    position: tuple[float, float, float]
    distances: tuple[str, ...] = ()
    ao: tuple[float, ...] = ()
    blended: float = float("nan")
    nearest: int = 0
    corner_ao: tuple[tuple[float, ...], ...] = ()
    corner_states: tuple[str, ...] = ()
    samples: int = 0
    invalid: int = 0
    rays: int = 0
    hits: int = 0
    back_faces: int = 0
    decorator: tuple[tuple[str, str], ...] = ()
    decorator_line: str = ""
    is_sampled: bool = True

    @property
    def back_face_share(self) -> float:
        """Back-face hits over hits on the triangle; 0 where nothing was hit."""
        return self.back_faces / max(self.hits, 1)

    def rows(self) -> list[tuple[str, str]]:
        """Label and text of every line of the detailed view."""
        x, y, z = self.position
        rows = [
            ("Object", self.object),
            ("Role", self.role),
            ("Triangle", f"{self.object_face} of the object, {self.face} of the scene"),
            ("Barycentric", ", ".join(f"{weight:.4f}" for weight in self.barycentric)),
            ("Position", f"{x:.3f}, {y:.3f}, {z:.3f} m"),
        ]
        rows += self.decorator
        if not self.distances:
            return rows
        rows += [(f"AO at {label}", _number(value)) for label, value in zip(self.distances, self.ao, strict=True)]
        rows.append(("Blended", _number(self.blended)))
        for corner in range(3):
            values = "  ".join(_number(value) for value in self.corner_ao[corner])
            mark = "  ← nearest" if corner == self.nearest else ""
            rows.append((f"Vertex {self.vertices[corner]}", f"{values}  {self.corner_states[corner]}{mark}"))
        if not self.is_sampled:
            return rows
        rows += [
            ("Samples", f"{self.samples} on the triangle, {self.invalid} invalid"),
            ("Rays", f"{self.rays:,} traced, {self.hits:,} hit, {self.back_face_share:.1%} of hits on back faces"),
        ]
        return rows

    def place(self) -> str:
        """Triangle and barycentric weights in short."""
        return f"triangle {self.object_face}  ({' '.join(f'{weight:.2f}' for weight in self.barycentric)})"

    def line(self) -> str:
        """The most important numbers on one line, without object and triangle."""
        parts: list[str] = []
        if self.distances:
            parts += [f"{label}: {_number(value)}" for label, value in zip(self.distances, self.ao, strict=True)]
            if self.decorator_line:
                return "  ·  ".join([*parts, self.decorator_line])
            nearest = " ".join(_number(value) for value in self.corner_ao[self.nearest])
            parts.append(f"v{self.vertices[self.nearest]}: {nearest} {self.corner_states[self.nearest]}")
            if self.is_sampled:
                parts.append(f"{self.samples} samples, {self.invalid} invalid, {self.rays:,} rays")
        return "  ·  ".join(parts)


def read_out(
    world: World,
    pick: Pick,
    result: BakeResult | None,
    *,
    field: VertexField | None = None,
    threshold: float | None = None,
    short_share: float = 0.0,
    curve: RemapCurve | None = None,
    values: DecoratedValues | None = None,
    view: DecoratorView | None = None,
) -> Readout:
    """Looks a picked point up.

    Args:
        world: The geometry picked on.
        pick: The point.
        result: The bake of this world, if there is one.
        field: Vertex values to read instead of the result's own, e.g. those of a changed threshold.
        threshold: Back-face threshold; the bake's own by default.
        short_share, curve: Blend and remap as displayed.
        values, view: Decorators of the result, and how they are shown; `field` then has their values.
    """
    owner = int(world.face_object[pick.face])
    corners = np.asarray(world.faces[pick.face])
    first_vertex = int(world.first_vertex[owner])
    origin = np.asarray(world.origin)
    x, y, z = np.asarray(pick.position) + origin
    a, b, c = (int(corner) - first_vertex for corner in corners)
    readout = Readout(
        object=world.object_paths[owner],
        role=str(world.object_roles[owner]),
        face=pick.face,
        object_face=pick.face - int(world.first_face[owner]),
        vertices=(a, b, c),
        barycentric=pick.barycentric,
        position=(float(x), float(y), float(z)),
    )
    if result is None:
        return readout
    readout = _with_values(readout, corners, result, field, threshold, short_share, curve)
    if values is None or view is None or world.object_roles[owner].receives_per_vertex:
        return readout
    word = state_word(values, owner, view)
    vertex = readout.vertices[readout.nearest]
    return dataclasses.replace(
        readout,
        decorator=tuple(decorator_rows(result, values, owner, vertex)),
        decorator_line=decorator_line(result, values, owner, vertex),
        corner_states=(word,) * 3 if word else readout.corner_states,
        is_sampled=False,
    )


def _with_values(
    readout: Readout,
    corners: np.ndarray,
    result: BakeResult,
    field: VertexField | None,
    threshold: float | None,
    short_share: float,
    curve: RemapCurve | None,
) -> Readout:
    field = result.field if field is None else field
    distances = result.settings.column_distances
    corner_ao = np.asarray(field.ao[corners], np.float64)
    weights = np.asarray(readout.barycentric)
    interpolated = weights @ corner_ao
    corner_blend = blend(corner_ao.astype(np.float32), distances, short_share)
    if curve is not None:
        corner_blend = curve(corner_blend)
    begin, end = np.searchsorted(result.samples.face, (readout.face, readout.face + 1))
    tally = result.tally
    hits, back = tally.hits[begin:end].astype(np.int64), tally.back_faces[begin:end].astype(np.int64)
    limit = result.settings.back_face_threshold if threshold is None else threshold
    return dataclasses.replace(
        readout,
        distances=tuple(distance_label(distance) for distance in distances),
        ao=tuple(map(float, interpolated)),
        blended=float(weights @ corner_blend),
        nearest=int(np.argmax(weights)),
        corner_ao=tuple(tuple(map(float, row)) for row in corner_ao),
        corner_states=tuple(STATE_WORDS[VertexState(int(state))] for state in field.state[corners]),
        samples=int(end - begin),
        invalid=int(np.count_nonzero(back > limit * hits)),
        rays=int(tally.rays[begin:end].sum(dtype=np.int64)),
        hits=int(hits.sum()),
        back_faces=int(back.sum()),
    )


def _number(value: float) -> str:
    return "—" if np.isnan(value) else f"{value:.4f}"
