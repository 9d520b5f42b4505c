"""glTF's binary side: buffers, buffer views and accessors, every access checked against what is really there."""

from __future__ import annotations

import base64
import binascii
from typing import Any
from urllib.parse import unquote_to_bytes

import numpy as np
from numpy.typing import NDArray

from bake.errors import SceneError
from bake.scene.gltf_document import COMPRESSION_ADVICE, GltfDocument
from bake.scene.json_cursor import JsonCursor
from bake.types import Float64Array, Int64Array

COMPONENT_DTYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
TYPE_COLUMNS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
# An accessor without data of its own is all zeros; more of them than this is no scene but a mistake or an attack.
MOST_IMPLIED_ZEROS = 2**24


class GltfBuffers:
    """Reads accessors of one document; each buffer is fetched once, when first needed."""

    def __init__(self, document: GltfDocument) -> None:
        self._document = document
        self._root = document.root
        self._buffers: dict[int, memoryview] = {}

    def view(self, index: JsonCursor) -> tuple[memoryview, int]:
        """The bytes of a buffer view and its stride (0: tightly packed).

        Args:
            index: The document's value that names the buffer view.

        Raises:
            SceneError: the view does not lie inside its buffer, or is compressed.
        """
        view = self._root.get("bufferViews", []).element(index)
        offset = view.get("byteOffset", 0).integer(low=0)
        length = view.get("byteLength").integer(low=0)
        stride = view.get("byteStride", 0).integer(low=0, high=2**31)
        buffer = self._buffer(view.get("buffer"), view)
        if offset + length > len(buffer):
            raise SceneError(
                f"{view.place} needs bytes {offset} to {offset + length} of a buffer that has {len(buffer)}",
                where=view.file,
                remedy="copy or export the scene again",
            )
        return buffer[offset : offset + length], stride

    def floats(self, index: JsonCursor, columns: int, *, quantized: bool = True) -> Float64Array:
        """An accessor's elements as numbers, shape (n, columns), float64; normalised integers become [-1, 1].

        Args:
            index: The document's value that names the accessor.
            columns: Components that an element must have.
            quantized: Whether integer components are accepted (KHR_mesh_quantization).

        Raises:
            SceneError: the accessor is malformed, out of bounds or of another type.
        """
        accessor = self._root.get("accessors", []).element(index)
        raw = self._elements(accessor, columns)
        if raw.dtype.kind != "f" and not quantized:
            raise accessor.get("componentType").wrong("5126 (float)")
        with np.errstate(invalid="ignore"):  # signalling NaNs; whoever reads the numbers judges them
            numbers = raw.astype(np.float64)
        if raw.dtype.kind != "f" and accessor.get("normalized", False).flag():
            numbers = np.maximum(numbers / np.iinfo(raw.dtype).max, -1.0)
        return numbers

    def integers(self, index: JsonCursor) -> Int64Array:
        """A scalar accessor of whole numbers, shape (n,), int64."""
        accessor = self._root.get("accessors", []).element(index)
        raw = self._elements(accessor, 1)
        if raw.dtype.kind == "f":
            raise accessor.get("componentType").wrong("an integer type")
        return raw[:, 0].astype(np.int64)

    def count(self, index: JsonCursor) -> int:
        """The number of elements that an accessor claims to have."""
        return self._root.get("accessors", []).element(index).get("count").integer(low=0)

    def _elements(self, accessor: JsonCursor, columns: int) -> NDArray[Any]:
        kind = accessor.get("type")
        if TYPE_COLUMNS.get(kind.text()) != columns:
            raise kind.wrong(next(name for name, width in TYPE_COLUMNS.items() if width == columns))
        count = accessor.get("count").integer(low=0)
        dtype = self._dtype(accessor)
        sparse = accessor.get("sparse")
        if accessor.has("bufferView"):
            elements = self._strided(accessor, accessor.get("bufferView"), count, columns, dtype)
        elif count > MOST_IMPLIED_ZEROS:
            raise accessor.get("count").wrong(f"below {MOST_IMPLIED_ZEROS} for an accessor without data")
        else:
            elements = np.zeros((count, columns), dtype)
        return elements if sparse.value is None else self._with_sparse(elements, sparse)

    def _with_sparse(self, elements: NDArray[Any], sparse: JsonCursor) -> NDArray[Any]:
        """`elements` with the replacements of a sparse accessor."""
        count = sparse.get("count").integer(low=0, high=len(elements))
        indices, values = sparse.get("indices"), sparse.get("values")
        index_dtype = self._dtype(indices)
        if index_dtype.kind != "u":
            raise indices.get("componentType").wrong("an unsigned integer type")
        rows = self._strided(indices, indices.get("bufferView"), count, 1, index_dtype)[:, 0].astype(np.int64)
        if count and rows.max() >= len(elements):
            raise SceneError(
                f"{sparse.place} replaces element {rows.max()} of {len(elements)}",
                where=sparse.file,
                remedy="export the scene again",
            )
        replaced = elements.copy()
        replaced[rows] = self._strided(values, values.get("bufferView"), count, elements.shape[1], elements.dtype)
        return replaced

    def _dtype(self, holder: JsonCursor) -> np.dtype[Any]:
        code = holder.get("componentType")
        name = COMPONENT_DTYPES.get(code.integer())
        if name is None:
            raise code.wrong("one of " + ", ".join(map(str, COMPONENT_DTYPES)))
        return np.dtype(name)

    def _strided(
        self, holder: JsonCursor, view: JsonCursor, count: int, columns: int, dtype: np.dtype[Any]
    ) -> NDArray[Any]:
        """Elements inside a buffer view, without a copy; the bounds are proven before memory is touched."""
        data, stride = self.view(view)
        offset = holder.get("byteOffset", 0).integer(low=0)
        size = dtype.itemsize * columns
        stride = stride or size
        if stride < size:
            raise SceneError(
                f"{holder.place} has elements of {size} bytes every {stride} bytes",
                where=holder.file,
                remedy="export the scene again",
            )
        needed = offset + (stride * (count - 1) + size if count else 0)
        if needed > len(data):
            raise SceneError(
                f"{holder.place} needs {needed} bytes of a buffer view that has {len(data)}",
                where=holder.file,
                remedy="copy or export the scene again",
            )
        if count == 0:
            return np.zeros((0, columns), dtype)
        return np.ndarray((count, columns), dtype, data, offset, (stride, dtype.itemsize))

    def _buffer(self, index: JsonCursor, view: JsonCursor) -> memoryview:
        buffer = self._root.get("buffers", []).element(index)
        number = index.integer()
        if number not in self._buffers:
            content = self._fetch(buffer, number, view)
            length = buffer.get("byteLength", len(content)).integer(low=0)
            if length > len(content):
                raise SceneError(
                    f"{buffer.place} is truncated: {len(content)} of {length} bytes are there",
                    where=buffer.file,
                    remedy="copy or export the scene again",
                )
            self._buffers[number] = content[:length]
        return self._buffers[number]

    def _fetch(self, buffer: JsonCursor, number: int, view: JsonCursor) -> memoryview:
        if not buffer.has("uri"):
            if number == 0 and self._document.binary is not None:
                return self._document.binary
            for name, advice in COMPRESSION_ADVICE.items():
                if view.get("extensions", {}).has(name):
                    raise self._document.wrong(f"the file is compressed with {name}", remedy=advice)
            raise SceneError(f"{buffer.place} has no data", where=buffer.file, remedy="export the scene again")
        uri = buffer.get("uri").text()
        if uri.startswith("data:"):
            return memoryview(decode_data_uri(uri, buffer))
        ledger = self._document.ledger
        return memoryview(ledger.read(ledger.resolve_uri(uri, what="the buffer"), what="the buffer file"))


def decode_data_uri(uri: str, holder: JsonCursor) -> bytes:
    """The content of a `data:` URI (RFC 2397).

    Raises:
        SceneError: it is malformed.
    """
    header, comma, body = uri.partition(",")
    try:
        if not comma:
            raise ValueError("no comma")
        if header.endswith(";base64"):
            return base64.b64decode(unquote_to_bytes(body), validate=False)
        return unquote_to_bytes(body)
    except (binascii.Error, ValueError):
        raise SceneError(
            f"{holder.place} has a malformed data URI", where=holder.file, remedy="export the scene again"
        ) from None
