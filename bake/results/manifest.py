"""`manifest.json`: everything of a result that is not an array, and the hash of every array file beside it.

    {"format": "obscura-result", "schema": 3, "scene": {"path", "files"}, "settings", "seed", "device", "tracer",
     "versions", "rays", "rays_skipped", "stages", "findings", "solve", "objects", "texture_shapes",
     "decorators", "regions", "skipped", "stale", "arrays", "checksum"}

`checksum` is the SHA-256 of all the rest, so that a damaged manifest is recognised too.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from bake.errors import InputError, ResultError
from bake.results.arrays import FILE_NAME, StoredArray
from bake.results.parts import checked_parts, decorators_json
from bake.results.region_parts import checked_regions, regions_json
from bake.settings import BakeSettings
from bake.types import BakeResult, Finding, ObjectKeys, Role, SolveReport, StageReport

MANIFEST_FILE = "manifest.json"
FORMAT = "obscura-result"
SCHEMA = 4
READABLE = (1, 2, 3, SCHEMA)
"""Schema 1 had no decorators, schema 2 no regions, schema 3 no rebakes; they are read as results without any."""
COMPLETE = (3, SCHEMA)
"""Schemas whose results have all that this version bakes."""


@dataclass(frozen=True, slots=True)
class Manifest:
    """A manifest as read; see `BakeResult` and `World` for what the fields mean."""

    scene_path: Path
    files: Mapping[str, str]
    settings: BakeSettings
    device: str
    tracer: str
    versions: Mapping[str, str]
    rays_skipped: int
    stages: tuple[StageReport, ...]
    findings: tuple[Finding, ...]
    solve: SolveReport
    object_paths: tuple[str, ...]
    object_roles: tuple[Role, ...]
    object_keys: tuple[ObjectKeys, ...]
    object_hash: tuple[str, ...]
    texture_shapes: tuple[tuple[int, int], ...]
    arrays: Mapping[str, StoredArray]
    decorators: Mapping[str, Any] | None
    regions: Mapping[str, Any] | None
    skipped: bool
    stale: tuple[str, ...]
    schema: int


def manifest_text(result: BakeResult, arrays: Mapping[str, StoredArray]) -> str:
    """The manifest of `result` as JSON, its arrays described by `arrays`."""
    world = result.world
    content: dict[str, Any] = {
        "format": FORMAT,
        "schema": SCHEMA,
        "scene": {"path": str(result.scene_path), "files": dict(result.files)},
        "settings": result.settings.to_json(),
        "seed": result.settings.seed,
        "device": result.device,
        "tracer": result.tracer,
        "versions": dict(result.versions),
        "rays": int(result.tally.rays.sum(dtype=np.int64)),
        "rays_skipped": int(result.rays_skipped),
        "stages": [_stage_json(stage) for stage in result.stages],
        "findings": [dataclasses.asdict(finding) for finding in result.findings],
        "solve": dataclasses.asdict(result.field.report),
        "objects": [
            {"path": path, "role": role.value, "keys": _said(keys), "hash": digest}
            for path, role, keys, digest in zip(
                world.object_paths, world.object_roles, world.object_keys, world.object_hash, strict=True
            )
        ],
        "texture_shapes": [list(texture.shape) for texture in world.textures],
        "decorators": decorators_json(result),
        "regions": regions_json(result.regions),
        "skipped": result.skipped is not None,
        "stale": list(result.stale),
        "arrays": {name: dataclasses.asdict(stored) for name, stored in arrays.items()},
    }
    content = _finite(content)
    content["checksum"] = _checksum(content)
    return json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def is_result(folder: Path) -> bool:
    """Whether `folder` has a manifest of ours, of any schema version; its arrays are not looked at."""
    try:
        return _read_json(folder / MANIFEST_FILE).get("format") == FORMAT
    except (ResultError, FileNotFoundError):
        return False


def read_manifest(folder: Path) -> Manifest:
    """Reads and checks `folder/manifest.json`.

    Raises:
        ResultError: no result, another schema version, or damaged.
    """
    path = folder / MANIFEST_FILE
    try:
        content = _read_json(path)
    except FileNotFoundError:
        if not folder.exists():
            raise ResultError("does not exist", where=str(folder), remedy="bake a scene first") from None
        raise ResultError("is no result (no manifest.json)", where=str(folder), remedy="name a result folder") from None
    if content.get("format") != FORMAT:
        raise ResultError("is no manifest of a result", where=str(path), remedy="name a result folder")
    if content.get("schema") not in READABLE:
        raise ResultError(
            f"schema version {content.get('schema')!r}, this program reads {READABLE[0]} to {SCHEMA}",
            where=str(path),
            remedy="bake again with this version",
        )
    if content.pop("checksum", None) != _checksum(content):
        raise _damaged(path, "content differs from its checksum")
    try:
        return _parse(content, path)
    except (KeyError, TypeError, ValueError, AttributeError, InputError) as error:
        raise _damaged(path, f"a field is missing or wrong ({error})") from error


def _parse(content: dict[str, Any], path: Path) -> Manifest:
    objects: list[dict[str, Any]] = content["objects"]
    return Manifest(
        scene_path=Path(content["scene"]["path"]),
        files=dict(content["scene"]["files"]),
        settings=BakeSettings.from_options(content["settings"], where=str(path)),
        device=str(content["device"]),
        tracer=str(content["tracer"]),
        versions=dict(content["versions"]),
        rays_skipped=int(content["rays_skipped"]),
        stages=tuple(_stage(item) for item in content["stages"]),
        findings=tuple(Finding(**item) for item in content["findings"]),
        solve=_solve(content["solve"]),
        object_paths=tuple(str(item["path"]) for item in objects),
        object_roles=tuple(Role(item["role"]) for item in objects),
        object_keys=tuple(ObjectKeys(**item["keys"]) for item in objects),
        object_hash=tuple(str(item["hash"]) for item in objects),
        texture_shapes=tuple((int(height), int(width)) for height, width in content["texture_shapes"]),
        arrays={name: _stored(item) for name, item in content["arrays"].items()},
        decorators=None if content["schema"] == 1 else checked_parts(content["decorators"]),
        regions=None if content["schema"] < 3 else checked_regions(content["regions"]),
        skipped=content["schema"] >= 4 and bool(content["skipped"]),
        stale=() if content["schema"] < 4 else tuple(str(path) for path in content["stale"]),
        schema=int(content["schema"]),
    )


def _stored(item: dict[str, Any]) -> StoredArray:
    # A name with a path in it would make the reader leave the folder.
    if not FILE_NAME.fullmatch(item["file"]):
        raise ValueError(f"array file {item['file']!r}")
    return StoredArray(item["file"], item["sha256"], item["dtype"], tuple(int(length) for length in item["shape"]))


def _stage_json(stage: StageReport) -> dict[str, Any]:
    rate = stage.rays / stage.seconds / 1e6 if stage.seconds > 0 else 0.0
    return {**dataclasses.asdict(stage), "mrays_per_s": rate}


def _stage(item: dict[str, Any]) -> StageReport:
    return StageReport(**{key: value for key, value in item.items() if key != "mrays_per_s"})


def _solve(item: dict[str, Any]) -> SolveReport:
    lists: dict[str, Any] = {
        "residual": _number(item["residual"]),
        "bounded": tuple(item["bounded"]),
        "rmse": tuple(_number(value) for value in item["rmse"]),
    }
    return SolveReport(**{**item, **lists})


def _said(keys: ObjectKeys) -> dict[str, Any]:
    return {name: value for name, value in dataclasses.asdict(keys).items() if value is not None}


def _finite(value: Any) -> Any:
    """JSON knows no NaN and no infinity: null stands for both."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in cast(dict[str, Any], value).items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in cast(list[Any], value)]
    if isinstance(value, np.generic):
        return _finite(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


def _checksum(content: Mapping[str, Any]) -> str:
    canonical = json.dumps(content, sort_keys=True, ensure_ascii=False, separators=(",", ":"))
    return hashlib.sha256(canonical.encode()).hexdigest()


def _read_json(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        raise FileNotFoundError(path) from None
    except (OSError, ValueError, RecursionError) as error:
        raise _damaged(path, "cannot be read") from error
    if not isinstance(content, dict):
        raise _damaged(path, "is no manifest")
    return cast(dict[str, Any], content)


def _damaged(path: Path, what: str) -> ResultError:
    return ResultError(what, where=str(path), remedy="bake again into another folder, or delete this one first")
