"""Tables put into a page of the documentation, in place of those of an earlier run."""

from __future__ import annotations

from pathlib import Path

from bake.errors import InputError


def write_table(page: Path, name: str, text: str) -> bool:
    """Replaces what stands between `<!-- NAME -->` and `<!-- /NAME -->`; a page without the marks stays as it is.

    Returns:
        Whether the page has the marks.

    Raises:
        InputError: the page cannot be read or written.
    """
    begin, end = f"<!-- {name} -->", f"<!-- /{name} -->"
    try:
        content = page.read_text(encoding="utf-8")
        if begin not in content or end not in content:
            return False
        before, rest = content.split(begin, 1)
        after = rest.split(end, 1)[1]
        page.write_text(f"{before}{begin}\n{text.strip()}\n{end}{after}", encoding="utf-8")
    except OSError as error:
        raise InputError(
            f"cannot be changed ({error.strerror})", where=str(page), remedy="name a page of Markdown"
        ) from error
    return True
