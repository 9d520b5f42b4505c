"""`report`: one page that stands alone."""

from __future__ import annotations

import dataclasses
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from conftest import Run
from synthetic_results import build_result

from app.commands import pictures
from app.commands.pictures import Picture, take_pictures
from app.commands.report_page import report_page
from bake.types import Finding


class Outline(HTMLParser):
    """Checks that elements nest, and collects headings and references."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.references: list[str] = []
        self.headings: list[str] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Opens an element."""
        self.references += [value or "" for name, value in attrs if name in ("src", "href")]
        if tag not in ("meta", "img", "rect"):
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """An element without content."""

    def handle_endtag(self, tag: str) -> None:
        """Closes the innermost element."""
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        """Collects headings."""
        if self.open and self.open[-1] in ("h1", "h2"):
            self.headings.append(data)


def test_a_page_without_pictures(tmp_path: Path, run: Run, stored: Path) -> None:
    """All sections are there, and nothing outside the page is referred to."""
    code, out, err = run("report", stored, "-o", tmp_path / "out.html", "--no-pictures")
    assert (code, err) == (0, "")
    assert "out.html" in out
    text = (tmp_path / "out.html").read_text()
    outline = Outline(text)
    assert outline.headings[1:] == [
        "Views", "Distribution over the surface", "Stages", "Darkest objects", "Findings", "Settings", "Made with",
    ]  # fmt: skip
    assert outline.references == []
    assert "zero-area-faces" in text
    assert "no shrubs" in text
    assert text.count("<svg") == 2


def test_pictures_are_embedded() -> None:
    """Pictures travel inside the page."""
    page = report_page(build_result(), Path("r"), [Picture("Overview", "2 m", b"\xff\xd8")])
    assert Outline(page).references == ["data:image/jpeg;base64,/9g="]


def test_text_from_files_is_escaped() -> None:
    """A name made of markup is shown, not run."""
    evil = "<script>alert(1)</script>"
    result = build_result(files={evil: "00"})
    world = dataclasses.replace(result.world, object_paths=(evil, "b", "c"))
    finding = Finding(evil, evil, 1, evil)
    page = report_page(dataclasses.replace(result, world=world, findings=(finding,)), Path(evil), [])
    assert "<script" not in page
    Outline(page)


def test_a_page_about_nothing() -> None:
    """A result without objects or findings still makes a page."""
    empty = dataclasses.replace(build_result(objects=0), findings=(), stages=())
    Outline(report_page(empty, Path("r"), []))


def test_darkest_objects_come_first() -> None:
    """Objects are ordered by their mean AO at the longest distance."""
    ao = np.ones((15, 2), np.float32)
    ao[5:10, 1] = 0.25
    page = report_page(build_result(ao=ao), Path("r"), [])
    assert re.findall(r"barrel#(\d)</td><td class=\"number\">", page) == ["1", "0", "2"]


def test_without_anything_to_draw_with(tmp_path: Path, run: Run, stored: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine that cannot draw gets its report, and is told."""
    monkeypatch.setattr(pictures, "_WAYS", ("vtkNoSuchWindow",))
    monkeypatch.setattr(pictures, "run_off_screen", lambda *_: False)
    code, _, err = run("report", stored, "-o", tmp_path / "out.html")
    assert code == 0
    assert "no pictures" in err
    assert "No pictures" in (tmp_path / "out.html").read_text()


def test_real_pictures(stored: Path) -> None:
    """Every viewpoint is drawn at both distances, and the pictures show something."""
    import io

    from PIL import Image

    taken = take_pictures(stored)
    if not taken:
        pytest.skip("nothing here can draw off screen")
    assert {picture.distance for picture in taken} == {"2 m", "300 m"}
    assert len(taken) >= 4
    for picture in taken[:4]:
        pixels = np.asarray(Image.open(io.BytesIO(picture.jpeg)))
        assert pixels.shape == (700, 1120, 3)
        assert pixels.std() > 1.0
