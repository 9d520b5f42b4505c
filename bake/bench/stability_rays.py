"""Rays where tracers break: from convex bodies, at vertices, along edges and in the planes of faces."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bake.arrays import Float64Array
from bake.bench.shapes import Solid, ball, block, flat
from bake.bench.stability_figures import Figure, not_finite, warned
from bake.bench.stability_level import Level, as_scene, part
from bake.devices import Device
from bake.samples import place_samples
from bake.scene import flatten
from bake.settings import BakeSettings, Kernel
from bake.trace import Tracer
from bake.types import Tally, World

RAYS = 1_000_000
BRUTE_RAYS = 4_096
_AIMED_GATE = 1e-4
_FAR = np.array([1.0, -0.7123456789, 0.3123456789])

OpenTracer = Callable[[str, World, BakeSettings], Tracer]


def ray_cases(body: str, open_tracer: OpenTracer) -> dict[str, list[Figure]]:
    """Figures of one tracer by the name of the case."""
    convex = ball(3, 1.0, 1.0, 1.0)
    return {
        "rays from a convex body": _self_hits(body, open_tracer, convex),
        "rays from one 1e-3 m wide": _self_hits(body, open_tracer, convex.scaled(1e-3, 1e-3, 1e-3), width=1e-3),
        "rays from one 1e4 m wide": _self_hits(body, open_tracer, convex.scaled(1e4, 1e4, 1e4), width=1e4),
        "rays from one 1e6 m off": _self_hits(body, open_tracer, Solid(convex.positions + 1e6 * _FAR, convex.faces)),
        "rays from a flat grid": _self_hits(body, open_tracer, flat(-6.0, 6.0, -6.0, 6.0, 1.0, 24)),
        "rays into closed bodies": _leaks(body, open_tracer, "anywhere"),
        "rays at vertices": _leaks(body, open_tracer, "vertices"),
        "rays at edges": _leaks(body, open_tracer, "edges"),
        "rays in planes and along edges": _in_planes(body, open_tracer),
    }


def _world(solid: Solid) -> World:
    return flatten(as_scene(Level((part("body", solid),))), BakeSettings())


def _self_hits(body: str, open_tracer: OpenTracer, solid: Solid, *, width: float = 1.0) -> list[Figure]:
    """Rays that leave a surface that sees nothing of itself, and hit something."""
    world = _world(solid)
    wanted = BRUTE_RAYS if body == "brute" else RAYS
    each = max(1, -(-wanted // (64 * world.face_count)))
    settings = BakeSettings(
        kernel=Kernel.OCCLUSION, max_distance=1e5 * width, rays=64, samples_per_face=(each, each),
        sample_spacing=min(width, 1e6),
    )  # fmt: skip
    samples = place_samples(world, settings)
    if body == "brute":
        samples = samples.only(np.arange(0, len(samples), max(1, len(samples) * 64 // BRUTE_RAYS)))
    tally = Tally.empty(len(samples), 1)
    with warned() as caught, open_tracer(body, world, settings) as tracer:
        for batch in samples.batches(tracer.batch_size):
            tracer.accumulate(samples, batch, tally)
    count = int(tally.rays.astype(np.int64).sum())
    return [
        Figure(body, "rays that hit their own surface", float(tally.hits.astype(np.int64).sum()), 0.0, f"of {count:,}"),
        Figure(body, "values not finite", not_finite(tally.ao), 0.0),
        Figure(body, "warnings", float(len(caught)), 0.0),
    ]


def _leaks(body: str, open_tracer: OpenTracer, aim: str) -> list[Figure]:
    """Rays from inside two closed bodies that get out."""
    rng = np.random.default_rng(1)
    count = (BRUTE_RAYS if body == "brute" else RAYS) // 2
    lost = 0
    with warned() as caught:
        for solid in (ball(3, 1.0, 1.0, 1.0), block((-1.0, -0.5, -1.5), (1.0, 0.5, 1.5), 0.25)):
            world = _world(solid.flipped())
            corners = world.positions.astype(np.float32).astype(np.float64)[world.faces]
            picked = corners[rng.integers(0, len(corners), count)]
            share = rng.random((count, 1))
            origins = rng.uniform(-0.2, 0.2, (count, 3)) + corners.reshape(-1, 3).mean(axis=0)
            targets = {
                "anywhere": origins + rng.normal(size=(count, 3)),
                "vertices": picked[:, 0],
                "edges": share * picked[:, 0] + (1.0 - share) * picked[:, 1],
            }[aim]
            directions = _unit(targets - origins.astype(np.float32))
            with open_tracer(body, world, BakeSettings()) as tracer:
                found = tracer.nearest(origins.astype(np.float32), directions, 1e6)
            lost += int(np.count_nonzero(found.face < 0))
    if aim == "anywhere":
        leak = Figure(body, "rays that leak", float(lost), 0.0, f"of {2 * count:,}")
    else:
        leak = Figure(body, "share of rays that leak", lost / (2 * count), _AIMED_GATE, f"of {2 * count:,}")
    return [leak, Figure(body, "warnings", float(len(caught)), 0.0)]


def _unit(vectors: Float64Array) -> np.ndarray:
    return (vectors / np.linalg.norm(vectors, axis=1, keepdims=True)).astype(np.float32)


def _in_planes(body: str, open_tracer: OpenTracer) -> list[Figure]:
    """Axis-parallel rays that start in the plane of an axis-aligned grid, on its vertices and edges.

    None has a right answer but one: what it returns is finite, and a hit lies on the face that is named.
    """
    world = _world(flat(-4.0, 4.0, -4.0, 4.0, 0.0, 8))
    points = world.positions.astype(np.float32)
    mids = 0.5 * (points[world.faces[:, 0]] + points[world.faces[:, 1]])
    axes = np.concatenate([np.eye(3), -np.eye(3), _unit(np.array([[1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]]))])
    starts = np.concatenate([points, mids, points + np.float32(1e-3)])
    origins = np.repeat(starts, len(axes), axis=0)
    directions = np.tile(axes.astype(np.float32), (len(starts), 1))
    with warned() as caught, open_tracer(body, world, BakeSettings()) as tracer:
        found = tracer.nearest(origins, directions, 100.0)
    hit = found.face >= 0
    corners = world.positions[world.faces[found.face[hit]]]
    weights = np.column_stack([found.weights[hit], 1.0 - found.weights[hit].sum(axis=1)]).astype(np.float64)
    named = np.einsum("ij,ijk->ik", weights, corners)
    reached = origins[hit] + directions[hit] * found.distance[hit, None]
    return [
        Figure(body, "values not finite", not_finite(found.weights, found.cosine, found.distance[hit]), 0.0),
        Figure(body, "hits off their face, m", float(np.abs(named - reached).max(initial=0.0)), 1e-4),
        Figure(body, "warnings", float(len(caught)), 0.0),
    ]


def tracers_here(cuda: Device | None) -> list[str]:
    """Bodies that this machine can trace with."""
    from importlib.util import find_spec

    bodies = ["embree"] if find_spec("embreex") is not None else []
    return [*bodies, "warp", *(["cuda"] if cuda is not None else []), "brute"]
