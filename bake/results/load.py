"""Reads a stored result: memory-mapped, checked, and nothing executed."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.errors import ResultError
from bake.results.arrays import SPECS, ArraySpec, read_array
from bake.results.manifest import MANIFEST_FILE, Manifest, read_manifest
from bake.results.parts import DECORATOR_PARTS, check_decorators, decorators_of, within
from bake.results.region_parts import REGION_PARTS, check_regions, regions_of
from bake.types import BakeResult, Decorators, Float32Array, Regions, SampleSet, Skipped, Tally, VertexField, World

_ATTEMPTS = 20


def load_result(folder: Path, *, verify: bool = True) -> BakeResult:
    """Opens a result folder.

    The arrays are read-only maps of the files: what is not looked at is not read, and they stay valid while a new
    bake replaces the result.

    Args:
        folder: What `save_result` wrote.
        verify: Compare every file with its recorded SHA-256 (about a second per GB and core).

    Raises:
        ResultError: no result, another schema version, or damaged; the message names the file.
    """
    for _ in range(_ATTEMPTS):
        version = _version(folder)
        manifest = read_manifest(folder)
        try:
            return _assemble(folder, manifest, _read_arrays(folder, manifest, verify=verify))
        except FileNotFoundError as error:
            if _version(folder) == version:
                raise ResultError("is missing", where=str(error.filename), remedy="bake again") from error
            # else a bake replaced the result while we were reading
    raise ResultError("is being rewritten without pause", where=str(folder), remedy="try again later")


def _version(folder: Path) -> tuple[int, int]:
    """What changes with every commit, even one of the same content."""
    try:
        status = (folder / MANIFEST_FILE).stat()
    except OSError:
        return (0, 0)
    return (status.st_ino, status.st_mtime_ns)


def _read_arrays(folder: Path, manifest: Manifest, *, verify: bool) -> dict[str, NDArray[Any]]:
    wanted = [spec for spec in SPECS if spec.name in manifest.arrays]
    parts = () if manifest.decorators is None else manifest.decorators["parts"]
    absent: set[str] = {str(part) for part in DECORATOR_PARTS} - set(parts)
    if manifest.regions is None:
        absent |= set(REGION_PARTS)
    if not manifest.skipped:
        absent.add("skipped")
    needed = [spec for spec in SPECS if not spec.optional and spec.owner not in absent]
    lacking = [spec.name for spec in needed if spec.name not in manifest.arrays]
    if lacking:
        raise ResultError(f"has no array {', '.join(lacking)}", where=str(folder), remedy="bake again")

    def read(spec: ArraySpec) -> NDArray[Any]:
        return read_array(folder, spec, manifest.arrays[spec.name], verify=verify)

    with ThreadPoolExecutor() as pool:
        arrays = pool.map(read, wanted)
        return {spec.name: array for spec, array in zip(wanted, arrays, strict=True)}


def _assemble(folder: Path, manifest: Manifest, arrays: dict[str, NDArray[Any]]) -> BakeResult:
    world = World(
        **_of("world", arrays),
        object_paths=manifest.object_paths,
        object_roles=manifest.object_roles,
        object_keys=manifest.object_keys,
        object_hash=manifest.object_hash,
        textures=_textures(folder, arrays["world.texels"], manifest.texture_shapes),
    )
    result = BakeResult(
        scene_path=manifest.scene_path,
        files=manifest.files,
        settings=manifest.settings,
        world=world,
        samples=SampleSet(**_of("samples", arrays)),
        tally=Tally(**_of("tally", arrays)),
        field=VertexField(**_of("field", arrays), report=manifest.solve),
        stages=manifest.stages,
        findings=manifest.findings,
        device=manifest.device,
        tracer=manifest.tracer,
        rays_skipped=manifest.rays_skipped,
        versions=manifest.versions,
        decorators=_decorators(folder, manifest, arrays),
        regions=_regions(folder, manifest, arrays),
        skipped=Skipped(**_of("skipped", arrays)) if manifest.skipped else None,
        stale=manifest.stale,
    )
    _check_agreement(folder, result)
    check_decorators(folder, result)
    check_regions(folder, result)
    return result


def _decorators(folder: Path, manifest: Manifest, arrays: dict[str, NDArray[Any]]) -> Decorators | None:
    owned = {part: _of(part, arrays) for part in DECORATOR_PARTS}
    try:
        return decorators_of(manifest.decorators, owned)
    except (KeyError, TypeError, ValueError) as error:
        raise ResultError("its decorators do not fit each other", where=str(folder), remedy="bake again") from error


def _regions(folder: Path, manifest: Manifest, arrays: dict[str, NDArray[Any]]) -> Regions | None:
    try:
        return regions_of(manifest.regions, {part: _of(part, arrays) for part in REGION_PARTS})
    except (KeyError, TypeError, ValueError) as error:
        raise ResultError("its regions do not fit each other", where=str(folder), remedy="bake again") from error


def _of(owner: str, arrays: dict[str, NDArray[Any]]) -> dict[str, Any]:
    return {
        spec.attribute: arrays.get(spec.name) for spec in SPECS if spec.owner == owner and spec.attribute != "texels"
    }


def _textures(folder: Path, texels: Float32Array, shapes: tuple[tuple[int, int], ...]) -> tuple[Float32Array, ...]:
    ends = np.cumsum([height * width for height, width in shapes], dtype=np.int64)
    if len(texels) != (ends[-1] if len(ends) else 0):
        raise ResultError("texture shapes do not fit the texels", where=str(folder), remedy="bake again")
    return tuple(part.reshape(shape) for part, shape in zip(np.split(texels, ends[:-1]), shapes, strict=False))


def _check_agreement(folder: Path, result: BakeResult) -> None:
    """Array lengths and index ranges that a reader would otherwise trip over far from here."""
    world, samples, tally, field = result.world, result.samples, result.tally, result.field
    vertices, faces, objects, columns = (
        world.vertex_count,
        world.face_count,
        world.object_count,
        result.settings.distance_count,
    )
    per_face = (world.face_object, world.face_casts, world.face_samples, world.face_two_sided, world.face_openness)
    agrees = (
        len(world.origin) == 3
        and len(world.normals) == vertices
        and all(len(array) == faces for array in per_face)
        and field.ao.shape == (vertices, columns)
        and len(field.state) == vertices
        and (result.skipped is None or len(result.skipped.samples) == len(samples))
        and set(result.stale) <= set(world.object_paths)
        and tally.ao.shape == (len(samples), columns)
        and all(len(array) == len(samples) for array in (samples.barycentric, samples.area, samples.index))
        and all(len(array) == len(samples) for array in (tally.rays, tally.hits, tally.back_faces))
        and within(world.faces, vertices)
        and within(world.face_object, objects)
        and within(samples.face, faces)
        and _is_partition(world.first_vertex, objects, vertices)
        and _is_partition(world.first_face, objects, faces)
        and (world.vertex_uv is None or len(world.vertex_uv) == vertices)
        and (world.face_texture is None or len(world.face_texture) == faces)
    )
    if not agrees:
        raise ResultError("its arrays do not fit each other", where=str(folder), remedy="bake again")


def _is_partition(firsts: NDArray[np.int64], objects: int, total: int) -> bool:
    return (
        len(firsts) == objects + 1
        and int(firsts[0]) == 0
        and int(firsts[-1]) == total
        and bool((np.diff(firsts) >= 0).all())
    )
