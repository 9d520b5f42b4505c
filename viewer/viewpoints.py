"""Where to stand for pictures of a level that nobody looks at while they are taken."""

from __future__ import annotations

import dataclasses
import logging
import math
from dataclasses import dataclass

import numpy as np

from bake.errors import ObscuraError
from bake.trace import Hits
from bake.types import BakeResult, BoolArray, Float64Array
from viewer.camera import Camera, guessed_up_axis, robust_bounds

_log = logging.getLogger(__name__)

_EYE_HEIGHT = 1.7  # metres, or less in a level that is itself hardly higher
_STANDS = 64
_TURNS = 12
_ELEVATION = math.radians(4.0)
# Where a picture is probed, from -1 to 1, right and up.
_ROWS, _COLUMNS = 9, 13
_PROBES = [(x, y) for y in np.linspace(-0.9, 0.6, _ROWS) for x in np.linspace(-0.9, 0.9, _COLUMNS)]
_LARGEST_STEP = 0.2  # a shadow's edge counts no more than a gradient


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """A camera with a name for people."""

    name: str
    camera: Camera


def viewpoints(result: BakeResult, aspect: float) -> list[Viewpoint]:
    """Two views over the whole level from opposite sides, and one from the height of a person's eyes.

    Args:
        result: A bake.
        aspect: Width over height of the pictures.
    """
    world = result.world
    corners = world.positions[world.faces[world.face_samples]]
    by_area = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    is_gltf = result.scene_path.suffix.lower() in (".glb", ".gltf")
    up_axis = 1 if is_gltf else guessed_up_axis(by_area)
    low, high = robust_bounds(corners.mean(axis=1) if len(corners) else world.positions)
    overview = Camera(up_axis=up_axis).framed(low, high, aspect)
    opposite = overview.orbited(math.radians(150.0), math.radians(10.0)).framed(low, high, aspect)
    views = [Viewpoint("Overview", overview), Viewpoint("From the other side", opposite)]
    try:
        inside = _eye_level(result, up_axis, low, high, aspect)
    except ObscuraError as error:  # without a tracer there is no telling what would be in the way
        _log.info("no view from eye height: %s", error)
        inside = None
    return views if inside is None else [*views, Viewpoint("At eye height", inside)]


def _eye_level(result: BakeResult, up_axis: int, low: Float64Array, high: Float64Array, aspect: float) -> Camera | None:
    """Among some hundred stands and directions the one whose picture has the most to show: AO that varies."""
    from bake.devices import Device
    from bake.settings import TracerKind
    from bake.trace import create_tracer

    world = result.world
    up = np.eye(3)[up_axis]
    reach = float(np.linalg.norm(high - low))
    height = min(_EYE_HEIGHT, 0.12 * reach)
    ground = _ground_points(result, up, low, high)
    if not len(ground):
        return None
    turns = [Camera(azimuth=math.tau * turn / _TURNS, elevation=_ELEVATION, up_axis=up_axis) for turn in range(_TURNS)]
    rays = np.array([camera.ray(x, y, aspect)[1] for camera in turns for x, y in _PROBES])
    settings = result.settings.replaced(device="cpu", tracer=TracerKind.AUTO)
    with create_tracer(world, settings, Device("cpu", "CPU")) as tracer:

        def nearest(origins: Float64Array, directions: Float64Array) -> Hits:
            return tracer.nearest(origins.astype(np.float32), directions.astype(np.float32), reach)

        overhead = nearest(ground + 0.02 * height * up, np.broadcast_to(up, ground.shape))
        stands = ground[overhead.distance > 1.3 * height] + height * up
        if not len(stands):
            return None
        hits = nearest(np.repeat(stands, len(rays), axis=0), np.tile(rays, (len(stands), 1)))
    shape = (len(stands), _TURNS, _ROWS, _COLUMNS)
    seen = _seen_ao(result, hits).reshape(*shape, -1)
    distance = hits.distance.reshape(shape)
    across = np.minimum(np.abs(np.diff(seen, axis=3)), _LARGEST_STEP).mean(axis=(2, 3))
    along = np.minimum(np.abs(np.diff(seen, axis=2)), _LARGEST_STEP).mean(axis=(2, 3))
    variety = (across + along).min(axis=2)  # at the distance that shows least
    is_near = (distance < 2.0 * height).mean(axis=(2, 3))  # a wall before the eye
    is_behind = (hits.cosine > 0.0).reshape(shape).mean(axis=(2, 3))
    score = variety * (1.0 - is_near) * (1.0 - is_behind)
    stand, turn = np.unravel_index(int(score.argmax()), score.shape)
    known = np.minimum(distance[stand, turn], reach)
    camera = dataclasses.replace(turns[turn], distance=max(0.5 * float(np.median(known)), 0.1))
    return dataclasses.replace(camera, focal=tuple((stands[stand] - camera.distance * camera.backward).tolist()))


def _seen_ao(result: BakeResult, hits: Hits) -> Float64Array:
    """AO at the hits, shape (n, k), float64: 1 where a ray misses or meets no baked face."""
    struck = hits.face >= 0
    weights = np.column_stack([hits.weights, 1.0 - hits.weights.sum(axis=1)])[struck]
    corners = result.field.ao[result.world.faces[hits.face[struck]]].astype(np.float64)
    seen = np.ones((len(hits.face), corners.shape[2]))
    seen[struck] = np.nan_to_num(np.einsum("nc,nck->nk", weights, corners), nan=1.0)
    return seen


def _ground_points(result: BakeResult, up: Float64Array, low: Float64Array, high: Float64Array) -> Float64Array:
    """Valid samples that face up in the middle of the level, evenly picked, shape (n, 3)."""
    world, samples = result.world, result.samples
    corners = world.positions[world.faces[samples.face]]
    weights = np.column_stack([samples.barycentric, 1.0 - samples.barycentric.sum(axis=1)])
    points = np.einsum("nc,ncx->nx", weights, corners)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing_up = normals @ up > 0.9 * np.linalg.norm(normals, axis=1)
    margin = 0.1 * (high - low) * (1.0 - up)
    inside: BoolArray = ((points >= low + margin) & (points <= high - margin)).all(axis=1)
    good = np.flatnonzero(facing_up & inside & result.tally.valid(result.settings.back_face_threshold))
    return points[good[np.linspace(0, len(good) - 1, min(_STANDS, len(good)), dtype=np.int64)]]
