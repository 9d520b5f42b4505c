"""One object that does not cast: which samples notice, and what they see then.

The object goes on receiving: its own samples stay where they are. Its fog or leaves are gone as well, and fog boxes
that had been thinned because they overlapped with it get their density back.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from bake.decorator_types import FogBoxes
from bake.decorators.fog_density import without_overlap
from bake.errors import InputError
from bake.geometry import as_traced
from bake.trace import Tracer
from bake.types import BakeResult, BoolArray, Float32Array, Int64Array, Role, SampleSet, Tally


class Without:
    """The bake's rays in a scene in which one object does not cast.

    Args:
        result: A bake.
        tracer: As the bake had it.
        wanted: Index into `World.object_paths`.

    Raises:
        InputError: no such object.
    """

    def __init__(self, result: BakeResult, tracer: Tracer, wanted: int) -> None:
        world = result.world
        if not 0 <= wanted < world.object_count:
            raise InputError(f"no object {wanted}", where="explain", remedy=f"there are {world.object_count:,}")
        self._result, self._tracer, self._wanted = result, tracer, wanted
        self._fog = None if result.decorators is None else result.decorators.fog
        self._struck = wanted  # what a ray must meet; -1 if crossing a box is enough
        own = slice(int(world.first_face[wanted]), int(world.first_face[wanted + 1]))
        role = world.object_roles[wanted]
        if role is Role.SHRUB and self._fog is not None:
            self._struck = -1
            self._fog, self._low, self._high = _thinner(self._fog, wanted)
        elif role is Role.TREE and tracer.tree_triangles:
            self._struck = -1
            self._low, self._high = _box(as_traced(world.positions[world.faces[own]]))
        else:
            casting = world.faces[own][world.face_casts[own]]
            self._low, self._high = _box(as_traced(world.positions[casting]))

    @property
    def casts(self) -> bool:
        """Whether the object casts at all."""
        return len(self._low) > 0

    def noticed(self, rows: Int64Array) -> BoolArray:
        """Which of some samples have a ray that meets the object, shape (n,)."""
        if not self.casts or not len(rows):
            return np.zeros(len(rows), np.bool_)
        found = np.zeros(len(rows), np.bool_)
        for sent, at in self._by_count(rows):
            samples = self._sending(rows[at], sent)
            found[at] = self._tracer.meets(samples, self._struck, self._low, self._high, rays=sent)
        return found

    def tally(self, rows: Int64Array) -> Tally:
        """The tallies of some samples: as stored, but traced anew where a ray meets the object."""
        tally = self._result.tally
        ao, hits, back_faces = tally.ao[rows], tally.hits[rows], tally.back_faces[rows]
        changed = np.flatnonzero(self.noticed(rows))
        if len(changed):
            found = self.traced(rows[changed])
            ao[changed], hits[changed], back_faces[changed] = found.ao, found.hits, found.back_faces
        return Tally(ao, tally.rays[rows], hits, back_faces)

    def traced(self, rows: Int64Array) -> Tally:
        """What the rays of some samples find when the object does not cast."""
        tally = Tally.empty(len(rows), self._result.settings.distance_count)
        for sent, at in self._by_count(rows):
            found = self._tracer.trace_without(self._sending(rows[at], sent), self._wanted, self._fog, rays=sent)
            tally.ao[at], tally.rays[at] = found.ao, found.rays
            tally.hits[at], tally.back_faces[at] = found.hits, found.back_faces
        return tally

    def _by_count(self, rows: Int64Array) -> Iterator[tuple[int, Int64Array]]:
        """Numbers of rays, and which of `rows` sent so many."""
        sent = self._result.tally.rays[rows]
        for count in np.unique(sent).tolist():
            yield int(count), np.flatnonzero(sent == count)

    def _sending(self, rows: Int64Array, sent: int) -> SampleSet:
        """Some samples that sent so many rays: the first of their blocks of all."""
        samples = self._result.samples.only(rows)
        if sent == self._result.settings.rays:
            return samples
        return replace(samples, index=samples.index * np.int32(self._result.settings.rays // sent))


def _box(corners: Float32Array) -> tuple[Float32Array, Float32Array]:
    """Low and high corner of a box around some points, shape (1, 3) each; (0, 3) around none."""
    points = corners.reshape(-1, 3)
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32)
    return points.min(axis=0)[None], points.max(axis=0)[None]


def _thinner(fog: FogBoxes, wanted: int) -> tuple[FogBoxes, Float32Array, Float32Array]:
    """The other boxes with their densities then, and the boxes of all fog that changes, shape (b, 3) each."""
    rest = fog.object != wanted
    density = np.zeros_like(fog.density)
    if rest.any():
        density[rest] = without_overlap(fog.minimum[rest], fog.maximum[rest], fog.given_density[rest])
    changes = density != fog.density
    return replace(fog, density=density), fog.minimum[changes], fog.maximum[changes]
