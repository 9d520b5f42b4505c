"""Values at the vertices of trees, shrubs and small decorators, which a result stores in a few numbers each."""

from __future__ import annotations

import numpy as np

from bake.decorator_types import Decorators, SmallScalars, TreeFits
from bake.decorators.fit import fit_global
from bake.decorators.volume import evaluate
from bake.types import BakeResult, Float32Array, Float64Array, Role, VertexField, VertexState
from viewer.decorator_view import DecoratorView, TreeShading
from viewer.histogram import vertex_areas


class DecoratedValues:
    """Values of a result's decorators, computed when first asked for and then kept.

    Args:
        result: A bake; it may have no decorators.
    """

    def __init__(self, result: BakeResult) -> None:
        self._result = result
        self._decorators = result.decorators if result.decorators is not None else Decorators()
        fits = self._decorators.fits
        self._row = {} if fits is None else {int(index): row for row, index in enumerate(fits.object)}
        self._kept: dict[tuple[int, TreeShading], Float32Array] = {}
        self._ready: set[TreeShading] = set()

    @property
    def decorators(self) -> Decorators:
        """What the result has."""
        return self._decorators

    def tree_row(self, index: int) -> int:
        """Where an object stands among the fitted trees; -1 if it is none."""
        return self._row.get(index, -1)

    def has(self, shading: TreeShading) -> bool:
        """Whether the result has what a shading needs."""
        if self._decorators.fits is None:
            return shading is TreeShading.NONE
        return shading not in (TreeShading.LINEAR, TreeShading.GOLD) or self._decorators.volume is not None

    def local_ao(self, row: int) -> Float32Array:
        """Local AO of a tree, shape (n, k): one a vertex; NaN if its model is that of another mesh."""
        fits, span = self._fits(), self._vertices(row)
        local = self._decorators.models[int(fits.model[row])].local_ao
        if len(local) != span.stop - span.start:
            return np.full((span.stop - span.start, fits.coefficients.shape[2]), np.nan, np.float32)
        return local

    def global_ao(self, row: int) -> Float32Array:
        """The linear function of a tree at its vertices, shape (n, k), not cut off (Sloan et al. 2013, equation 3)."""
        y = self._fits().coefficients[row].astype(np.float64)
        return (y[0] + self._offsets(row) @ y[1:]).astype(np.float32)

    def tree(self, row: int, shading: TreeShading) -> Float32Array:
        """Values of one model of a tree at its vertices, shape (n, k), not cut off; NaN where it has none.

        `LINEAR` is the linear function that comes closest to the gold signal without local AO. A result keeps its
        error but not its coefficients, so it is fitted again, to the gold signal at the vertices.
        """
        key = (row, shading)
        if key not in self._kept:
            self._kept[key] = self._tree(row, shading)
        return self._kept[key]

    def ready(self, shading: TreeShading) -> bool:
        """Whether values of all trees were made, or cost no more than a product."""
        return shading not in (TreeShading.LINEAR, TreeShading.GOLD) or not self.has(shading) or shading in self._ready

    def compute(self, shading: TreeShading) -> None:
        """Makes the values of all trees, a second for a thousand of them; any thread may call it. See `set_ready`."""
        for row in range(len(self._fits().object)):
            self.tree(row, shading)

    def set_ready(self, shading: TreeShading) -> None:
        """Says that `compute` is through, for the thread that draws."""
        self._ready.add(shading)

    def _tree(self, row: int, shading: TreeShading) -> Float32Array:
        if shading is TreeShading.LOCAL:
            return self.local_ao(row)
        if shading is TreeShading.PRODUCT:
            return self.local_ao(row) * self.global_ao(row)
        volume = self._decorators.volume
        if volume is None or shading is TreeShading.NONE:
            span = self._vertices(row)
            return np.full((span.stop - span.start, self._fits().coefficients.shape[2]), np.nan, np.float32)
        if shading is TreeShading.GOLD:
            positions = self._result.world.positions[self._vertices(row)]
            return evaluate(volume, positions, self._normals(row))
        gold = self.tree(row, TreeShading.GOLD).astype(np.float64)
        offsets = self._offsets(row)
        areas = vertex_areas(self._result.world.positions[self._vertices(row)], self._faces(row))
        return fit_global(gold, np.ones_like(gold), offsets, areas).at(offsets).astype(np.float32)

    def decorate(self, field: VertexField, view: DecoratorView) -> VertexField:
        """Adds the values of decorators to those of surfaces, cut off at 0 and 1.

        Lower LODs keep the stored values where the field, solved for another threshold or mapping, has none.

        Args:
            field: Values of surfaces.
            view: Which decorators are coloured, and how.
        """
        own, world = self._result.field, self._result.world
        fits = self._decorators.fits if view.trees is not TreeShading.NONE else None
        scalars = (self._decorators.shrub_scalars, self._decorators.small_scalars) if view.scalars else ()
        lods = [] if field is own else [i for i, role in enumerate(world.object_roles) if role is Role.LOD]
        if fits is None and not lods and not any(scalars):
            return field
        ao, state = np.array(field.ao), np.array(field.state)
        for index in lods:
            span = slice(int(world.first_vertex[index]), int(world.first_vertex[index + 1]))
            ao[span], state[span] = own.ao[span], own.state[span]
        if fits is not None:
            for row in range(len(fits.object)):
                span = self._vertices(row)
                ao[span] = np.clip(self.tree(row, view.trees), 0.0, 1.0)
                state[span] = VertexState.BAKED
        for part in scalars:
            if part is not None:
                _spread(part, world.first_vertex, ao, state)
        return VertexField(ao, state, field.report)

    def _fits(self) -> TreeFits:
        assert self._decorators.fits is not None
        return self._decorators.fits

    def _vertices(self, row: int) -> slice:
        index, first = int(self._fits().object[row]), self._result.world.first_vertex
        return slice(int(first[index]), int(first[index + 1]))

    def _faces(self, row: int) -> np.ndarray:
        """The tree's faces with its own vertices counted from 0, shape (m, 3)."""
        index, world = int(self._fits().object[row]), self._result.world
        faces = np.asarray(world.faces[world.first_face[index] : world.first_face[index + 1]])
        return faces - np.int32(world.first_vertex[index])

    def _offsets(self, row: int) -> Float64Array:
        return self._result.world.positions[self._vertices(row)] - self._fits().centre[row]

    def _normals(self, row: int) -> Float64Array:
        """Vertex normals, shape (n, 3): the mean of the faces around where the mesh has none."""
        normals = np.array(self._result.world.normals[self._vertices(row)], np.float64)
        unknown = ~normals.any(axis=1)
        if unknown.any():
            positions, faces = self._result.world.positions[self._vertices(row)], self._faces(row)
            a, b, c = (positions[faces[:, corner]] for corner in range(3))
            sums = np.zeros_like(normals)
            for corner in range(3):
                np.add.at(sums, faces[:, corner], np.cross(b - a, c - a))
            length = np.linalg.norm(sums, axis=1, keepdims=True)
            normals[unknown] = (sums / np.where(length > 0.0, length, np.nan))[unknown]
        return normals


def _spread(part: SmallScalars, first_vertex: np.ndarray, ao: Float32Array, state: np.ndarray) -> None:
    """Writes each object's scalar to all its vertices."""
    for index, value in zip(part.object, part.ao, strict=True):
        span = slice(int(first_vertex[index]), int(first_vertex[index + 1]))
        ao[span], state[span] = value, VertexState.BAKED
