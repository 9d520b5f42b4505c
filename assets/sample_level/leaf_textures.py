"""Leaf clusters with alpha, drawn from formulas and written as PNG."""

from __future__ import annotations

import struct
import zlib

import numpy as np
from numpy.typing import NDArray

from assets.sample_level.randomness import Random

_SIZE = 64


def leaf_images() -> dict[str, bytes]:
    """PNG files by image name; alpha is 255 on a leaf and 0 between leaves."""
    return {
        "oak_leaves": _png(_coloured(_oak_mask(), (74, 104, 40))),
        "pine_needles": _png(_coloured(_needle_mask(), (44, 78, 46))),
    }


def _texel_centres() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    centre = (np.arange(_SIZE) + 0.5) / _SIZE * 2.0 - 1.0
    return np.meshgrid(centre, -centre)


def _oak_mask() -> NDArray[np.bool_]:
    """Leaves of elliptic outline scattered over a disc."""
    x, y = _texel_centres()
    random = Random(101)
    mask = np.zeros(x.shape, bool)
    for _ in range(34):
        angle, radius, turn = random.number(0, 2 * np.pi), 0.78 * random.number(0, 1) ** 0.5, random.number(0, np.pi)
        dx, dy = x - radius * np.cos(angle), y - radius * np.sin(angle)
        along, across = dx * np.cos(turn) + dy * np.sin(turn), dy * np.cos(turn) - dx * np.sin(turn)
        mask |= (along / 0.2) ** 2 + (across / 0.1) ** 2 < 1.0
    return mask


def _needle_mask() -> NDArray[np.bool_]:
    """A twig along the texture's height with needles slanting off both sides."""
    x, y = _texel_centres()
    taper = 0.95 - 0.55 * (y + 1) / 2
    slanted = (y - 0.6 * np.abs(x)) * 6.0
    needles = (np.abs(slanted - np.round(slanted)) < 0.27) & (np.abs(x) < taper)
    return (needles | (np.abs(x) < 0.06)) & (np.abs(y) < 0.97)


def _coloured(mask: NDArray[np.bool_], colour: tuple[int, int, int]) -> NDArray[np.uint8]:
    pixels = np.empty((*mask.shape, 4), np.uint8)
    pixels[..., :3] = colour
    pixels[..., 3] = np.where(mask, 255, 0)
    return pixels


def _png(pixels: NDArray[np.uint8]) -> bytes:
    """An RGBA PNG; stored, not compressed, because compressors differ from machine to machine."""
    height, width = pixels.shape[:2]
    raw = b"".join(b"\0" + row.tobytes() for row in pixels)
    assert len(raw) < 65536, "one stored block"
    deflated = b"\x78\x01\x01" + struct.pack("<HH", len(raw), len(raw) ^ 0xFFFF) + raw
    deflated += struct.pack(">I", zlib.adler32(raw))
    header = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", deflated), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks
    )
