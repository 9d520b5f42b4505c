"""The text of a Wavefront OBJ file → arrays, without a Python step per number.

One pass sorts the lines by keyword; numbers are then converted in bulk.
"""

from __future__ import annotations

import codecs
from dataclasses import dataclass, field

import numpy as np

from bake.errors import SceneError
from bake.types import Float64Array, Int64Array

FREE_FORM = {b"curv", b"curv2", b"surf", b"bzp", b"bsp", b"cdc", b"cdp", b"res"}


@dataclass(slots=True)
class ObjText:
    """What an OBJ file says, line by line gathered.

    Attributes:
        positions, texture_points, normals: Shapes (v, 3), (t, 2), (n, 3), float64.
        corner_counts: Shape (p,): corners of each polygon.
        corners: Shape (c, 3), int64: zero-based indices of position, texture point and normal; -1: none.
        polygon_object, polygon_material: Shape (p,), into the two lists below.
        objects: (object, group) names in the order of their first polygon.
        materials: Material names in the order of their first polygon; "" where none is in force.
        libraries: Names of material files.
        set_aside: Lines with points, lines or free-form surfaces.
    """

    positions: Float64Array
    texture_points: Float64Array
    normals: Float64Array
    corner_counts: Int64Array
    corners: Int64Array
    polygon_object: Int64Array
    polygon_material: Int64Array
    objects: list[tuple[str, str]]
    materials: list[str]
    libraries: list[str]
    set_aside: int


@dataclass(slots=True)
class _Lines:
    """Lines sorted by keyword, and what was in force at each polygon."""

    positions: list[bytes] = field(default_factory=list[bytes])
    texture_points: list[bytes] = field(default_factory=list[bytes])
    normals: list[bytes] = field(default_factory=list[bytes])
    faces: list[bytes] = field(default_factory=list[bytes])
    counts: list[tuple[int, int, int]] = field(default_factory=list[tuple[int, int, int]])
    objects: list[int] = field(default_factory=list[int])
    materials: list[int] = field(default_factory=list[int])
    object_names: dict[tuple[str, str], int] = field(default_factory=dict[tuple[str, str], int])
    material_names: dict[str, int] = field(default_factory=dict[str, int])
    libraries: list[str] = field(default_factory=list[str])
    set_aside: int = 0


def read_obj_text(content: bytes, file: str) -> ObjText:
    """Reads the text of an OBJ file.

    Raises:
        SceneError: a malformed number, or an index that names nothing.
    """
    lines = _sorted_lines(_as_utf8(content, file))
    positions = _numbers(lines.positions, 3, "v", file)
    texture_points = _numbers(lines.texture_points, 2, "vt", file)
    normals = _numbers(lines.normals, 3, "vn", file)
    names = list(lines.object_names)
    counts, corners = _corners(lines, (len(positions), len(texture_points), len(normals)), names, file)
    return ObjText(
        positions=positions,
        texture_points=texture_points,
        normals=normals,
        corner_counts=counts,
        corners=corners,
        polygon_object=np.array(lines.objects, np.int64),
        polygon_material=np.array(lines.materials, np.int64),
        objects=names,
        materials=list(lines.material_names),
        libraries=lines.libraries,
        set_aside=lines.set_aside,
    )


