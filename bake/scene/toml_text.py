"""TOML as text that people wrote: found statement by statement, so that an edit leaves every other line as it is."""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

_TOKEN = re.compile(
    r'"""(?:\\.|[^\\])*?"{3,5}'
    r"|'''.*?'{3,5}"
    r'|"(?:\\.|[^"\\\n])*"'
    r"|'[^'\n]*'"
    r"|\#[^\n]*"
    r"|[\[\]{}=\n]"
    r"|[^\[\]{}=\n\"'\#]+|.",
    re.DOTALL,
)


@dataclass(frozen=True, slots=True)
class Statement:
    """One key with its value, or one table header, with where it stands in the text.

    Attributes:
        table: Name of the table that it belongs to or opens, dots between its parts; empty at the top.
        key: Its key; empty for a header and for a dotted key.
        is_header: Whether it opens a table.
        begin, end: Its lines, the line break included.
        value_begin, value_end: Its value; both equal `end` for a header.
        has_comment: Whether a comment follows on its line.
    """

    table: str
    key: str
    is_header: bool
    begin: int
    end: int
    value_begin: int
    value_end: int
    has_comment: bool


def statements(text: str) -> list[Statement]:
    """The statements of a TOML text, in order; blank lines and lines of comment are none.

    Args:
        text: Must be valid TOML.
    """
    found: list[Statement] = []
    table, begin, depth = "", 0, 0
    equals, last, comment = -1, -1, False  # where the value begins and what precedes a trailing comment ends
    for token in _TOKEN.finditer(text + "\n"):
        word = token.group()
        if word == "\n" and depth == 0:
            end = min(token.end(), len(text))
            if last >= 0:
                statement = _statement(text, table, begin, end, equals, last, comment)
                table = statement.table
                found.append(statement)
            begin, equals, last, comment = token.end(), -1, -1, False
        elif word.startswith("#"):
            comment = comment or depth == 0
        else:
            depth += (word in "[{") - (word in "]}")
            if word == "=" and depth == 0 and equals < 0:
                equals = token.end()
            if word.strip():
                last = token.start() + len(word.rstrip())
    return found


def _statement(text: str, table: str, begin: int, end: int, equals: int, last: int, comment: bool) -> Statement:
    if equals < 0:
        names: list[str] = []
        inner: object = tomllib.loads(text[begin:last])
        while inner:
            if isinstance(inner, list):
                inner = cast("list[object]", inner)[0]
                continue
            names += list(cast("dict[str, object]", inner))
            inner = cast("dict[str, object]", inner)[names[-1]]
        return Statement(".".join(names), "", True, begin, end, end, end, comment)
    while equals < last and text[equals] in " \t":
        equals += 1
    named = tomllib.loads(text[begin:equals] + " 0")
    key = next(iter(named))
    plain = not isinstance(named[key], dict)
    return Statement(table, key if plain else "", False, begin, end, equals, last, comment)


Edit = tuple[int, int, str]
"""Where a piece of text begins and ends, and what takes its place."""


def key_edits(text: str, block: Sequence[Statement], values: Mapping[str, Any], newline: str) -> list[Edit]:
    """The edits that set keys of one table, in place where they are there, behind the others where they are not.

    Args:
        text: All of the text; it ends with a line break.
        block: The table's statements, its header first.
        values: New values by key; None takes the key away, and keeps the comment behind it.
        newline: What ends a line.
    """
    edits: list[Edit] = []
    known = {statement.key: statement for statement in block if statement.key}
    added: list[str] = []
    head = text[block[0].begin : block[0].end]
    indent = head[: len(head) - len(head.lstrip(" \t"))]
    for key, value in values.items():
        statement = known.get(key)
        if statement is not None and value is None:
            kept = text[statement.value_end : statement.end].lstrip() if statement.has_comment else ""
            edits.append((statement.begin, statement.end, kept))
        elif statement is not None:
            edits.append((statement.value_begin, statement.value_end, toml_value(value)))
        elif value is not None:
            added.append(f"{indent}{toml_key(key)} = {toml_value(value)}{newline}")
    if added:
        edits.append((block[-1].end, block[-1].end, "".join(added)))
    return edits


def edited(text: str, edits: Iterable[Edit]) -> str:
    """The text with all edits made; of several at one place, the earlier ones stand first."""
    pieces: list[str] = []
    end = 0
    for begin, stop, replacement in sorted(edits, key=lambda edit: (edit[0], edit[1])):
        pieces += [text[end:begin], replacement]
        end = stop
    return "".join([*pieces, text[end:]])


def toml_key(key: str) -> str:
    """A key as TOML writes it."""
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else toml_value(key)


def toml_value(value: Any) -> str:
    """A value as TOML writes it.

    Args:
        value: Text, number, truth value, or a list of such.

    Raises:
        TypeError: it is something else, or no finite number.
    """
    if isinstance(value, str):
        return json.dumps(str(value), ensure_ascii=False).replace("\x7f", "\\u007F")
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int) or (isinstance(value, float) and math.isfinite(value)):
        return repr(value)
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml_value, cast('Sequence[Any]', value)))}]"
    raise TypeError(f"{value!r} has no place in a side file")
