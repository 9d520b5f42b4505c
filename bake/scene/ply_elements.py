"""The PLY container (Turk 1994): header and elements, ASCII or binary of either byte order, into columns."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.errors import SceneError
from bake.types import Float64Array, Int64Array

TYPE_CODES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
STRUCT_CODES = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "f4": "f", "f8": "d"}
BYTE_ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass(frozen=True, slots=True)
class _Property:
    name: str
    code: str
    count_code: str = ""  # of a list's length; empty for plain numbers


@dataclass(slots=True)
class _Element:
    name: str
    count: int
    properties: list[_Property] = field(default_factory=list[_Property])


@dataclass(frozen=True, slots=True)
class PlyElement:
    """One element's data.

    Attributes:
        count: Number of rows.
        columns: Plain properties by name, each shape (count,), float64.
        lists: List properties by name: lengths, shape (count,), and all items one after the other, of their own type.
    """

    count: int
    columns: Mapping[str, Float64Array]
    lists: Mapping[str, tuple[Int64Array, NDArray[Any]]]


def read_ply_elements(content: bytes, file: str) -> dict[str, PlyElement]:
    """Takes a PLY file apart.

    Raises:
        SceneError: malformed header, unknown type, or fewer data than the header promises.
    """
    order, elements, body = _read_header(content, file)
    return _read_ascii(elements, body, file) if order == "=" else _read_binary(elements, body, order, file)


def _read_header(content: bytes, file: str) -> tuple[str, list[_Element], memoryview]:
    if content[:3] != b"ply":
        raise SceneError("the file is no PLY", where=file, remedy="export it again")
    mark = content.find(b"end_header")
    end = content.find(b"\n", mark)
    if mark < 0:
        raise SceneError("the PLY header has no end", where=file, remedy="copy or export it again")
    order, elements = "", list[_Element]()
    for line in content[3:mark].decode("ascii", "replace").splitlines():
        match line.split():
            case ["format", name, _] if name in BYTE_ORDERS:
                order = BYTE_ORDERS[name]
            case ["element", name, count] if count.isdecimal():
                elements.append(_Element(name, int(count)))
            case ["property", "list", count, code, name] if elements and {count, code} <= TYPE_CODES.keys():
                elements[-1].properties.append(_Property(name, TYPE_CODES[code], TYPE_CODES[count]))
            case ["property", code, name] if elements and code in TYPE_CODES:
                elements[-1].properties.append(_Property(name, TYPE_CODES[code]))
            case [] | ["comment", *_] | ["obj_info", *_]:
                pass
            case _:
                raise SceneError(f"the PLY header says {line[:60]!r}", where=file, remedy="export it again")
    if not order:
        raise SceneError("the PLY header names no known format", where=file, remedy="export it again")
    return order, elements, memoryview(content)[end + 1 if end >= 0 else len(content) :]


def _truncated(element: _Element, file: str) -> SceneError:
    return SceneError(
        f"the PLY ends inside its {element.count} {element.name} rows", where=file, remedy="copy or export it again"
    )


def _read_ascii(elements: list[_Element], body: memoryview, file: str) -> dict[str, PlyElement]:
    try:
        numbers = np.array([float(word) for word in bytes(body).split()], np.float64)
    except ValueError as problem:
        raise SceneError(f"the PLY holds no number: {problem}", where=file, remedy="export it again") from None
    result: dict[str, PlyElement] = {}
    position = 0
    for element in elements:
        lengths = _ascii_lengths(element, numbers, position, file)
        widths = [lengths.get(index) for index in range(len(element.properties))]
        row_size = sum((1 if width is None else 1 + width) for width in widths) + np.zeros(element.count, np.int64)
        cursor = position + np.cumsum(row_size) - row_size
        position += int(row_size.sum())
        if position > len(numbers):
            raise _truncated(element, file)
        columns: dict[str, Float64Array] = {}
        lists: dict[str, tuple[Int64Array, NDArray[Any]]] = {}
        for item, width in zip(element.properties, widths, strict=True):
            if width is None:
                columns[item.name] = numbers[cursor]
                cursor = cursor + 1
            else:
                lists[item.name] = (width, numbers[spread(cursor + 1, width)])
                cursor = cursor + 1 + width
        result[element.name] = PlyElement(element.count, columns, lists)
    return result


def _ascii_lengths(element: _Element, numbers: Float64Array, position: int, file: str) -> dict[int, Int64Array]:
    """Lengths of an element's lists by property number; a row takes at least one number per property."""
    least = element.count * max(1, len(element.properties))
    if least > len(numbers) - position:
        raise _truncated(element, file)
    list_numbers = [index for index, item in enumerate(element.properties) if item.count_code]
    if not list_numbers:
        return {}
    lengths = np.zeros((len(list_numbers), element.count), np.int64)
    remaining = len(numbers)
    for row in range(element.count):
        before = 0
        for slot, index in enumerate(list_numbers):
            position += index - before
            if position >= remaining or not 0 <= numbers[position] <= remaining:
                raise _truncated(element, file)
            lengths[slot, row] = numbers[position]
            position += 1 + int(numbers[position])
            before = index + 1
        position += len(element.properties) - before
    return {index: lengths[slot] for slot, index in enumerate(list_numbers)}