def _as_utf8(content: bytes, file: str) -> bytes:
    for mark, encoding in ((codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16")):
        if content.startswith(mark):
            try:
                content = content.decode(encoding).encode()
            except UnicodeDecodeError:
                raise SceneError("the file is no valid UTF-16 text", where=file, remedy="save it as UTF-8") from None
    content = content.removeprefix(codecs.BOM_UTF8)
    if b"\\" in content:  # a backslash at the end continues a line
        content = content.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ")
    return content


def _sorted_lines(content: bytes) -> _Lines:
    lines = _Lines()
    by_keyword = {b"v": lines.positions, b"vt": lines.texture_points, b"vn": lines.normals}
    object_name, group, material = "", "", ""
    for line in content.splitlines():
        parts = line.split(None, 1)
        if not parts:
            continue
        keyword, rest = parts[0], parts[1] if len(parts) > 1 else b""
        if keyword in by_keyword:
            by_keyword[keyword].append(rest)
        elif keyword == b"f":
            lines.faces.append(rest)
            lines.counts.append((len(lines.positions), len(lines.texture_points), len(lines.normals)))
            key = (object_name, group)
            lines.objects.append(lines.object_names.setdefault(key, len(lines.object_names)))
            lines.materials.append(lines.material_names.setdefault(material, len(lines.material_names)))
        elif keyword == b"g":
            group = _name(rest)
        elif keyword == b"o":
            object_name, group = _name(rest), ""
        elif keyword == b"usemtl":
            material = _name(rest)
        elif keyword == b"mtllib":
            lines.libraries.append(_name(rest))
        elif keyword in (b"l", b"p") or keyword in FREE_FORM:
            lines.set_aside += 1
    return lines


def _name(rest: bytes) -> str:
    return " ".join(rest.decode("utf-8", "replace").split())


def _without_comment(line: bytes) -> bytes:
    return line.partition(b"#")[0] if b"#" in line else line


def _numbers(lines: list[bytes], columns: int, keyword: str, file: str) -> Float64Array:
    """The first `columns` numbers of each line, shape (n, columns); missing texture coordinates are 0."""
    rows = [_without_comment(line).split(None, columns)[:columns] for line in lines]
    if columns == 2:
        rows = [row if len(row) == 2 else [*row, b"0", b"0"][:2] for row in rows]
    try:
        numbers = np.array([float(word) for row in rows for word in row], np.float64)
        return numbers.reshape(len(rows), columns)
    except ValueError:
        raise _bad_line(rows, columns, keyword, file) from None


def _bad_line(rows: list[list[bytes]], columns: int, keyword: str, file: str) -> SceneError:
    for number, row in enumerate(rows, start=1):
        try:
            fine = len([float(word) for word in row]) == columns
        except ValueError:
            fine = False
        if not fine:
            shown = " ".join(word.decode("utf-8", "replace")[:20] for word in row)
            return SceneError(
                f"{keyword} number {number} is {shown!r}, not {columns} numbers",
                where=file,
                remedy="repair or export the file again",
            )
    return SceneError(f"the {keyword} lines are malformed", where=file, remedy="export the file again")


def _corners(
    lines: _Lines, available: tuple[int, int, int], names: list[tuple[str, str]], file: str
) -> tuple[Int64Array, Int64Array]:
    """Corner counts per polygon and the corners' zero-based indices, -1 where one is not given."""
    words = [_without_comment(line).split() for line in lines.faces]
    counts = np.array([len(row) for row in words], np.int64)
    text = b" ".join(word for row in words for word in row)
    if not text:
        return counts, np.zeros((0, 3), np.int64)
    symbols = np.frombuffer(text + b" ", np.uint8)
    slashes = np.diff(np.cumsum(symbols == ord("/"))[symbols == ord(" ")], prepend=0)
    filled = (b" " + text + b" ").replace(b"//", b"/0/").replace(b"//", b"/0/").replace(b"/ ", b"/0 ")
    try:
        values = np.array([int(word) for word in filled.replace(b"/", b" ").split()], np.int64)
    except (ValueError, OverflowError):
        raise _bad_face(words, file) from None
    if slashes.max() > 2 or len(values) != len(slashes) + slashes.sum():
        raise _bad_face(words, file)
    start = np.cumsum(slashes + 1) - (slashes + 1)
    corners = np.zeros((len(slashes), 3), np.int64)
    corners[:, 0] = values[start]
    for column, given in ((1, slashes >= 1), (2, slashes == 2)):
        corners[given, column] = values[start[given] + column]
    polygon = np.repeat(np.arange(len(counts)), counts)
    behind = np.array(lines.counts, np.int64).reshape(-1, 3)[polygon]
    absolute = np.where(corners < 0, corners + behind, corners - 1)
    _check_range(absolute, corners, available, np.array(lines.objects)[polygon], names, file)
    return counts, absolute


def _check_range(
    absolute: Int64Array,
    stored: Int64Array,
    available: tuple[int, int, int],
    owners: Int64Array,
    names: list[tuple[str, str]],
    file: str,
) -> None:
    kinds = ("vertex", "texture point", "normal")
    for column, kind in enumerate(kinds):
        index = absolute[:, column]
        wrong = (index < 0) | (index >= available[column])
        if column > 0:
            wrong &= stored[:, column] != 0
        if wrong.any():
            corner = int(np.argmax(wrong))
            owner = "/".join(part for part in names[int(owners[corner])] if part)
            raise SceneError(
                f"a face refers to {kind} {stored[corner, column]} of {available[column]}",
                where=f"{file}: {owner}" if owner else file,
                remedy="repair or export the file again",
            )


def _bad_face(words: list[list[bytes]], file: str) -> SceneError:
    for number, row in enumerate(words, start=1):
        for word in row:
            fields = word.split(b"/")
            if len(fields) > 3 or not all(item.lstrip(b"+-").isdigit() or not item for item in fields):
                shown = word.decode("utf-8", "replace")[:40]
                return SceneError(
                    f"f number {number} has the corner {shown!r}", where=file, remedy="repair or export the file again"
                )
    return SceneError("the f lines are malformed", where=file, remedy="export the file again")
