"""What of a result owns stored arrays: its stages' data, and the parts of its decorators that it has.

The models' local AO lie end to end in one array; `models.first_vertex` says where each begins.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.decorator_types import Decorators, FogBoxes, SmallScalars, TreeFits, TreeModel, TreeVolume
from bake.errors import ResultError
from bake.types import BakeResult, Float32Array, Int32Array, Int64Array

DECORATOR_PARTS = ("fog", "volume", "models", "fits", "shrub_scalars", "small_scalars")


@dataclass(frozen=True, slots=True)
class StoredModels:
    """Tree models as they are stored.

    Attributes:
        mesh: Shape (m,), int32.
        first_vertex: Shape (m + 1,), int64: model i owns rows `first_vertex[i]:first_vertex[i + 1]`.
        local_ao: Shape (sum of the meshes' vertices, k), float32.
    """

    mesh: Int32Array
    first_vertex: Int64Array
    local_ao: Float32Array


def owners_of(result: BakeResult) -> dict[str, Any]:
    """Owner of arrays by name; decorators that the result lacks have none."""
    owners: dict[str, Any] = {
        "world": result.world,
        "samples": result.samples,
        "tally": result.tally,
        "field": result.field,
    }
    if result.skipped is not None:
        owners["skipped"] = result.skipped
    decorators = result.decorators
    if decorators is not None:
        parts = {name: getattr(decorators, name) for name in DECORATOR_PARTS if name != "models"}
        owners |= {name: part for name, part in parts.items() if part is not None}
        if decorators.models:
            owners["models"] = _end_to_end(decorators.models)
    return owners


def _end_to_end(models: tuple[TreeModel, ...]) -> StoredModels:
    counts = [len(model.local_ao) for model in models]
    return StoredModels(
        mesh=np.array([model.mesh for model in models], np.int32),
        first_vertex=np.concatenate(([0], np.cumsum(counts))).astype(np.int64),
        local_ao=np.concatenate([model.local_ao for model in models]),
    )


def decorators_json(result: BakeResult) -> dict[str, Any] | None:
    """What the manifest says of the decorators: the parts there are and what is no array of them."""
    decorators = result.decorators
    if decorators is None:
        return None
    spacing = None if decorators.volume is None else float(decorators.volume.spacing)
    return {"parts": [name for name in DECORATOR_PARTS if name in owners_of(result)], "spacing": spacing}


def checked_parts(said: Any) -> Mapping[str, Any] | None:
    """What `decorators_json` wrote.

    Raises:
        KeyError, TypeError, ValueError: something else.
    """
    if said is not None and not set(said["parts"]) <= set(DECORATOR_PARTS):
        raise ValueError("decorators")
    return said


def decorators_of(
    said: Mapping[str, Any] | None, arrays: Mapping[str, Mapping[str, NDArray[Any]]]
) -> Decorators | None:
    """The decorators from what the manifest says of them and their arrays by owner and attribute.

    Raises:
        KeyError, TypeError, ValueError: they do not fit each other.
    """
    if said is None:
        return None
    parts: dict[str, Any] = {name: arrays[name] for name in said["parts"]}
    made: dict[str, Any] = {}
    for name, kind in (("fog", FogBoxes), ("fits", TreeFits), ("shrub_scalars", SmallScalars)):
        made[name] = kind(**parts[name]) if name in parts else None
    made["small_scalars"] = SmallScalars(**parts["small_scalars"]) if "small_scalars" in parts else None
    made["volume"] = TreeVolume(**parts["volume"], spacing=float(said["spacing"])) if "volume" in parts else None
    made["models"] = _taken_apart(StoredModels(**parts["models"])) if "models" in parts else ()
    return Decorators(**made)


def _taken_apart(stored: StoredModels) -> tuple[TreeModel, ...]:
    first = stored.first_vertex
    if (
        len(first) != len(stored.mesh) + 1
        or first[0] != 0
        or first[-1] != len(stored.local_ao)
        or np.any(np.diff(first) < 0)
    ):
        raise ValueError("tree models")
    spans = zip(first[:-1].tolist(), first[1:].tolist(), strict=True)
    return tuple(
        TreeModel(mesh, stored.local_ao[begin:end])
        for mesh, (begin, end) in zip(stored.mesh.tolist(), spans, strict=True)
    )


def check_decorators(folder: Path, result: BakeResult) -> None:
    """Array lengths and index ranges of the decorators.

    Raises:
        ResultError: they do not fit each other or the world.
    """
    decorators = result.decorators
    if decorators is None:
        return
    columns, objects = result.settings.distance_count, result.world.object_count
    agrees = True
    for part in (decorators.fog, decorators.fits, decorators.shrub_scalars, decorators.small_scalars):
        if part is None:
            continue
        arrays = {item.name: getattr(part, item.name) for item in dataclasses.fields(part)}
        agrees &= all(len(array) == len(arrays["object"]) for array in arrays.values())
        agrees &= within(arrays["object"], objects)
    for part in (decorators.shrub_scalars, decorators.small_scalars):
        agrees &= part is None or part.ao.shape[1] == columns
    agrees &= all(model.local_ao.shape[1] == columns for model in decorators.models)
    fits, volume = decorators.fits, decorators.volume
    if fits is not None:
        agrees &= within(fits.model, len(decorators.models)) and fits.coefficients.shape[2] == columns
        agrees &= all(
            array.shape[1] == columns for array in (fits.rmse_global, fits.rmse_product, fits.rmse_volume, fits.terms)
        )
    if volume is not None:
        agrees &= len(volume.origin) == 3 and len(volume.voxel) == len(volume.sh) == len(volume.valid)
        agrees &= volume.sh.shape[2] == columns
        agrees &= within(volume.top + 1, len(volume.brick_voxels) + 1)
        agrees &= within(volume.brick_voxels + 1, len(volume.voxel) + 1)
    if not agrees:
        raise ResultError("its decorators do not fit each other", where=str(folder), remedy="bake again")


def within(indices: NDArray[Any], bound: int) -> bool:
    """Whether all indices lie in 0 … bound - 1."""
    return not indices.size or (int(indices.min()) >= 0 and int(indices.max()) < bound)
