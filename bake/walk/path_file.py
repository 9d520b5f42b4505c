"""Paths as files: JSON or CSV, in world metres.

JSON is a list of points `[[x, y, z], …]`, or an object with `points`, or with `pieces`: a list of such lists, between
which the character teleports. CSV has three numbers a line, perhaps under a header that names columns x, y and z among
others; an empty line begins a new piece. So the CSV that a walk writes can be walked again.
"""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import Any, cast

import numpy as np

from bake.errors import InputError
from bake.types import Float64Array
from bake.walk.path import path_in_pieces
from bake.walk.types import WalkPath

MOST_POINTS = 1_000_000

Piece = list[list[float]]


def read_path(file: Path, *, origin: Float64Array) -> WalkPath:
    """Reads a path.

    Args:
        file: Its suffix decides: .json, else CSV.
        origin: `World.origin`, shape (3,), that the points are to be relative to.

    Raises:
        InputError: it cannot be read, or is no path; the message names the place in the file.
    """
    try:
        text = file.read_text(encoding="utf-8-sig")
    except OSError as problem:
        raise InputError(f"the path cannot be read: {problem.strerror}", where=str(file)) from None
    except UnicodeDecodeError:
        raise InputError("the path is no UTF-8 text", where=str(file), remedy="save it as UTF-8") from None
    pieces = _from_json(text, str(file)) if file.suffix.lower() == ".json" else _from_csv(text, str(file))
    if sum(map(len, pieces)) > MOST_POINTS:
        raise InputError(f"more than {MOST_POINTS:,} points", where=str(file), remedy="thin the path out")
    return path_in_pieces([np.array(piece, np.float64).reshape(-1, 3) - origin for piece in pieces], where=str(file))


def _from_json(text: str, where: str) -> list[Piece]:
    try:
        content: Any = json.loads(text)
    except (ValueError, RecursionError) as problem:
        raise InputError(f"the path is no JSON: {problem}", where=where) from None
    if isinstance(content, dict):
        table = cast("dict[str, Any]", content)
        if "pieces" in table:
            return [_points(piece, f"{where}: pieces[{i}]") for i, piece in enumerate(_list(table["pieces"], where))]
        content = table.get("points")
    return [_points(content, where)]


def _points(content: Any, where: str) -> Piece:
    points: Piece = []
    for number, item in enumerate(_list(content, where)):
        numbers = _list(item, f"{where}: point {number}")
        if len(numbers) != 3 or not all(isinstance(n, int | float) and not isinstance(n, bool) for n in numbers):
            raise InputError(f"point {number} is not three numbers", where=where, remedy="write [x, y, z]")
        try:
            points.append([float(n) for n in numbers])
        except OverflowError:
            raise InputError(f"point {number} is not finite", where=where, remedy="remove it") from None
    return points


def _list(content: Any, where: str) -> list[Any]:
    if not isinstance(content, list):
        raise InputError("a path is a list of points", where=where, remedy="write [[x, y, z], …]")
    return cast("list[Any]", content)


def _rows(text: str, where: str) -> list[list[str]]:
    try:
        return list(csv.reader(io.StringIO(text)))
    except csv.Error as problem:
        raise InputError(f"the path is no CSV: {problem}", where=where) from None


def _from_csv(text: str, where: str) -> list[Piece]:
    pieces: list[Piece] = [[]]
    columns = (0, 1, 2)
    for number, row in enumerate(_rows(text, where), 1):
        cells = [cell.strip() for cell in row]
        if not any(cells):
            if pieces[-1]:
                pieces.append([])
            continue
        names = [cell.lower() for cell in cells]
        if number == 1 and all(axis in names for axis in "xyz"):
            columns = (names.index("x"), names.index("y"), names.index("z"))
            continue
        try:
            pieces[-1].append([float(cells[column]) for column in columns])
        except (ValueError, IndexError):
            raise InputError(f"line {number} is not three numbers", where=where, remedy="write x,y,z") from None
    return [piece for piece in pieces if piece]
