"""Writing to a scene's side file: only what is asked for changes, every other line and comment stays.

The file is replaced whole or not at all, and only if what was written reads back as what was meant. An edit knows what
was there before, so that it can be taken back.
"""

from __future__ import annotations

import contextlib
import fnmatch
import os
import re
import tempfile
import tomllib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from bake.errors import SceneError, StorageError
from bake.scene.object_keys import check_keys
from bake.scene.side_file import SUFFIX, side_file_names
from bake.scene.toml_text import Edit, Statement, edited, key_edits, statements, toml_key, toml_value
from bake.settings import BakeSettings

Keys = Mapping[str, Any]
"""Values by key; None takes a key away."""
COPY_NAMES = ("of", "name")


@dataclass(frozen=True, slots=True)
class SideFileEdit:
    """One change of a side file.

    Attributes:
        path: The side file.
        before: Its content before; None if there was none.
        after: Its content since; None if there is none.
    """

    path: Path
    before: bytes | None
    after: bytes | None

    def reversed(self) -> SideFileEdit:
        """The edit that takes this one back."""
        return SideFileEdit(self.path, self.after, self.before)


def set_object_keys(scene: Path, match: str, keys: Keys) -> SideFileEdit:
    """Sets role and keys of the objects of one path or pattern; see `edit_side_file`."""
    return edit_side_file(scene, {match: keys})


def edit_side_file(
    scene: Path,
    objects: Mapping[str, Keys],
    bake: Keys | None = None,
    *,
    copies: Sequence[Keys] = (),
    without: Collection[str] = (),
) -> SideFileEdit:
    """Sets keys of objects and bake options in a scene's side file, which is made if there is none.

    An object's keys go to the `[[copy]]` that makes it, or to the last `[[object]]` of the same match; where a later
    pattern would overrule it, to a new one behind the last.

    Args:
        scene: The scene file.
        objects: Keys, role included, by path or pattern.
        bake: Options of the `[bake]` table by long name.
        copies: Tables of new `[[copy]]`s: `of`, `name` and keys.
        without: Paths of copies to take away, with what is said of exactly them.

    Returns:
        What was done; `apply_edit` of its `reversed()` takes it back.

    Raises:
        SceneError: a key or value that no side file may have, or a side file that cannot be read or edited.
        SettingsError: an option that no bake has.
        StorageError: the side file could not be written; it is as it was.
    """
    edit = plan_edit(scene, objects, bake, copies=copies, without=without)
    apply_edit(edit)
    return edit


def plan_edit(
    scene: Path,
    objects: Mapping[str, Keys],
    bake: Keys | None = None,
    *,
    copies: Sequence[Keys] = (),
    without: Collection[str] = (),
) -> SideFileEdit:
    """What `edit_side_file` would do, without doing it.

    Raises:
        SceneError, SettingsError: as there.
    """
    path, before = _current(scene)
    where = str(path)
    objects = {match: _plain(keys, f"{where}: {match}") for match, keys in objects.items()}
    options = dict(bake or {})
    BakeSettings.from_options({name: value for name, value in options.items() if value is not None})
    text = _decoded(before, where)
    newline = "\r\n" if "\r\n" in text else "\n"
    tables = _parsed(text, where)
    draft = _Draft(text if not text or text.endswith("\n") else text + newline, newline, tables, where)
    for match, keys in objects.items():
        draft.set_object(match, keys)
    for name in without:
        draft.remove_copy(name)
    for table in copies:
        keys = _plain({name: value for name, value in table.items() if name not in COPY_NAMES}, where)
        draft.add_copy({name: table[name] for name in COPY_NAMES} | keys)
    if options:
        draft.set_bake(options)
    text = draft.text()
    mark = b"\xef\xbb\xbf" if before is not None and before.startswith(b"\xef\xbb\xbf") else b""
    return SideFileEdit(path, before, mark + text.encode())


def apply_edit(edit: SideFileEdit) -> None:
    """Puts the content after an edit in the place of that before.

    Raises:
        StorageError: the file is no longer as it was before the edit, or could not be written; it stays as it is.
    """
    where = str(edit.path)
    try:
        found = edit.path.read_bytes() if edit.path.exists() else None
        if found != edit.before:
            raise StorageError(
                "the side file has been changed by another program since", where=where, remedy="make the change there"
            )
        if edit.after is None:
            edit.path.unlink()
        else:
            _replace(edit.path, edit.after)
    except OSError as error:
        raise StorageError(f"the side file could not be written ({error.strerror})", where=where) from error


