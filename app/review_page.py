"""The page for a review: the report of a result, led by the picture that the reviewer was looking at."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Review:
    """What the reviewer saw.

    Attributes:
        jpeg: The view with its legends.
        caption: What is shown in it.
        notes: Facts about it, such as the point that was kept, by name.
        stale: What has changed in the scene since the bake; empty if nothing has.
    """

    jpeg: bytes
    caption: str
    notes: Sequence[tuple[str, str]] = ()
    stale: str = ""


def write_review(result_path: Path, target: Path, review: Review, *, with_pictures: bool = True) -> Path:
    """Writes the page; what was there is replaced only once it is whole.

    Args:
        result_path: The result's folder.
        target: The page.
        review: What leads it.
        with_pictures: Whether the usual views of the report are taken too, in a process of their own.

    Returns:
        `target`.

    Raises:
        ResultError: no result.
        StorageError: the page could not be written.
    """
    from app.commands.pictures import take_pictures
    from app.commands.report_page import report_page
    from bake.results import load_result
    from bake.results.storage import replacing

    result = load_result(result_path)
    with replacing(target) as file:
        pictures = take_pictures(result_path) if with_pictures else []
        file.write(report_page(result, result_path, pictures, lead=lead(review)).encode())
    return target


def lead(review: Review) -> list[str]:
    """The head of the page, as pieces of HTML."""
    from app.commands.html import picture, table

    day = time.strftime("%d %B %Y, %H:%M")
    parts = ["<h2>For review</h2>", f"<p>As seen on {escape(day)}.</p>"]
    if review.stale:
        parts.append(f"<p><b>The scene has changed since this bake:</b> {escape(review.stale)}.</p>")
    parts.append(picture(review.jpeg, review.caption))
    if review.notes:
        parts.append(table(("", ""), [(escape(name), escape(value)) for name, value in review.notes]))
    return parts
