"""AO as vertex attributes of a glTF document: accessors in the JSON, values behind its own bytes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bake.errors import ResultError
from bake.results.exported_ao import open_where_unbaked
from bake.results.glb_container import GltfContainer, Segment
from bake.types import BakeResult, Float32Array, Int32Array, PrimitiveRange

_FLOAT, _VERTICES = 5126, 34962
_KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}


@dataclass(frozen=True, slots=True)
class SourceLayout:
    """How an object's vertices lie in the primitives of its source mesh."""

    primitives: tuple[PrimitiveRange, ...]
    source_vertex: Int32Array | None


class AoWriter:
    """Collects AO values behind the document's own bytes, all in one interleaved buffer view a kind."""

    def __init__(self, container: GltfContainer, result: BakeResult, color_column: int | None) -> None:
        """Starts behind what the container holds.

        Args:
            container: The document to add to.
            result: What was baked.
            color_column: The AO column that becomes `COLOR_0`; None: no colours.
        """
        self.container = container
        self.result = result
        self.columns = result.field.ao.shape[1]
        self.object_numbers = {path: index for index, path in enumerate(result.world.object_paths)}
        self._column = color_column
        self._rows: list[Float32Array] = []
        self._row_count = 0
        self._colors: list[Float32Array] = []
        self._color_count = 0
        views = len(container.document.get("bufferViews", []))
        self._ao_view, self._color_view = views, views + 1

    def has_values(self, object_index: int) -> bool:
        """Whether the object received per-vertex AO, its own or that of a finer level of detail."""
        world = self.result.world
        first, last = world.first_vertex[object_index : object_index + 2].tolist()
        resampled = bool(np.isfinite(self.result.field.ao[first:last]).any())
        return world.object_roles[object_index].receives_per_vertex or resampled

    def add_to_mesh(self, mesh: dict[str, Any], object_index: int, source: SourceLayout | None) -> None:
        """Gives the mesh's primitives the AO of an object; without `source` its only primitive has its vertices."""
        world = self.result.world
        first, last = world.first_vertex[object_index : object_index + 2].tolist()
        self.add_values_to_mesh(mesh, self.result.field.ao[first:last], source, world.object_paths[object_index])

    def add_values_to_mesh(
        self, mesh: dict[str, Any], ao: Float32Array, source: SourceLayout | None, path: str
    ) -> None:
        """Gives the mesh's primitives AO, shape (n, k); `path` names the object in messages."""
        if source is None:
            self._assign(mesh["primitives"][0]["attributes"], self._new_attributes(open_where_unbaked(ao)))
            return
        added: dict[int, dict[str, int]] = {}  # primitives may share their vertices
        for span in source.primitives:
            attributes = mesh["primitives"][span.primitive]["attributes"]
            if span.first_vertex not in added:
                count = self.container.document["accessors"][attributes["POSITION"]]["count"]
                part = slice(span.first_vertex, span.first_vertex + span.vertex_count)
                values = ao[part]
                if len(values) != span.vertex_count or (source.source_vertex is None and len(values) != count):
                    raise self._misfit(path)
                if source.source_vertex is not None:
                    values = gather_mean(values, source.source_vertex[part], count)
                added[span.first_vertex] = self._new_attributes(open_where_unbaked(values))
            self._assign(attributes, added[span.first_vertex])

    def add_values(self, values: Float32Array) -> dict[str, int]:
        """Stores rows of AO; returns accessor by attribute name."""
        item = 4 * self.columns
        base: dict[str, Any] = {"bufferView": self._ao_view, "componentType": _FLOAT, "count": len(values)}
        offset = self._row_count * item
        self._rows.append(values)
        self._row_count += len(values)
        if self.columns in _KINDS:
            accessor = {**base, "byteOffset": offset, "type": _KINDS[self.columns]}
            return {"_AO": self.container.add("accessors", accessor)}
        return {
            f"_AO_{column}": self.container.add(
                "accessors", {**base, "byteOffset": offset + 4 * column, "type": "SCALAR"}
            )
            for column in range(self.columns)
        }

    def finish(self) -> None:
        """Appends the collected values to the binary chunk and says in the document what they are."""
        if self._rows:
            self._append_view(self._rows, 4 * self.columns)
        if self._colors:
            self._append_view(self._colors, 12)
        asset = self.container.document.setdefault("asset", {"version": "2.0"})
        extras = asset.setdefault("extras", {})
        if isinstance(extras, dict):  # the format allows anything there
            names = ["_AO"] if self.columns in _KINDS else [f"_AO_{column}" for column in range(self.columns)]
            extras["obscura"] = {"attributes": names, "distances": list(self.result.settings.column_distances)}

    def _new_attributes(self, values: Float32Array) -> dict[str, int]:
        attributes = self.add_values(values)
        if self._column is not None:
            accessor = {
                "bufferView": self._color_view,
                "byteOffset": 12 * self._color_count,
                "componentType": _FLOAT,
                "count": len(values),
                "type": "VEC3",
            }
            attributes["COLOR_0"] = self.container.add("accessors", accessor)
            self._colors.append(np.repeat(values[:, self._column : self._column + 1], 3, axis=1))
            self._color_count += len(values)
        return attributes

    @staticmethod
    def _assign(attributes: dict[str, Any], added: dict[str, int]) -> None:
        if "COLOR_0" in attributes and "COLOR_0" in added:
            free = next(number for number in range(1, len(attributes) + 2) if f"COLOR_{number}" not in attributes)
            attributes[f"COLOR_{free}"] = attributes["COLOR_0"]
        attributes.update(added)

    def _append_view(self, rows: list[Float32Array], stride: int) -> None:
        content = np.concatenate(rows).astype("<f4").tobytes()
        offset = self.container.append(Segment(len(content), content))
        view = {"buffer": 0, "byteOffset": offset, "byteLength": len(content), "byteStride": stride}
        self.container.add("bufferViews", {**view, "target": _VERTICES})

    def _misfit(self, path: str) -> ResultError:
        return ResultError(
            "the scene's vertices are not those that were baked",
            where=f"{self.result.scene_path}: {path}",
            remedy="bake again, or export to .npz",
        )


def gather_mean(values: Float32Array, target: Int32Array, count: int) -> Float32Array:
    """Means of the rows that share a target, NaN rows left out, shape (count, k), float32; NaN where none is."""
    gathered = np.empty((count, values.shape[1]), np.float32)
    for column in range(values.shape[1]):
        known = ~np.isnan(values[:, column])
        total = np.bincount(target[known], values[known, column], count)
        number = np.bincount(target[known], minlength=count)
        with np.errstate(invalid="ignore"):
            gathered[:, column] = total / number
    return gathered