def _replace(path: Path, content: bytes) -> None:
    path = path.resolve()  # what a link points to, not the link
    mode = path.stat().st_mode & 0o777 if path.exists() else None
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}-")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        if mode is None:
            mask = os.umask(0)
            os.umask(mask)
            mode = 0o666 & ~mask
        Path(name).chmod(mode)
        Path(name).replace(path)
    except BaseException:
        with contextlib.suppress(OSError):
            Path(name).unlink()
        raise


def _current(scene: Path) -> tuple[Path, bytes | None]:
    present = [scene.parent / name for name in side_file_names(scene) if (scene.parent / name).exists()]
    if len(present) > 1:
        names = " and ".join(path.name for path in present)
        raise SceneError(f"the scene has two side files, {names}", where=str(scene), remedy="remove one")
    if not present:
        return scene.parent / (scene.name + SUFFIX), None
    try:
        return present[0], present[0].read_bytes()
    except OSError as error:
        raise SceneError(f"the side file cannot be read: {error.strerror}", where=str(present[0])) from None


def _decoded(content: bytes | None, where: str) -> str:
    try:
        return (content or b"").decode("utf-8-sig")
    except UnicodeDecodeError:
        raise SceneError("the side file is no UTF-8 text", where=where, remedy="save it as UTF-8") from None


