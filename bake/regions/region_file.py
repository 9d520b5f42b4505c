"""Region files: boxes, links, seeds and validity bits as JSON, read and written.

    {"regions": [{"name": "hall", "min": [0, 0, 0], "max": [8, 3, 12], "seed": [4, 1, 6], "valid": "ff…"}],
     "links": [{"a": "hall", "b": "yard", "area": 2.2, "centre": [8, 1, 6]}],
     "seeds": [[0, 1, 0]]}

Everything is in world metres. Only `name`, `min` and `max` must be there. Without `links` those that boxes share are
found; a link without `area` and `centre` has them measured. `valid` holds a region's 512 bits as 128 hexadecimal
digits, the first point's bit first. A file with `seeds` instead of `regions` asks for automatic regions around these
points.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from bake.arrays import BoolArray
from bake.errors import SceneError, StorageError
from bake.region_types import GRID, RegionGraph
from bake.types import Float64Array, RegionBox

Point = tuple[float, float, float]

_HEX_DIGITS = GRID**3 // 4
_MOST_REGIONS = 100_000
_FARTHEST = 1e9  # metres: beyond, not even double precision tells a region's points apart


@dataclass(frozen=True, slots=True)
class FileRegion:
    """One region as a file states it; None: not said.

    Attributes:
        name: Unique in the file.
        minimum, maximum: World metres.
        seed: A point in its free space, world metres.
        valid: Shape (GRID³,), bool.
    """

    name: str
    minimum: Point
    maximum: Point
    seed: Point | None = None
    valid: BoolArray | None = None


@dataclass(frozen=True, slots=True)
class FileLink:
    """One link as a file states it; None: to be measured.

    Attributes:
        a, b: Names of two regions of the file.
        area: Square metres of boundary.
        centre: Its middle, world metres.
    """

    a: str
    b: str
    area: float | None = None
    centre: Point | None = None


@dataclass(frozen=True, slots=True)
class RegionFile:
    """A checked region file.

    Attributes:
        where: The file, for messages.
        regions: In the file's order.
        links: None where the file has no `links`: they are to be found.
        seeds: Where automatic regions shall begin, world metres; only without `regions`.
    """

    where: str
    regions: tuple[FileRegion, ...]
    links: tuple[FileLink, ...] | None = None
    seeds: tuple[Point, ...] = ()


def from_boxes(boxes: Sequence[RegionBox], where: str) -> RegionFile:
    """What a side file's regions say, as if they stood in a region file."""
    return RegionFile(where, tuple(FileRegion(box.name, box.minimum, box.maximum) for box in boxes))


def read_region_file(path: Path) -> RegionFile:
    """Reads and checks a region file.

    Raises:
        SceneError: it is missing, no JSON, or says something that cannot be; the message names the region.
    """
    where = str(path)
    document = _parse(path)
    if not isinstance(document, dict):
        raise SceneError("the region file is no JSON object", where=where, remedy='write {"regions": [...]}')
    table = cast("dict[str, Any]", document)
    _check_keys(table, ("regions", "links", "seeds"), where)
    seeds = tuple(_point(value, "seed", f"{where}: seeds[{i}]") for i, value in enumerate(_list(table, "seeds", where)))
    if not seeds and "regions" not in table:
        raise SceneError("it has neither regions nor seeds", where=where, remedy='write {"regions": [...]}')
    if seeds and table.get("regions"):
        raise SceneError(
            "it has both regions and seeds", where=where, remedy="seeds ask for automatic regions: drop one"
        )
    regions = _regions(_list(table, "regions", where), where)
    links = _links(_list(table, "links", where), regions, where) if table.get("links") is not None else None
    return RegionFile(where, regions, links, seeds)


def write_region_file(path: Path, graph: RegionGraph, *, origin: Float64Array, valid: BoolArray | None = None) -> None:
    """Writes regions, seeds and links, so that `read_region_file` and a bake give them again.

    Args:
        path: Replaced as a whole, or not at all.
        graph: Relative to `origin`.
        origin: `World.origin`, shape (3,).
        valid: Shape (r · GRID³,), bool: which points count, written if given.

    Raises:
        StorageError: the file cannot be written.
    """
    regions: list[dict[str, Any]] = []
    for number, name in enumerate(graph.names):
        entry: dict[str, Any] = {
            "name": name,
            "min": (graph.minimum[number] + origin).tolist(),
            "max": (graph.maximum[number] + origin).tolist(),
            "seed": (graph.seed[number] + origin).tolist(),
        }
        if valid is not None:
            entry["valid"] = bits_to_hex(valid[number * GRID**3 : (number + 1) * GRID**3])
        regions.append(entry)
    links = [
        {"a": graph.names[a], "b": graph.names[b], "area": float(area), "centre": (centre + origin).tolist()}
        for (a, b), area, centre in zip(graph.link.tolist(), graph.link_area, graph.link_centre, strict=True)
    ]
    text = json.dumps({"regions": regions, "links": links}, indent=1, ensure_ascii=False) + "\n"
    temporary = path.with_name(path.name + ".part")
    try:
        temporary.write_text(text, encoding="utf-8")
        temporary.replace(path)
    except OSError as problem:
        raise StorageError(f"the region file cannot be written: {problem.strerror}", where=str(path)) from None


def bits_to_hex(valid: BoolArray) -> str:
    """512 bits as 128 hexadecimal digits, the first point's bit first."""
    return np.packbits(valid.astype(np.bool_)).tobytes().hex()