def spread(starts: Int64Array, lengths: Int64Array) -> Int64Array:
    """Indices of runs: `starts[i], starts[i] + 1, …` for `lengths[i]` steps each, one run after the other."""
    total = int(lengths.sum())
    begins = np.cumsum(lengths) - lengths
    return np.arange(total) + np.repeat(starts - begins, lengths)


def _read_binary(elements: list[_Element], body: memoryview, order: str, file: str) -> dict[str, PlyElement]:
    result: dict[str, PlyElement] = {}
    position = 0
    for element in elements:
        least = sum(np.dtype(item.count_code or item.code).itemsize for item in element.properties)
        if element.count * max(1, least) > len(body) - position:
            raise _truncated(element, file)
        if element.count == 0:
            result[element.name] = PlyElement(0, {}, {})
            continue
        data = _uniform_rows(element, body[position:], order)
        if data is None:
            result[element.name], used = _varied_rows(element, body[position:], order, file)
        else:
            result[element.name], used = _split_rows(element, data), data.nbytes
        position += used
    return result


def _uniform_rows(element: _Element, body: memoryview, order: str) -> NDArray[np.void] | None:
    """The rows as one structured array, if all have lists as long as the first row's."""
    fields: list[tuple[str, str] | tuple[str, str, int]] = []
    offset = 0
    for number, item in enumerate(element.properties):
        if item.count_code:
            if offset + np.dtype(item.count_code).itemsize > len(body):
                return None
            length = int(np.frombuffer(body, order + item.count_code, 1, offset)[0])
            if not 0 <= length <= len(body):
                return None
            fields += [(f"n{number}", order + item.count_code), (f"p{number}", order + item.code, length)]
            offset += np.dtype(item.count_code).itemsize + length * np.dtype(item.code).itemsize
        else:
            fields.append((f"p{number}", order + item.code))
            offset += np.dtype(item.code).itemsize
    dtype = np.dtype([entry if len(entry) == 2 else (entry[0], entry[1], (entry[2],)) for entry in fields])
    if element.count * dtype.itemsize > len(body):
        return None
    rows = np.frombuffer(body, dtype, element.count)
    for number, item in enumerate(element.properties):
        if item.count_code and not (rows[f"n{number}"] == rows[f"n{number}"][0]).all():
            return None
    return rows


def _split_rows(element: _Element, rows: NDArray[np.void]) -> PlyElement:
    columns: dict[str, Float64Array] = {}
    lists: dict[str, tuple[Int64Array, NDArray[Any]]] = {}
    for number, item in enumerate(element.properties):
        values = rows[f"p{number}"]
        if item.count_code:
            lists[item.name] = (rows[f"n{number}"].astype(np.int64), np.ascontiguousarray(values).reshape(-1))
        else:
            columns[item.name] = values.astype(np.float64)
    return PlyElement(element.count, columns, lists)


def _varied_rows(element: _Element, body: memoryview, order: str, file: str) -> tuple[PlyElement, int]:
    """Rows whose lists differ in length: one walk over the rows finds where everything lies."""
    count, kinds = element.count, element.properties
    places = np.zeros((len(kinds), count), np.int64)
    lengths = np.ones((len(kinds), count), np.int64)
    steps = [
        (
            np.dtype(item.code).itemsize,
            struct.Struct(order + STRUCT_CODES[item.count_code]) if item.count_code else None,
        )
        for item in kinds
    ]
    position = 0
    try:
        for row in range(count):
            for number, (size, counter) in enumerate(steps):
                length = 1
                if counter is not None:
                    length = int(counter.unpack_from(body, position)[0])
                    position += counter.size
                    if length < 0:
                        raise _truncated(element, file)
                    lengths[number, row] = length
                places[number, row] = position
                position += size * length
                if position > len(body):
                    raise _truncated(element, file)
    except (struct.error, ValueError, OverflowError):
        raise _truncated(element, file) from None
    raw = np.frombuffer(body, np.uint8)
    columns: dict[str, Float64Array] = {}
    lists: dict[str, tuple[Int64Array, NDArray[Any]]] = {}
    for number, item in enumerate(kinds):
        size = np.dtype(item.code).itemsize
        wanted = spread(places[number], lengths[number] * size)
        values = raw[wanted].view(order + item.code)
        if item.count_code:
            lists[item.name] = (lengths[number], values)
        else:
            columns[item.name] = values.astype(np.float64)
    return PlyElement(count, columns, lists), position
