"""Where to look from to see a region, or the boundary between two."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from app.lazy_picker import LazyPicker
from app.viewport import Viewport
from bake.region_types import Regions
from bake.types import Float64Array
from viewer.camera import Camera

_LEAST, _STEEPEST = 0.3, math.radians(80.0)


def fly_to_region(viewport: Viewport, picker: LazyPicker, regions: Regions, region: int) -> None:
    """Shows a region's box; from inside it, where walls would hide it."""
    low, high = regions.graph.minimum[region], regions.graph.maximum[region]
    middle, seed = (low + high) / 2.0, regions.graph.seed[region]
    outside = viewport.camera.framed(low, high, viewport.view.aspect)
    if picker.pick(middle, outside.backward, cull_back_faces=False) is None:
        viewport.navigation.fly_to(outside)
        return
    corner = seed + 0.8 * (np.where(outside.backward > 0.0, high, low) - seed)
    viewport.navigation.fly_to(looking(viewport.camera, free_eye(picker, seed, corner), middle))


def fly_to_link(viewport: Viewport, picker: LazyPicker, regions: Regions, link: int) -> None:
    """Shows the boundary of two regions from the larger one, as far back as walls allow."""
    graph = regions.graph
    centre, ends = graph.link_centre[link], graph.link[link]
    volume = np.prod(graph.maximum[ends] - graph.minimum[ends], axis=1)
    home = graph.seed[ends[int(np.argmax(volume))]]
    away = home - centre
    length = float(np.linalg.norm(away))
    wanted = max(2.5 * math.sqrt(float(graph.link_area[link])), 2.0)
    if length < 1e-6:
        away, length = viewport.camera.backward, 1.0
    eye = free_eye(picker, centre, centre + away / length * wanted)
    viewport.navigation.fly_to(looking(viewport.camera, eye, centre))


def looking(camera: Camera, eye: Float64Array, focal: Float64Array) -> Camera:
    """The camera at a place, looking at another."""
    back = eye - focal
    distance = float(np.linalg.norm(back))
    if distance < 1e-6:
        return camera.aimed(focal, _LEAST)
    back = back / distance
    up = camera.up_axis
    elevation = math.asin(min(max(float(back[up]), -1.0), 1.0))
    azimuth = math.atan2(float(back[(up + 1) % 3]), float(back[(up + 2) % 3]))
    x, y, z = (float(value) for value in focal)
    return dataclasses.replace(
        camera,
        focal=(x, y, z),
        azimuth=azimuth,
        elevation=min(max(elevation, -_STEEPEST), _STEEPEST),
        distance=max(distance, _LEAST),
    )


def free_eye(picker: LazyPicker, start: Float64Array, wanted: Float64Array) -> Float64Array:
    """The wanted place, or one a little before the first wall on the way to it, each of shape (3,)."""
    way = wanted - start
    length = float(np.linalg.norm(way))
    if length < 1e-6:
        return wanted
    hit = picker.pick(start, way / length, cull_back_faces=False)
    return wanted if hit is None or hit.distance > length else start + way / length * max(0.9 * hit.distance, 0.05)
