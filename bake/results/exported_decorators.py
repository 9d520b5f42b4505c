"""Decorators as the exports hand them out: by object, in world coordinates.

A tree's AO at a world position x is L (y0 + y1 dx + y2 dy + y3 dz) with its mesh's local AO L and (dx, dy, dz) the
position less the tree's centre (Sloan et al. 2013, equation 3), to be clamped to [0, 1]. A small decorator's AO is its
scalar.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.types import BakeResult, Float32Array, Float64Array


@dataclass(frozen=True, slots=True)
class ExportedTree:
    """Global AO of one tree.

    Attributes:
        model: Index into `Decorators.models`.
        centre: Shape (3,), float64, world metres.
        coefficients: Shape (k, 4), float32: a row y0, y1, y2, y3 a distance.
        rmse: Shape (k,), float32: error of local times global AO.
    """

    model: int
    centre: Float64Array
    coefficients: Float32Array
    rmse: Float32Array


def exported_trees(result: BakeResult) -> dict[int, ExportedTree]:
    """Trees by object."""
    fits = None if result.decorators is None else result.decorators.fits
    if fits is None:
        return {}
    return {
        number: ExportedTree(
            model=int(fits.model[row]),
            centre=fits.centre[row] + result.world.origin,
            coefficients=np.ascontiguousarray(fits.coefficients[row].T, np.float32),
            rmse=fits.rmse_product[row],
        )
        for row, number in enumerate(fits.object.tolist())
    }


def exported_scales(result: BakeResult) -> dict[int, Float32Array]:
    """AO of small decorators and shrubs by object, shape (k,) each, in [0, 1]."""
    decorators = result.decorators
    scalars = () if decorators is None else (decorators.small_scalars, decorators.shrub_scalars)
    return {
        number: ao
        for part in scalars
        if part is not None
        for number, ao in zip(part.object.tolist(), part.ao, strict=True)
    }


def decorator_arrays(result: BakeResult) -> dict[str, NDArray[Any]]:
    """The parts that the result has as plain arrays; objects are indices of the object list.

    `tree_objects` (t,) int32, `tree_models` (t,) int32, `tree_coefficients` (t, 4, k) float32, `tree_centres` (t, 3)
    float64 world [m], `tree_rmse` (t, k) float32; `tree_local_ao` (sum of the models' vertices, k) float32 and
    `tree_model_first` (models + 1,) int64; `small_objects` (s,) int32, `small_ao` (s, k) float32, `small_found` (s,)
    bool; `shrub_objects`, `shrub_ao`, `shrub_found` likewise; `fog_objects` (b,) int32, `fog_density` (b,) float32
    [1/m], `fog_minimum` and `fog_maximum` (b, 3) float64 world [m].
    """
    decorators, origin = result.decorators, result.world.origin
    arrays: dict[str, NDArray[Any]] = {}
    if decorators is None:
        return arrays
    if (fits := decorators.fits) is not None:
        arrays |= {
            "tree_objects": fits.object,
            "tree_models": fits.model,
            "tree_coefficients": fits.coefficients,
            "tree_centres": fits.centre + origin,
            "tree_rmse": fits.rmse_product,
        }
    if decorators.models:
        counts = [len(model.local_ao) for model in decorators.models]
        arrays["tree_local_ao"] = np.concatenate([model.local_ao for model in decorators.models])
        arrays["tree_model_first"] = np.concatenate(([0], np.cumsum(counts))).astype(np.int64)
    for name, part in (("small", decorators.small_scalars), ("shrub", decorators.shrub_scalars)):
        if part is not None:
            arrays |= {f"{name}_objects": part.object, f"{name}_ao": part.ao, f"{name}_found": part.found}
    if (fog := decorators.fog) is not None:
        arrays |= {
            "fog_objects": fog.object,
            "fog_density": fog.density,
            "fog_minimum": fog.minimum.astype(np.float64) + origin,
            "fog_maximum": fog.maximum.astype(np.float64) + origin,
        }
    return arrays


def decorators_by_path(result: BakeResult) -> dict[str, Any]:
    """What the side file `NAME.decorators.json` says, by object path; plain values that JSON can hold."""
    paths, decorators = result.world.object_paths, result.decorators
    trees = {
        paths[number]: {
            "model": tree.model,
            "centre": tree.centre.tolist(),
            "coefficients": plain_values(tree.coefficients),
            "rmse": plain_values(tree.rmse),
        }
        for number, tree in exported_trees(result).items()
    }
    content: dict[str, Any] = {
        "distances": list(result.settings.column_distances),
        "formula": "AO = clamp(local AO * (y0 + y1 dx + y2 dy + y3 dz)), (dx, dy, dz) = world position - centre",
        "trees": trees,
        "small": {},
        "shrubs": {},
    }
    if decorators is None:
        return content
    for name, part in (("small", decorators.small_scalars), ("shrubs", decorators.shrub_scalars)):
        if part is not None:
            rows = zip(part.object.tolist(), part.ao, part.found.tolist(), strict=True)
            content[name] = {paths[number]: {"ao": plain_values(ao), "found": found} for number, ao, found in rows}
    if (fog := decorators.fog) is not None:
        for row, number in enumerate(fog.object.tolist()):
            densities = {"density": float(fog.density[row]), "given_density": float(fog.given_density[row])}
            content["shrubs"].setdefault(paths[number], {}).update(densities)
    return content


def plain_values(values: NDArray[Any]) -> Any:
    """Nested lists that JSON can hold: what is not finite is null."""
    exact = values.astype(np.float64)
    return np.where(np.isfinite(exact), exact, np.array(None)).tolist()
