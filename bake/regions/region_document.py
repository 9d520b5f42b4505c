"""What a region file says, before it meets a world; and its validity bits as text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bake.arrays import BoolArray
from bake.region_types import GRID
from bake.types import RegionBox

Point = tuple[float, float, float]

HEX_DIGITS = GRID**3 // 4
"""Digits that a region's bits take."""


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


def bits_to_hex(valid: BoolArray) -> str:
    """512 bits as 128 hexadecimal digits, the first point's bit first."""
    return np.packbits(valid.astype(np.bool_)).tobytes().hex()


def bits_from_hex(digits: str) -> BoolArray:
    """The reverse of `bits_to_hex`, shape (GRID³,).

    Raises:
        ValueError: these are not 128 hexadecimal digits.
    """
    if len(digits) != HEX_DIGITS:
        raise ValueError(f"{len(digits)} digits")
    return np.unpackbits(np.frombuffer(bytes.fromhex(digits), np.uint8)).astype(np.bool_)
