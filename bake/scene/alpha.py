"""From an alpha texture to the share of light that passes: per texel, per texture and per face.

A masked texel is open where its alpha lies below the cut-off; a blended one lets 1 - alpha through.
"""

from __future__ import annotations

import io
import math

import numpy as np

from bake.types import Float32Array

LARGEST_MAP = 2048  # texels a side; larger textures are averaged down
SUBDIVISIONS = 4  # a face is read at the centres of 4 x 4 sub-triangles


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


def face_openness(openness: Float32Array, corner_uvs: Float32Array) -> Float32Array:
    """Mean openness over each face's own part of the texture, shape (m,), float32, in [0, 1].

    Leaf cards often use a small part of a shared texture, so the mean of the whole would be far off. Every face is
    read at the centres of 16 equal sub-triangles, from the averaged-down level whose texels are about as large.

    Args:
        openness: Shape (h, w), wrapped by repetition, row 0 at v = 0.
        corner_uvs: Shape (m, 3, 2).
    """
    pyramid = _pyramid(openness)
    corners = np.nan_to_num(corner_uvs.astype(np.float64), nan=0.0, posinf=0.0, neginf=0.0)
    edge_u, edge_v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    texels = 0.5 * np.abs(edge_u[:, 0] * edge_v[:, 1] - edge_u[:, 1] * edge_v[:, 0]) * openness.size
    per_point = np.maximum(texels / SUBDIVISIONS**2, 1.0)
    level = np.minimum((0.5 * np.log2(per_point)).astype(np.int64), len(pyramid) - 1)
    result = np.zeros(len(corners), np.float32)
    weights = _subtriangle_centres()
    for number, texture in enumerate(pyramid):
        faces = np.flatnonzero(level == number)
        for part in np.array_split(faces, max(1, len(faces) // 65536)):
            points = np.einsum("pc,mcd->mpd", weights, corners[part])
            result[part] = _lookup(texture, points).mean(axis=1)
    return result


def _lookup(texture: Float32Array, points: np.ndarray) -> Float32Array:
    height, width = texture.shape
    wrapped = points - np.floor(points)
    columns = np.minimum((wrapped[..., 0] * width).astype(np.int64), width - 1)
    rows = np.minimum((wrapped[..., 1] * height).astype(np.int64), height - 1)
    return texture[rows, columns]


def _subtriangle_centres() -> np.ndarray:
    """Barycentric weights of the centres of SUBDIVISIONS² equal sub-triangles, shape (p, 3)."""
    n, centres = SUBDIVISIONS, []
    for i in range(n):
        for j in range(n - i):
            centres.append(((i + 1 / 3) / n, (j + 1 / 3) / n))
            if j < n - i - 1:
                centres.append(((i + 2 / 3) / n, (j + 2 / 3) / n))
    first, second = np.array(centres).T
    return np.stack((1.0 - first - second, first, second), axis=1)


def _pyramid(texture: Float32Array) -> list[Float32Array]:
    levels = [texture]
    while max(levels[-1].shape) > 1:
        levels.append(_averaged(levels[-1], 2))
    return levels


def _averaged(texture: Float32Array, factor: int) -> Float32Array:
    """`texture` shrunk by `factor`; texels at the far border that do not fill a block repeat the last row or column."""
    height, width = texture.shape
    down = (-height % factor if height > 1 else 0, -width % factor if width > 1 else 0)
    padded = np.pad(texture, ((0, down[0]), (0, down[1])), mode="edge")
    rows, columns = (min(factor, height), min(factor, width))
    shape = (padded.shape[0] // rows, rows, padded.shape[1] // columns, columns)
    return padded.reshape(shape).mean(axis=(1, 3), dtype=np.float32)