def bits_from_hex(digits: str) -> BoolArray:
    """The reverse of `bits_to_hex`, shape (GRID³,).

    Raises:
        ValueError: these are not 128 hexadecimal digits.
    """
    if len(digits) != _HEX_DIGITS:
        raise ValueError(f"{len(digits)} digits")
    return np.unpackbits(np.frombuffer(bytes.fromhex(digits), np.uint8)).astype(np.bool_)


def _parse(path: Path) -> Any:
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise SceneError("the region file is missing", where=str(path), remedy="check the path") from None
    except (OSError, ValueError) as problem:
        reason = problem.strerror if isinstance(problem, OSError) and problem.strerror else str(problem)
        raise SceneError(f"the region file cannot be read: {reason}", where=str(path)) from None
    try:
        return json.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError:
        raise SceneError("the region file is no UTF-8 text", where=str(path), remedy="save it as UTF-8") from None
    except (ValueError, RecursionError) as problem:
        raise SceneError(f"the region file is no JSON: {problem}", where=str(path)) from None


def _regions(items: list[Any], where: str) -> tuple[FileRegion, ...]:
    if len(items) > _MOST_REGIONS:
        raise SceneError(f"{len(items):,} regions", where=where, remedy=f"use at most {_MOST_REGIONS:,}")
    regions: list[FileRegion] = []
    names: set[str] = set()
    for number, item in enumerate(items):
        here = f"{where}: regions[{number}]"
        if not isinstance(item, dict):
            raise SceneError("it is no object", where=here, remedy='write {"name": ..., "min": ..., "max": ...}')
        table = cast("dict[str, Any]", item)
        _check_keys(table, ("name", "min", "max", "seed", "valid"), here)
        name = table.get("name")
        if not isinstance(name, str) or not name:
            raise SceneError("it has no name", where=here, remedy='write "name": "hall"')
        here = f"{here} ({name[:60]})"
        if name in names:
            raise SceneError("a second region has this name", where=here, remedy="rename one")
        names.add(name)
        minimum, maximum = (_point(table.get(key), key, here) for key in ("min", "max"))
        if not all(low < high for low, high in zip(minimum, maximum, strict=True)):
            raise SceneError("min is not below max on every axis", where=here, remedy="swap what is reversed")
        seed = None if table.get("seed") is None else _point(table["seed"], "seed", here)
        if seed is not None and not all(
            low <= at <= high for low, at, high in zip(minimum, seed, maximum, strict=True)
        ):
            raise SceneError("its seed lies outside its box", where=here, remedy="move the seed, or leave it out")
        regions.append(FileRegion(name, minimum, maximum, seed, _valid(table.get("valid"), here)))
    return tuple(regions)


def _valid(value: Any, where: str) -> BoolArray | None:
    if value is None:
        return None
    try:
        return bits_from_hex(value if isinstance(value, str) else "")
    except ValueError:
        raise SceneError(
            f"valid is not {_HEX_DIGITS} hexadecimal digits", where=where, remedy="leave it out to have it found"
        ) from None


def _links(items: list[Any], regions: tuple[FileRegion, ...], where: str) -> tuple[FileLink, ...]:
    names = {region.name for region in regions}
    links: list[FileLink] = []
    seen: set[frozenset[str]] = set()
    for number, item in enumerate(items):
        here = f"{where}: links[{number}]"
        if not isinstance(item, dict):
            raise SceneError("it is no object", where=here, remedy='write {"a": ..., "b": ...}')
        table = cast("dict[str, Any]", item)
        _check_keys(table, ("a", "b", "area", "centre"), here)
        ends: list[str] = []
        for key in ("a", "b"):
            name = table.get(key)
            if not isinstance(name, str) or name not in names:
                raise SceneError(
                    f"{key} is {str(name)[:60]!r}, which is no region", where=here, remedy="name one of the regions"
                )
            ends.append(name)
        here = f"{here} ({ends[0][:40]} - {ends[1][:40]})"
        if ends[0] == ends[1]:
            raise SceneError("it links a region with itself", where=here, remedy="remove it")
        if frozenset(ends) in seen:
            raise SceneError("a second link joins the same regions", where=here, remedy="remove one")
        seen.add(frozenset(ends))
        area = None if table.get("area") is None else _number(table["area"])
        if table.get("area") is not None and (area is None or not 0.0 < area <= _FARTHEST**2):
            raise SceneError(f"area is {str(table['area'])[:40]}", where=here, remedy="use square metres above 0")
        centre = None if table.get("centre") is None else _point(table["centre"], "centre", here)
        links.append(FileLink(ends[0], ends[1], area, centre))
    return tuple(links)


def _list(table: dict[str, Any], key: str, where: str) -> list[Any]:
    value: Any = table.get(key)
    if value is None:
        return []
    if not isinstance(value, list):
        raise SceneError(f"{key} is no list", where=where, remedy=f'write "{key}": [...]')
    return cast("list[Any]", value)


def _check_keys(table: dict[str, Any], known: tuple[str, ...], where: str) -> None:
    for key in table:
        if key not in known:
            raise SceneError(f"unknown key {key[:40]!r}", where=where, remedy=f"known: {', '.join(known)}")


def _point(value: Any, key: str, where: str) -> Point:
    items: list[Any] = cast("list[Any]", value) if isinstance(value, list) else []
    numbers = [_number(item) for item in items]
    match numbers:
        case [float(x), float(y), float(z)]:
            if max(abs(x), abs(y), abs(z)) > _FARTHEST:
                raise SceneError(f"{key} lies beyond {_FARTHEST:g} m", where=where, remedy="are these metres?")
            return x, y, z
        case _:
            shown = "missing" if value is None else str(value)[:40]
            raise SceneError(f"{key} is {shown}", where=where, remedy="use three finite numbers in metres, [x, y, z]")


def _number(value: Any) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None
