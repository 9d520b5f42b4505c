"""Checks of a region file's content: whatever is wrong ends as one line that names the region."""

from __future__ import annotations

import math
from typing import Any, cast

from bake.arrays import BoolArray
from bake.errors import SceneError
from bake.regions.region_document import HEX_DIGITS, FileLink, FileRegion, Point, RegionFile, bits_from_hex

_MOST_REGIONS = 100_000
_FARTHEST = 1e9  # metres: beyond, not even double precision tells a region's points apart


def checked(document: Any, where: str) -> RegionFile:
    """A region file from its parsed JSON.

    Args:
        document: Whatever `json.loads` gave.
        where: The file, for messages.

    Raises:
        SceneError: it says something that cannot be.
    """
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
            f"valid is not {HEX_DIGITS} hexadecimal digits", where=where, remedy="leave it out to have it found"
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
            shown = "missing" if value is None else str(cast("object", value))[:40]
            raise SceneError(f"{key} is {shown}", where=where, remedy="use three finite numbers in metres, [x, y, z]")


def _number(value: Any) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None
