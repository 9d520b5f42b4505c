"""The lines of a Wavefront OBJ file, sorted by keyword in runs.

Exporters write thousands of `v`, `vt`, `vn` and `f` lines in a row. Such a run is found with NumPy and kept as one
piece of text; only the few lines in between are looked at one by one.
"""

from __future__ import annotations

import codecs
import re
from dataclasses import dataclass, field

import numpy as np

from bake.errors import SceneError
from bake.types import Int64Array, UInt8Array

FREE_FORM = {b"curv", b"curv2", b"surf"}
OTHER, POSITIONS, TEXTURE_POINTS, NORMALS, FACES = range(5)
SPACES = np.zeros(256, np.bool_)
SPACES[[9, 11, 12, 13, 32]] = True


@dataclass(slots=True)
class LineBlock:
    """Lines of one keyword, without their comments, and how many they are."""

    pieces: list[bytes] = field(default_factory=list[bytes])
    count: int = 0

    def add(self, text: bytes, lines: int) -> None:
        """Appends a run of lines."""
        self.pieces.append(re.sub(rb"#[^\n]*", b"", text) if b"#" in text else text)
        self.count += lines

    def text(self) -> bytes:
        """All lines as one text."""
        return b"\n".join(self.pieces)


@dataclass(frozen=True, slots=True)
class FaceRun:
    """Consecutive faces and what was in force there.

    Attributes:
        count: Number of lines.
        object, material: Numbers of the (object, group) pair and of the material.
        behind: How many positions, texture points and normals had been read.
    """

    count: int
    object: int
    material: int
    behind: tuple[int, int, int]


@dataclass(slots=True)
class ObjLines:
    """An OBJ file's lines, sorted.

    Attributes:
        blocks: By keyword: POSITIONS, TEXTURE_POINTS, NORMALS, FACES.
        runs: The faces' runs, in order.
        objects: (object, group) names by number, in the order of their first face.
        materials: Material names by number; "" where none is in force.
        libraries: Names of material files.
        set_aside: Number of lines with points, lines or free-form surfaces.
    """

    blocks: dict[int, LineBlock] = field(
        default_factory=lambda: {kind: LineBlock() for kind in (POSITIONS, TEXTURE_POINTS, NORMALS, FACES)}
    )
    runs: list[FaceRun] = field(default_factory=list[FaceRun])
    objects: dict[tuple[str, str], int] = field(default_factory=dict[tuple[str, str], int])
    materials: dict[str, int] = field(default_factory=dict[str, int])
    libraries: list[str] = field(default_factory=list[str])
    set_aside: int = 0


def sort_lines(content: bytes, file: str) -> ObjLines:
    """Sorts the lines of an OBJ file.

    Raises:
        SceneError: text in a broken encoding.
    """
    content = _normalised(content, file)
    starts, ends, kinds = _classify(content)
    first_of_run = np.flatnonzero(np.concatenate(([True], kinds[1:] != kinds[:-1])))
    last_of_run = np.concatenate((first_of_run[1:], [len(kinds)])) - 1
    lines, state = ObjLines(), _State()
    for first, last in zip(first_of_run.tolist(), last_of_run.tolist(), strict=True):
        kind = int(kinds[first])
        if kind == OTHER:
            for number in range(first, last + 1):
                state.read(content[starts[number] : ends[number]], lines)
            continue
        count = last - first + 1
        if kind == FACES:
            lines.runs.append(state.face_run(count, lines))
        lines.blocks[kind].add(content[starts[first] : ends[last]], count)
    return lines


def _normalised(content: bytes, file: str) -> bytes:
    """UTF-8 with one statement a line, none of them indented."""
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        try:
            content = content.decode("utf-16").encode()
        except UnicodeDecodeError:
            raise SceneError("the file is no valid UTF-16 text", where=file, remedy="save it as UTF-8") from None
    content = content.removeprefix(codecs.BOM_UTF8)
    if b"\\" in content:  # a backslash at the end continues a line
        content = content.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ")
    if b"\r" in content and b"\n" not in content:
        content = content.replace(b"\r", b"\n")
    return re.sub(rb"(?m)^[ \t]+", b"", content) if re.search(rb"(?m)^[ \t]", content) else content


def _classify(content: bytes) -> tuple[Int64Array, Int64Array, UInt8Array]:
    """Begin, end and kind of every line."""
    symbols = np.frombuffer(content + b"\n\n\n", np.uint8)
    ends = np.flatnonzero(symbols[: len(content) + 1] == ord("\n"))
    starts = np.concatenate(([0], ends[:-1] + 1))
    first, second, third = (symbols[starts + offset] for offset in range(3))
    kinds = np.full(len(starts), OTHER, np.uint8)
    is_v = first == ord("v")
    kinds[is_v & SPACES[second]] = POSITIONS
    kinds[is_v & (second == ord("t")) & SPACES[third]] = TEXTURE_POINTS
    kinds[is_v & (second == ord("n")) & SPACES[third]] = NORMALS
    kinds[(first == ord("f")) & (SPACES[second] | (second == ord("\n")))] = FACES
    return starts, ends, kinds


class _State:
    """What the statements between the runs have set."""

    def __init__(self) -> None:
        self.object_name, self.group, self.material = "", "", ""

    def face_run(self, count: int, lines: ObjLines) -> FaceRun:
        key = (self.object_name, self.group)
        return FaceRun(
            count,
            lines.objects.setdefault(key, len(lines.objects)),
            lines.materials.setdefault(self.material, len(lines.materials)),
            (lines.blocks[POSITIONS].count, lines.blocks[TEXTURE_POINTS].count, lines.blocks[NORMALS].count),
        )

    def read(self, line: bytes, lines: ObjLines) -> None:
        keyword, _, rest = line.replace(b"\t", b" ").partition(b" ")
        match keyword.strip():
            case b"g":
                self.group = _name(rest)
            case b"o":
                self.object_name, self.group = _name(rest), ""
            case b"usemtl":
                self.material = _name(rest)
            case b"mtllib":
                lines.libraries.append(_name(rest))
            case b"l" | b"p":
                lines.set_aside += 1
            case other if other in FREE_FORM:
                lines.set_aside += 1
            case _:
                pass


def _name(rest: bytes) -> str:
    return " ".join(rest.decode("utf-8", "replace").split())
