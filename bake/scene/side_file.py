"""The side file `SCENE.obscura.toml`: what a level's author says about the scene without touching it.

For `level.glb` it is called `level.obscura.toml` or `level.glb.obscura.toml`.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

from bake.errors import SceneError
from bake.scene.files import FileLedger
from bake.scene.object_keys import check_keys, finite_number, nearest
from bake.types import RegionBox

SUFFIX = ".obscura.toml"
TABLES = ("bake", "object", "copy", "region")


@dataclass(frozen=True, slots=True)
class ObjectRule:
    """One `[[object]]`: what holds for every object whose path matches.

    Attributes:
        match: Glob over node paths.
        keys: Checked role and keys.
    """

    match: str
    keys: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class CopyRule:
    """One `[[copy]]`: an object that the scene file does not have itself.

    Attributes:
        of: Path of the original.
        path: Its own path: beside the original, by its name.
        keys: Checked role and keys.
    """

    of: str
    path: str
    keys: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class SideFile:
    """A checked side file; without one, all is empty.

    Attributes:
        name: The file's name, for messages.
        bake_options: The `[bake]` table, not validated here: `BakeSettings.from_options` does that.
        rules: In the file's order; later ones win.
        regions: The `[[region]]`s.
        copies: The `[[copy]]`s, in the file's order.
    """

    name: str = ""
    bake_options: Mapping[str, Any] = field(default_factory=dict[str, Any])
    rules: tuple[ObjectRule, ...] = ()
    regions: tuple[RegionBox, ...] = ()
    copies: tuple[CopyRule, ...] = ()


def side_file_names(scene: Path) -> tuple[str, str]:
    """The two names that the side file of `scene` may have."""
    return scene.stem + SUFFIX, scene.name + SUFFIX


def read_bake_options(scene: Path) -> tuple[Mapping[str, Any], str]:
    """The `[bake]` table of a scene's side file, and the side file's name; both empty without one.

    Cheap: nothing but the side file is read. Some options, such as the crease angle, matter while a scene is loaded.

    Raises:
        SceneError: as `read_side_file`.
    """
    side_file = read_side_file(FileLedger(scene))
    return side_file.bake_options, side_file.name


def read_side_file(ledger: FileLedger) -> SideFile:
    """Reads and checks the side file of a scene, if there is one.

    Raises:
        SceneError: no TOML, unknown tables or keys (the nearest known one is named), wrong types or values.
    """
    contents = {name: ledger.read_if_present(name, what="the side file") for name in side_file_names(ledger.scene)}
    present = [name for name, content in contents.items() if content is not None]
    if not present:
        return SideFile()
    if len(present) > 1:
        raise SceneError(
            f"the scene has two side files, {' and '.join(present)}", where=str(ledger.scene), remedy="remove one"
        )
    where = str(ledger.folder / present[0])
    tables = _parse_toml(contents[present[0]] or b"", where)
    for name in tables:
        if name not in TABLES:
            raise SceneError(f"unknown table [{name}]", where=where, remedy=nearest(name, TABLES))
    options: Any = tables.get("bake", {})
    if not isinstance(options, dict):
        raise SceneError("bake is no table", where=where, remedy="write [bake]")
    return SideFile(
        name=present[0],
        bake_options=cast("dict[str, Any]", options),
        rules=tuple(_rule(item, f"{where}: {place}") for item, place in _tables(tables, "object", where)),
        regions=_regions(_tables(tables, "region", where), where),
        copies=tuple(_copy(item, f"{where}: {place}") for item, place in _tables(tables, "copy", where)),
    )


def _parse_toml(content: bytes, where: str) -> dict[str, Any]:
    try:
        return tomllib.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError:
        raise SceneError("the side file is no UTF-8 text", where=where, remedy="save it as UTF-8") from None
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as problem:
        raise SceneError(f"the side file is no TOML: {problem}", where=where) from None


def _tables(tables: Mapping[str, Any], name: str, where: str) -> list[tuple[dict[str, Any], str]]:
    found: Any = tables.get(name, [])
    items: list[Any] = cast("list[Any]", found) if isinstance(found, list) else [None]
    if not all(isinstance(item, dict) for item in items):
        raise SceneError(f"{name} is no list of tables", where=where, remedy=f"write [[{name}]]")
    return [(item, f"[[{name}]] number {number}") for number, item in enumerate(items, start=1)]


def _rule(table: dict[str, Any], where: str) -> ObjectRule:
    match = table.get("match")
    if not isinstance(match, str) or not match:
        raise SceneError("it has no match", where=where, remedy='write match = "Level/Trees/*"')
    keys = {name: value for name, value in table.items() if name != "match"}
    return ObjectRule(match, check_keys(keys, f"{where} ({match})"))


def _copy(table: dict[str, Any], where: str) -> CopyRule:
    of, name = table.get("of"), table.get("name")
    if not isinstance(of, str) or not of:
        raise SceneError("it has no of", where=where, remedy='write of = "Level/Props/barrel"')
    if not isinstance(name, str) or not name or "/" in name:
        raise SceneError("it has no name of its own", where=where, remedy='write name = "barrel_copy", without /')
    keys = {key: value for key, value in table.items() if key not in ("of", "name")}
    folder, slash, _ = of.rpartition("/")
    return CopyRule(of, folder + slash + name, check_keys(keys, f"{where} ({name})"))


def _regions(tables: list[tuple[dict[str, Any], str]], where: str) -> tuple[RegionBox, ...]:
    regions: list[RegionBox] = []
    for table, place in tables:
        here = f"{where}: {place}"
        for key in table:
            if key not in ("name", "min", "max"):
                raise SceneError(f"unknown key {key!r}", where=here, remedy=nearest(key, ("name", "min", "max")))
        name = table.get("name")
        if not isinstance(name, str) or not name:
            raise SceneError("it has no name", where=here, remedy='write name = "hall"')
        if any(region.name == name for region in regions):
            raise SceneError(f"a second region is called {name!r}", where=here, remedy="rename one")
        minimum, maximum = (_point(table.get(key), key, here) for key in ("min", "max"))
        if not all(low < high for low, high in zip(minimum, maximum, strict=True)):
            raise SceneError("min is not below max on every axis", where=here, remedy="swap what is reversed")
        regions.append(RegionBox(name, minimum, maximum))
    return tuple(regions)


def _point(value: Any, key: str, where: str) -> tuple[float, float, float]:
    items: list[Any] = cast("list[Any]", value) if isinstance(value, list) else []
    numbers: list[float | None] = [finite_number(item) for item in items]
    match numbers:
        case [float(x), float(y), float(z)]:
            return x, y, z
        case _:
            shown = str(items or "missing")[:40]
            raise SceneError(f"{key} is {shown}", where=where, remedy="use three numbers in metres, [x, y, z]")
