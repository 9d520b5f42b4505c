"""Models of regions made visible: their AO about every normal as a sphere at any point."""

from __future__ import annotations

import numpy as np

from bake.region_types import Regions
from bake.regions.evaluate import AXIS_NORMALS, evaluate
from bake.types import Float32Array, Int32Array, UInt8Array
from viewer.colormaps import CIVIDIS, GREY
from viewer.region_marks import SELECTED_COLOR, bars, region_at
from viewer.region_values import used_models
from viewer.region_view import RegionView
from viewer.volume_view import unit_sphere

Shapes = tuple[Float32Array, Int32Array, UInt8Array]

AXES = ("+X", "−X", "+Y", "−Y", "+Z", "−Z")
"""Names of `AXIS_NORMALS`."""
_ROWS, _SMALL_ROWS = 24, 10
_SMALL = 0.09  # radius of a small sphere as a share of its region's shortest edge


def probe_region(regions: Regions, view: RegionView) -> int:
    """Whose model the probe evaluates: the one chosen, or the one that it lies in; -1 outside of all."""
    if view.probe is None:
        return -1
    if 0 <= view.probe_region < len(regions.graph):
        return view.probe_region
    return region_at(regions, np.array(view.probe))


def probe_sphere(regions: Regions, view: RegionView) -> Shapes | None:
    """The probe: a sphere lit by the model in view, or deformed by it; None without a region to evaluate."""
    region = probe_region(regions, view)
    if region < 0 or view.probe is None:
        return None
    directions, faces = unit_sphere(_ROWS)
    centre = np.array(view.probe)
    ao = evaluate(used_models(regions, view), region, np.broadcast_to(centre, directions.shape), directions)
    radius = view.probe_size * (ao[:, view.column, None] if view.deformed else 1.0)
    return (centre + radius * directions).astype(np.float32), faces, _colors(ao[:, view.column], view)


def probe_needle(regions: Regions, view: RegionView, up_axis: int) -> Shapes | None:
    """The normal chosen at the probe as a bar out of its sphere; None without a probe."""
    if view.probe is None or probe_region(regions, view) < 0:
        return None
    start = np.array([view.probe])
    along = view.probe_size * np.array([view.normal(up_axis)])
    colors = np.array([SELECTED_COLOR], np.uint8)
    return bars(start, start + 1.45 * along, np.array([0.035 * view.probe_size]), colors)


def probe_ao(regions: Regions, view: RegionView, up_axis: int) -> tuple[Float32Array, Float32Array] | None:
    """AO at the probe about its normal as fitted and regularised, each of shape (k,); None outside of all."""
    region = probe_region(regions, view)
    if region < 0 or view.probe is None:
        return None
    place, normal = np.array([view.probe]), np.array([view.normal(up_axis)])
    return evaluate(regions.fitted, region, place, normal)[0], evaluate(regions.regularised, region, place, normal)[0]


def model_spheres(regions: Regions, view: RegionView) -> Shapes:
    """A small sphere lit by each region's own model, at the model's centre."""
    models, graph = used_models(regions, view), regions.graph
    directions, faces = unit_sphere(_SMALL_ROWS)
    count, corners = len(graph), len(directions)
    centres = np.repeat(np.asarray(models.centre), corners, axis=0)
    normals = np.tile(directions, (count, 1))
    ao = evaluate(models, np.repeat(np.arange(count), corners), centres, normals)[:, view.column]
    radius = np.clip(_SMALL * np.min(graph.maximum - graph.minimum, axis=1), 0.03, 1.0)
    size = np.repeat(radius, corners)[:, None] * (ao[:, None] if view.deformed else 1.0)
    cells = (faces + corners * np.arange(count)[:, None, None]).reshape(-1, 3).astype(np.int32)
    return (centres + size * normals).astype(np.float32), cells, _colors(ao, view)


def axis_table(regions: Regions, view: RegionView) -> tuple[Float32Array, Float32Array] | None:
    """AO at the probe about the six axes as fitted and regularised, each of shape (6, k); None outside of all."""
    region = probe_region(regions, view)
    if region < 0 or view.probe is None:
        return None
    places = np.broadcast_to(np.array(view.probe), AXIS_NORMALS.shape)
    return (
        evaluate(regions.fitted, region, places, AXIS_NORMALS),
        evaluate(regions.regularised, region, places, AXIS_NORMALS),
    )


def _colors(ao: Float32Array, view: RegionView) -> UInt8Array:
    return (CIVIDIS if view.deformed else GREY).colors(ao, 0.0, 1.0)
