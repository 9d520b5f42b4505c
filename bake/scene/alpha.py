"""From an alpha texture to the share of light that passes: per texel, per texture and per face.

A masked texel is open where its alpha lies below the cut-off; a blended one lets 1 - alpha through.
"""

from __future__ import annotations

import io
import math

import numpy as np

from bake.types import Float32Array, Float64Array, Int64Array

LARGEST_MAP = 2048  # texels a side; larger textures are averaged down
SUBDIVISIONS = 4  # a face is read at the centres of 4 x 4 sub-triangles
FACES_AT_ONCE = 1 << 16


class TextureError(Exception):
    """An image that cannot be decoded; becomes a finding, never the end of a load."""


def read_alpha(content: bytes, *, luminance: bool = False) -> Float32Array | None:
    """The alpha channel of an encoded image, shape (h, w), float32, in [0, 1]; None if it has none.

    Args:
        content: The image file.
        luminance: Take the grey value of an image without alpha channel (as `map_d` means it).

    Raises:
        TextureError: the image cannot be decoded.
    """
    try:
        from PIL import Image
    except ImportError:
        raise TextureError("Pillow is not installed") from None
    try:
        with Image.open(io.BytesIO(content)) as image:
            if "A" not in image.getbands() and "transparency" not in image.info:
                if not luminance:
                    return None
                return np.asarray(image.convert("L"), np.float32) / np.float32(255.0)
            return np.asarray(image.convert("RGBA").getchannel("A"), np.float32) / np.float32(255.0)
    except Exception as problem:  # noqa: BLE001 - each of Pillow's decoders raises errors of its own
        raise TextureError(str(problem)[:120] or type(problem).__name__) from None


def openness_of(alpha: Float32Array, *, cutoff: float | None) -> Float32Array:
    """Share of light that each texel lets through, shape as `alpha` (or averaged down), float32, in [0, 1].

    Args:
        alpha: Shape (h, w), opacity.
        cutoff: Texels below it are holes, all others opaque; None for blending.
    """
    if cutoff is None:
        openness = 1.0 - np.clip(alpha, 0.0, 1.0)
    else:
        openness = (alpha < cutoff).astype(np.float32)
    factor = math.ceil(max(openness.shape) / LARGEST_MAP)
    return _averaged(openness, factor) if factor > 1 else openness.astype(np.float32)


class OpennessPyramid:
    """An openness map with all its averaged-down levels, to be read over areas of any size."""

    def __init__(self, openness: Float32Array) -> None:
        self._levels = [openness]
        while max(self._levels[-1].shape) > 1:
            self._levels.append(_averaged(self._levels[-1], 2))

    def face_means(self, corner_uvs: Float32Array) -> Float32Array:
        """Mean openness over each face's own part of the texture, shape (m,), float32, in [0, 1].

        Leaf cards often use a small part of a shared texture, so the mean of the whole would be far off. Every face is
        read at the centres of 16 equal sub-triangles, from the level whose texels are about as large as these.

        Args:
            corner_uvs: Shape (m, 3, 2); the map repeats beyond [0, 1].
        """
        corners = np.nan_to_num(corner_uvs.astype(np.float64), nan=0.0, posinf=0.0, neginf=0.0)
        edge_u, edge_v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        area = 0.5 * np.abs(edge_u[:, 0] * edge_v[:, 1] - edge_u[:, 1] * edge_v[:, 0])
        texels_per_point = np.maximum(area * self._levels[0].size / SUBDIVISIONS**2, 1.0)
        level = np.minimum((0.5 * np.log2(texels_per_point)).astype(np.int64), len(self._levels) - 1)
        result = np.zeros(len(corners), np.float32)
        weights = _subtriangle_centres()
        for number, texture in enumerate(self._levels):
            faces: Int64Array = np.flatnonzero(level == number)
            for begin in range(0, len(faces), FACES_AT_ONCE):
                part = faces[begin : begin + FACES_AT_ONCE]
                points = np.einsum("pc,mcd->mpd", weights, corners[part])
                result[part] = _lookup(texture, points).mean(axis=1)
        return result


def _lookup(texture: Float32Array, points: Float64Array) -> Float32Array:
    height, width = texture.shape
    wrapped = points - np.floor(points)
    columns = np.minimum((wrapped[..., 0] * width).astype(np.int64), width - 1)
    rows = np.minimum((wrapped[..., 1] * height).astype(np.int64), height - 1)
    return texture[rows, columns]


def _subtriangle_centres() -> Float64Array:
    """Barycentric weights of the centres of SUBDIVISIONS² equal sub-triangles, shape (p, 3)."""
    n = SUBDIVISIONS
    upright = [((i + 1 / 3) / n, (j + 1 / 3) / n) for i in range(n) for j in range(n - i)]
    inverted = [((i + 2 / 3) / n, (j + 2 / 3) / n) for i in range(n) for j in range(n - i - 1)]
    first, second = np.array(upright + inverted).T
    return np.stack((1.0 - first - second, first, second), axis=1)


def _averaged(texture: Float32Array, factor: int) -> Float32Array:
    """`texture` shrunk by `factor`; blocks that reach over the far border repeat the last row or column."""
    height, width = texture.shape
    rows, columns = min(factor, height), min(factor, width)
    if height % rows or width % columns:
        texture = np.pad(texture, ((0, -height % rows), (0, -width % columns)), mode="edge")
    total = np.zeros((texture.shape[0] // rows, texture.shape[1] // columns), np.float32)
    for row in range(rows):
        for column in range(columns):
            total += texture[row::rows, column::columns]
    return total / np.float32(rows * columns)
