"""The density at which a box of fog dims like the mesh inside it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from bake.arrays import Float32Array, Float64Array, Int32Array
from bake.decorators.object_faces import faces_of
from bake.devices import initialised_warp
from bake.errors import DeviceError
from bake.geometry import MAX_OPTICAL_DEPTH, as_traced, concentric_disc
from bake.low_discrepancy import owen_sobol
from bake.types import World

RAYS = 512
HIGHEST = 1000.0
"""Density at most, 1/m: what stays for a mesh that hardly lets anything through."""

_SHRUBS = 1024  # at a time
_NEWTON_STEPS = 60


def fitted_density(world: World, number: Int32Array, minimum: Float32Array, maximum: Float32Array) -> Float32Array:
    """Densities whose mean transmittance over lines through the box is that of the objects' own triangles.

    Lines are uniform and isotropic: they enter evenly over the box's surface, with density cos θ / π. A triangle lets
    its openness through, however it is struck. The density is the root of mean(exp(-σ L)) = mean(transmittance) over
    the lines' lengths L in the box.

    Args:
        world: Its faces with their openness; textures count by their mean.
        number: Shape (b,), objects with faces.
        minimum, maximum: Shape (b, 3), their boxes.

    Returns:
        Shape (b,), 1/m, in [0, `HIGHEST`]; 0 for a box without thickness, which no density would make visible.

    Raises:
        DeviceError: Warp failed.
    """
    density = np.zeros(len(number), np.float32)
    try:
        for begin in range(0, len(number), _SHRUBS):
            part = slice(begin, begin + _SHRUBS)
            density[part] = _fitted_part(world, number[part], minimum[part], maximum[part])
    except RuntimeError as error:
        raise DeviceError(f"fitting fog failed ({error})", where="fog", remedy="bake without --fit-fog") from error
    return density


def _fitted_part(world: World, number: Int32Array, minimum: Float32Array, maximum: Float32Array) -> Float64Array:
    entry, directions = _lines((maximum - minimum).astype(np.float64))
    size = (maximum - minimum).astype(np.float64)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        exits = np.where(directions > 0.0, (size - entry) / directions, -entry / directions)
    length = np.maximum(np.nanmin(np.where(directions == 0.0, np.inf, exits), axis=2), 0.0)
    transmittance = np.exp(-_mesh_depth(world, number, minimum, maximum, entry, directions, length)).mean(axis=1)
    return _root(length, transmittance)


def _lines(size: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Entry points relative to the boxes' corners and unit directions, shape (b, rays, 3) each."""
    index, count = np.arange(RAYS), len(size)
    u, v = owen_sobol(index, np.full(RAYS, 11))
    # Shuffled: two Sobol sequences side by side would go in step.
    shuffled = np.random.default_rng(0).permutation(RAYS)
    a, b = concentric_disc(*owen_sobol(shuffled, np.full(RAYS, 12)))
    inward = np.sqrt(np.maximum(1.0 - a * a - b * b, 0.0))
    area = np.stack([size[:, 1] * size[:, 2], size[:, 2] * size[:, 0], size[:, 0] * size[:, 1]], axis=1)
    share = np.cumsum(np.repeat(area, 2, axis=1), axis=1)
    share /= np.maximum(share[:, -1:], 1e-300)
    # The first coordinate picks the side; what is left of it places the line on it.
    side = np.minimum((u[None, :, None] > share[:, None, :]).sum(axis=2), 5)
    before = np.take_along_axis(np.concatenate([np.zeros((count, 1)), share], axis=1), side, axis=1)
    width = np.take_along_axis(np.diff(share, axis=1, prepend=0.0), side, axis=1)
    along = np.clip((u[None] - before) / np.maximum(width, 1e-300), 0.0, 1.0)
    axis, upper = side // 2, side % 2 == 1
    entry, direction = np.empty((count, RAYS, 3)), np.empty((count, RAYS, 3))
    row, ray = np.indices((count, RAYS))
    first, second = (axis + 1) % 3, (axis + 2) % 3
    entry[row, ray, axis] = np.where(upper, size[row, axis], 0.0)
    entry[row, ray, first] = along * size[row, first]
    entry[row, ray, second] = v[None] * size[row, second]
    direction[row, ray, axis] = np.where(upper, -inward, inward)
    direction[row, ray, first], direction[row, ray, second] = a[None], b[None]
    return entry, direction


def _mesh_depth(
    world: World,
    number: Int32Array,
    minimum: Float32Array,
    maximum: Float32Array,
    entry: Float64Array,
    directions: Float64Array,
    length: Float64Array,
) -> Float64Array:
    """Optical depth of each object's own triangles along its lines, shape (b, rays).

    The objects are set apart on a grid, so that one structure serves them all and none sees its neighbours.
    """
    side = math.ceil(len(number) ** (1.0 / 3.0))
    step = 1.5 * float((maximum - minimum).max()) + 1e-6
    cell = np.stack(np.unravel_index(np.arange(len(number)), (side, side, side)), axis=1) * step
    shift = cell - minimum.astype(np.float64)
    face, _, count = faces_of(world, number)
    corners = as_traced(world.positions[world.faces[face]]) + np.repeat(shift, count, axis=0)[:, None]
    with np.errstate(divide="ignore"):
        depth = np.minimum(-np.log(world.face_openness[face]), MAX_OPTICAL_DEPTH)
    # A little longer at both ends, so that faces in the box's own sides are met.
    margin = 1e-4 * step
    origins = entry + cell[:, None] - margin * directions
    found = _crossed(corners.reshape(-1, 3), depth, origins.reshape(-1, 3), directions, length + 2.0 * margin)
    return found.reshape(length.shape).astype(np.float64)


def _crossed(
    corners: Float64Array,
    face_depth: Float32Array,
    origins: Float64Array,
    directions: Float64Array,
    length: Float64Array,
) -> Float32Array:
    wp: Any = initialised_warp()
    from bake.kernels import fog_fit

    kernel: Any = fog_fit.crossed  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]

    def array(values: Any, dtype: Any, of: type = np.float32) -> Any:
        return wp.array(np.ascontiguousarray(values, of), dtype=dtype, device="cpu")

    mesh = wp.Mesh(array(corners, wp.vec3), array(np.arange(len(corners)), wp.int32, np.int32), bvh_constructor="sah")
    depth = wp.zeros(len(origins), dtype=wp.float32, device="cpu")
    inputs = [
        mesh.id, array(face_depth, wp.float32), array(origins, wp.vec3), array(directions.reshape(-1, 3), wp.vec3),
        array(length.ravel(), wp.float32), array([], wp.int32, np.int32), array([], wp.int64, np.int64),
        array(np.zeros((0, 2)), wp.vec2), depth,
    ]  # fmt: skip
    wp.launch(kernel, dim=len(origins), inputs=inputs, device="cpu")
    return depth.numpy()


def _root(length: Float64Array, transmittance: Float64Array) -> Float64Array:
    """σ ≥ 0 with mean(exp(-σ L)) = transmittance, by Newton's method from the left, which never oversteps."""
    density = np.zeros(len(length))
    for _ in range(_NEWTON_STEPS):
        passes = np.exp(-density[:, None] * length)
        slope = (passes * length).mean(axis=1)
        step = (passes.mean(axis=1) - transmittance) / np.maximum(slope, 1e-300)
        step = np.where(slope > 0.0, np.maximum(step, 0.0), 0.0)
        density = np.minimum(density + step, HIGHEST)
        if (step <= 1e-7 * density).all():
            break
    return density
