"""The text of a Wavefront OBJ file → arrays, converted in bulk."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from bake.errors import SceneError
from bake.scene.obj_lines import FACES, NORMALS, POSITIONS, SPACES, TEXTURE_POINTS, LineBlock, ObjLines, sort_lines
from bake.types import Float64Array, Int64Array

WITHOUT_SIGNS = bytes.maketrans(b"f/", b"  ")


@dataclass(slots=True)
class ObjText:
    """What an OBJ file says.

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


def read_obj_text(content: bytes, file: str) -> ObjText:
    """Reads the text of an OBJ file.

    Raises:
        SceneError: a malformed number, or an index that names nothing.
    """
    lines = sort_lines(content, file)
    positions = _numbers(lines.blocks[POSITIONS], 3, "v", file)
    texture_points = _numbers(lines.blocks[TEXTURE_POINTS], 2, "vt", file)
    normals = _numbers(lines.blocks[NORMALS], 3, "vn", file)
    counts, corners = _corners(lines, (len(positions), len(texture_points), len(normals)), file)
    repeats = [run.count for run in lines.runs]
    return ObjText(
        positions=positions,
        texture_points=texture_points,
        normals=normals,
        corner_counts=counts,
        corners=corners,
        polygon_object=np.repeat(np.array([run.object for run in lines.runs], np.int64), repeats),
        polygon_material=np.repeat(np.array([run.material for run in lines.runs], np.int64), repeats),
        objects=list(lines.objects),
        materials=list(lines.materials),
        libraries=lines.libraries,
        set_aside=lines.set_aside,
    )


def _numbers(block: LineBlock, columns: int, keyword: str, file: str) -> Float64Array:
    """The first `columns` numbers of each line, shape (n, columns); missing texture coordinates are 0."""
    text = block.text()
    words = text.split()
    width = columns + 1
    if len(words) != width * block.count or words[::width].count(keyword.encode()) != block.count:
        rows = [(line.split()[1:] + ([b"0", b"0"] if columns == 2 else []))[:columns] for line in text.splitlines()]
        words = [word for row in rows for word in row]
    else:
        del words[::width]
    try:
        return np.array([float(word) for word in words], np.float64).reshape(block.count, columns)
    except ValueError:
        raise _bad_line(text, columns, keyword, file) from None


def _bad_line(text: bytes, columns: int, keyword: str, file: str) -> SceneError:
    for number, line in enumerate(text.splitlines(), start=1):
        row = line.split()[1 : 1 + columns]
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


def _corners(lines: ObjLines, available: tuple[int, int, int], file: str) -> tuple[Int64Array, Int64Array]:
    """Corner counts per polygon and the corners' zero-based indices, -1 where one is not given."""
    block = lines.blocks[FACES]
    if block.count == 0:
        return np.zeros(0, np.int64), np.zeros((0, 3), np.int64)
    text = block.text()
    counts, slashes = _corner_forms(text, block.count)
    filled = re.sub(rb"/(?=/|\s|$)", b"/0", text) if re.search(rb"/(/|\s|$)", text) else text
    try:
        values = np.array([int(word) for word in filled.translate(WITHOUT_SIGNS).split()], np.int64)
    except (ValueError, OverflowError):
        raise _bad_face(text, file) from None
    if len(slashes) == 0:
        return counts, np.zeros((0, 3), np.int64)
    if slashes.max() > 2 or len(values) != len(slashes) + slashes.sum() or text.count(b"f") != block.count:
        raise _bad_face(text, file)
    start = np.cumsum(slashes + 1) - (slashes + 1)
    stored = np.zeros((len(slashes), 3), np.int64)
    stored[:, 0] = values[start]
    for column, given in ((1, slashes >= 1), (2, slashes == 2)):
        stored[given, column] = values[start[given] + column]
    run_of_corner = np.repeat(np.repeat(np.arange(len(lines.runs)), [run.count for run in lines.runs]), counts)
    behind = np.array([run.behind for run in lines.runs], np.int64)
    absolute = np.where(stored < 0, stored + behind[run_of_corner], stored - 1)
    _check_range(absolute, stored, available, run_of_corner, lines, file)
    return counts, absolute


def _corner_forms(text: bytes, line_count: int) -> tuple[Int64Array, Int64Array]:
    """Corners of each `f` line, and slashes of each corner."""
    symbols = np.frombuffer(text, np.uint8)
    newline = symbols == ord("\n")
    blank = SPACES[symbols] | newline
    word_starts = np.flatnonzero(~blank & np.concatenate(([True], blank[:-1])))
    line_of_word = np.searchsorted(np.flatnonzero(newline), word_starts)
    is_keyword = np.concatenate(([True], line_of_word[1:] != line_of_word[:-1]))
    slashes = np.add.reduceat(symbols == ord("/"), word_starts, dtype=np.int64)[~is_keyword]
    return np.bincount(line_of_word, minlength=line_count) - 1, slashes


def _check_range(
    absolute: Int64Array,
    stored: Int64Array,
    available: tuple[int, int, int],
    run_of_corner: Int64Array,
    lines: ObjLines,
    file: str,
) -> None:
    for column, kind in enumerate(("vertex", "texture point", "normal")):
        index = absolute[:, column]
        wrong = (index < 0) | (index >= available[column])
        if column > 0:
            wrong &= stored[:, column] != 0
        if wrong.any():
            corner = int(np.argmax(wrong))
            names = list(lines.objects)[lines.runs[int(run_of_corner[corner])].object]
            owner = "/".join(part for part in names if part)
            raise SceneError(
                f"a face refers to {kind} {stored[corner, column]} of {available[column]}",
                where=f"{file}: {owner}" if owner else file,
                remedy="repair or export the file again",
            )


def _bad_face(text: bytes, file: str) -> SceneError:
    for number, line in enumerate(text.splitlines(), start=1):
        for word in line.split()[1:]:
            fields = word.split(b"/")
            if len(fields) > 3 or not all(re.fullmatch(rb"([+-]?\d{1,18})?", item) for item in fields):
                shown = word.decode("utf-8", "replace")[:40]
                return SceneError(
                    f"f number {number} has the corner {shown!r}", where=file, remedy="repair or export the file again"
                )
    return SceneError("the f lines are malformed", where=file, remedy="export the file again")
