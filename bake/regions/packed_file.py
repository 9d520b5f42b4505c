"""The packed models of a result as a file: JSON data, or the shader text that evaluates them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bake.errors import ResultError, SettingsError
from bake.regions.packed import MODEL_BYTES, PackedModels, pack
from bake.regions.shader_text import glsl, hlsl
from bake.types import BakeResult, Float64Array, Regions

FORMAT = "obscura-regions"
SUFFIXES = (".json", ".glsl", ".hlsl")


def packed_text(result: BakeResult, path: Path, *, weights: Sequence[float] | None = None) -> str:
    """What belongs into a file of the suffix of `path`; nothing is written.

    Args:
        result: With regions.
        path: Its suffix decides: .json has the models, .glsl and .hlsl the functions that evaluate them.
        weights: Share of each baked distance in the one function that is packed; by default the longest alone.

    Raises:
        ResultError: the result has no regions.
        SettingsError: another suffix, or weights that do not fit the distances.
    """
    if result.regions is None:
        raise no_regions(str(result.scene_path))
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise SettingsError(
            f"unknown format {path.suffix!r} for regions", where=str(path), remedy=f"use {', '.join(SUFFIXES)}"
        )
    if suffix == ".json":
        shares = checked_weights(result, weights)
        packed = pack(result.regions, result.world.origin, shares)
        return json.dumps(_content(result, result.regions, packed, shares), ensure_ascii=False, allow_nan=False) + "\n"
    return glsl() if suffix == ".glsl" else hlsl()


def checked_weights(result: BakeResult, weights: Sequence[float] | None) -> Float64Array:
    """Shares of the distances, shape (k,).

    Raises:
        SettingsError: not one finite number a distance.
    """
    distances = result.settings.column_distances
    if weights is None:
        return (np.arange(len(distances)) == int(np.argmax(distances))).astype(np.float64)
    if len(weights) != len(distances) or not np.isfinite(weights).all():
        raise SettingsError(
            f"{len(weights)} weights for {len(distances)} distances",
            where="--weights",
            remedy=f"give one number each for {', '.join(f'{d:g} m' for d in distances)}",
        )
    return np.asarray(weights, np.float64)


def no_regions(where: str) -> ResultError:
    """The refusal of a result without regions."""
    return ResultError("the result has no regions", where=where, remedy="bake with --regions auto or a region file")


def _content(result: BakeResult, regions: Regions, packed: PackedModels, weights: Float64Array) -> dict[str, Any]:
    graph, origin = regions.graph, packed.origin
    low, high = (graph.minimum + origin).tolist(), (graph.maximum + origin).tolist()
    centres = (graph.link_centre + origin).tolist()
    return {
        "format": FORMAT,
        "version": 1,
        "origin": origin.tolist(),
        "distances": list(result.settings.column_distances),
        "weights": weights.tolist(),
        "model_bytes": MODEL_BYTES,
        "models": [[float(f"{value:.9g}") for value in model] for model in packed.model.reshape(-1, 32).tolist()],
        "regions": [
            {"name": name, "min": low[i], "max": high[i], "model": int(packed.region_model[i])}
            for i, name in enumerate(graph.names)
        ],
        "links": [
            {"a": graph.names[a], "b": graph.names[b], "area": float(graph.link_area[i]), "centre": centres[i]}
            for i, (a, b) in enumerate(np.asarray(graph.link).tolist())
        ],
    }