def _parsed(text: str, where: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as problem:
        raise SceneError(f"the side file is no TOML: {problem}", where=where) from None


def _plain(keys: Keys, where: str) -> dict[str, Any]:
    """Checked keys, enums as text."""
    checked = check_keys({name: value for name, value in keys.items() if value is not None}, where)
    return {name: None if name not in checked else _written(checked[name]) for name in keys}


def _written(value: Any) -> Any:
    if isinstance(value, tuple):
        return list(cast("Sequence[Any]", value))
    return str(value) if isinstance(value, str) else value


def _listed(value: Any) -> Any:
    return list(cast("Sequence[Any]", value)) if isinstance(value, list | tuple) else _written(value)


class _Draft:
    """A side file's text with the edits to come, and beside it what the file shall say once they are made."""

    def __init__(self, text: str, newline: str, tables: dict[str, Any], where: str) -> None:
        self._text, self._newline, self._where = text, newline, where
        self._wanted = tables
        found: Any = tables.get("object", [])
        if not isinstance(found, list) or not isinstance(tables.get("bake", {}), dict):
            raise self._unreadable()
        self._objects: list[dict[str, Any]] = [dict(table) for table in cast("list[dict[str, Any]]", found)]
        self._written_objects = len(self._objects)
        self._patterns = [re.compile(fnmatch.translate(str(table.get("match", "")))) for table in self._objects]
        copies: Any = tables.get("copy", [])
        if not isinstance(copies, list):
            raise self._unreadable()
        self._copies: list[dict[str, Any]] = [dict(table) for table in cast("list[dict[str, Any]]", copies)]
        self._removed: set[int] = set()
        self._blocks: dict[str, list[list[Statement]]] = {"object": [], "bake": [], "copy": []}
        inside: list[Statement] | None = None
        for statement in statements(text):
            if statement.is_header:
                inside = None
                if statement.table in self._blocks:
                    inside = []
                    self._blocks[statement.table].append(inside)
            if inside is not None:
                inside.append(statement)
        self._edits: list[Edit] = []
        self._new: list[str] = []
        self._new_copies: list[str] = []

    def set_object(self, match: str, keys: dict[str, Any]) -> None:
        """Sets keys of the objects of one path or pattern."""
        given = {name: value for name, value in keys.items() if value is not None}
        copy = self._copy_number(match)
        if copy >= 0:
            self._copies[copy] = {name: value for name, value in self._copies[copy].items() if name not in keys} | given
            self._edits += key_edits(self._text, self._blocks["copy"][copy], keys, self._newline)
            return
        number = self._target(match, keys)
        if number < 0:
            if given:
                self._objects.append({"match": match, **given})
                lines = ["[[object]]", f"match = {toml_value(match)}"]
                lines += [f"{toml_key(name)} = {toml_value(value)}" for name, value in given.items()]
                self._new.append(self._newline.join(lines) + self._newline)
            return
        if len(self._blocks["object"]) != self._written_objects:
            raise self._unreadable()
        table, block = self._objects[number], self._blocks["object"][number]
        self._objects[number] = {name: value for name, value in table.items() if name not in keys} | given
        if set(self._objects[number]) == {"match"} and not _has_comments(self._text, block):
            self._cut(block)
        else:
            self._edits += key_edits(self._text, block, keys, self._newline)

    def add_copy(self, table: dict[str, Any]) -> None:
        """Adds a copy of an object."""
        self._copies.append(table)
        lines = ["[[copy]]", *(f"{toml_key(name)} = {toml_value(value)}" for name, value in table.items())]
        self._new_copies.append(self._newline.join(lines) + self._newline)

    def remove_copy(self, path: str) -> None:
        """Takes a copy away, and what is said of exactly its path.

        Raises:
            SceneError: there is none.
        """
        number = self._copy_number(path)
        if number < 0:
            raise SceneError("no [[copy]] makes it", where=f"{self._where}: {path}", remedy="give it the role ignore")
        self._removed.add(number)
        self._cut(self._blocks["copy"][number])
        for number, table in enumerate(self._objects):
            if table.get("match") == path and number < self._written_objects:
                self._objects[number] = {"match": path}
                self._cut(self._blocks["object"][number])

    def _copy_number(self, path: str) -> int:
        """Which `[[copy]]` makes the object of a path; -1 if none does."""
        folder, _, name = path.rpartition("/")
        made = [(str(table.get("of")).rpartition("/")[0], table.get("name")) for table in self._copies]
        if (folder, name) not in made:
            return -1
        if len(self._blocks["copy"]) != len(self._copies) - len(self._new_copies):
            raise self._unreadable()
        return made.index((folder, name))

    def _cut(self, block: Sequence[Statement]) -> None:
        end = block[-1].end
        while self._text[end : end + len(self._newline)] == self._newline:
            end += len(self._newline)
        self._edits.append((block[0].begin, end, ""))

    def set_bake(self, options: dict[str, Any]) -> None:
        """Sets options of the bake."""
        given = {name: _listed(value) for name, value in options.items() if value is not None}
        former = cast("dict[str, Any]", self._wanted.get("bake", {}))
        self._wanted["bake"] = {name: value for name, value in former.items() if name not in options} | given
        if self._blocks["bake"]:
            values = {name: given.get(name) for name in options}
            self._edits += key_edits(self._text, self._blocks["bake"][0], values, self._newline)
        elif given:
            lines = ["[bake]", *(f"{toml_key(name)} = {toml_value(value)}" for name, value in given.items()), ""]
            self._edits.append((0, 0, self._newline.join(lines) + (self._newline if self._text else "")))

    def text(self) -> str:
        """The text with all edits.

        Raises:
            SceneError: it does not say what it shall.
        """
        if self._new:
            blocks = self._blocks["object"]
            end = blocks[-1][-1].end if blocks else len(self._text)
            gap = self._newline if end else ""
            self._edits.append((end, end, gap + self._newline.join(self._new)))
        if self._new_copies:
            blocks = self._blocks["copy"]
            end = blocks[-1][-1].end if blocks else len(self._text)
            gap = self._newline if end else ""
            self._edits.append((end, end, gap + self._newline.join(self._new_copies)))
        text = edited(self._text, self._edits)
        try:
            says = tomllib.loads(text)
        except tomllib.TOMLDecodeError:
            raise self._unreadable() from None
        copies = [table for number, table in enumerate(self._copies) if number not in self._removed]
        if _bare(says) != _bare({**self._wanted, "object": self._objects, "copy": copies}):
            raise self._unreadable()
        return text

    def _target(self, match: str, keys: Keys) -> int:
        """Index of the `[[object]]` to edit; -1 for a new one behind all."""
        same = [number for number, table in enumerate(self._objects) if table.get("match") == match]
        if not same:
            return -1
        name = match.rpartition("#")[0] or match
        for table, pattern in list(zip(self._objects, self._patterns, strict=False))[same[-1] + 1 :]:
            if set(table) & set(keys) and (pattern.match(match) or pattern.match(name)):
                return -1
        return same[-1]

    def _unreadable(self) -> SceneError:
        return SceneError(
            "its tables are written in a way that cannot be edited in place",
            where=self._where,
            remedy="write objects as [[object]] and options under [bake]",
        )


def _bare(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Tables without those that say nothing."""
    objects = [table for table in tables.get("object", []) if set(table) != {"match"}]
    rest = {
        name: value for name, value in tables.items() if name != "object" and (name not in ("bake", "copy") or value)
    }
    return {**rest, "object": objects}


def _has_comments(text: str, block: Sequence[Statement]) -> bool:
    inner = text[block[0].begin : block[-1].end]
    return any(statement.has_comment for statement in block) or any(
        line.lstrip().startswith("#") for line in inner.splitlines()
    )
