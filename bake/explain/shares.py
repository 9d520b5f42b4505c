"""Who takes away how much: samples → rays → objects, adding up to 1 - value.

A ray counts for ρ(d) T, where T is what fog and trees let through before its end at distance d. What is missing to 1,

    1 - ρ T = (1 - ρ) T + (1 - T),

falls to the face that stopped the ray, seen through the veil, and to the veil; within the veil it is shared by optical
depth.
"""

from __future__ import annotations

import math

import numpy as np

from bake.explain.types import Carried, Share, ShareKind, Spot, TracedRays, WeighedSamples
from bake.solve.scatter import scatter_add
from bake.types import BoolArray, Float64Array, Int64Array, World

NAMES = {
    ShareKind.BOUNDS: "(values held within 0 to 1)",
    ShareKind.UNTRACED: "(samples of little weight)",
    ShareKind.RESIDUAL: "(rounding)",
}

NEAREST_BAND = 0.25
"""Metres: samples this near are one band, the next ends at twice that, and so on."""


def roll_up(
    world: World, spot: Spot, value: Float64Array, samples: WeighedSamples, rays: TracedRays, bounds: Float64Array
) -> tuple[Share, ...]:
    """All shares of 1 - value, the largest at the longest distance first; rounding comes last.

    Args:
        world: The scene.
        spot: Where.
        value: Shape (k,), float64.
        samples: All that weigh.
        rays: The rays of the first `samples.traced`.
        bounds: Shape (k,), float64: what the bounds add to the value.
    """
    shares = _of_objects(world, spot, samples, rays)
    rest = slice(samples.traced, None)
    if samples.traced < len(samples):
        lost = samples.weight[rest, None] * (1.0 - samples.ao[rest].astype(np.float64))
        shares.append(_nameless(ShareKind.UNTRACED, lost.sum(axis=0), lost[samples.own[rest]].sum(axis=0)))
    if bounds.any():
        shares.append(_nameless(ShareKind.BOUNDS, -bounds, -bounds))
    shares.sort(key=lambda item: -abs(float(item.share[-1])))
    total = np.sum([item.share for item in shares], axis=0) if shares else np.zeros(len(value))
    left = 1.0 - value - total
    return (*shares, _nameless(ShareKind.RESIDUAL, left, left))


def carried_from(samples: WeighedSamples) -> tuple[Carried, ...]:
    """What samples that are not on the spot's own faces bring, by object and distance, the most first."""
    away = np.flatnonzero(~samples.own)
    band = np.maximum(np.ceil(np.log2(np.maximum(samples.distance[away], 1e-9) / NEAREST_BAND)), 0.0).astype(np.int64)
    key = samples.object[away].astype(np.int64) * 1024 + band
    found: list[Carried] = []
    for value in np.unique(key):
        those = away[key == value]
        weight = samples.weight[those]
        index = int(value % 1024)
        found.append(
            Carried(
                object=int(value // 1024),
                nearest=0.0 if index == 0 else NEAREST_BAND * 2.0 ** (index - 1),
                farthest=NEAREST_BAND * 2.0**index,
                weight=float(weight.sum()),
                share=weight @ (1.0 - samples.ao[those].astype(np.float64)),
                samples=len(those),
            )
        )
    return tuple(sorted(found, key=lambda item: -float(np.abs(item.share).max())))


def _of_objects(world: World, spot: Spot, samples: WeighedSamples, rays: TracedRays) -> list[Share]:
    """One share an object that stops or dims a ray."""
    count, columns = world.object_count, rays.rho.shape[2]
    per_ray = np.repeat(samples.weight[: samples.traced] / max(rays.face.shape[1], 1), rays.face.shape[1])
    own = np.repeat(samples.own[: samples.traced], rays.face.shape[1])
    passes = rays.passes.ravel().astype(np.float64)
    stopped = np.flatnonzero(rays.object.ravel() >= 0)
    stopper = rays.object.ravel()[stopped]
    crossing, dimming = rays.crossings, _split_by_depth(rays, passes)
    dimmer = crossing.object

    total, near = np.zeros((count, columns)), np.zeros((count, columns))
    for k in range(columns):
        lost = per_ray * (1.0 - rays.rho[:, :, k].ravel().astype(np.float64)) * passes
        for rows, into in ((stopped, total), (stopped[own[stopped]], near)):
            into[:, k] += scatter_add(rays.object.ravel()[rows], lost[rows], count)
        veil = per_ray[crossing.ray] * dimming
        total[:, k] += scatter_add(dimmer, veil, count)
        near[:, k] += scatter_add(dimmer, np.where(own[crossing.ray], veil, 0.0), count)

    once, again = _sent_once(rays, stopped), _sent_once(rays, crossing.ray)
    seen = _rays_of(count, stopped[once], stopper[once], crossing.ray[again], dimmer[again])
    nearest = np.full(count, math.inf)
    np.minimum.at(nearest, stopper, rays.distance.ravel()[stopped].astype(np.float64))
    return [
        Share(
            kind=ShareKind.OBJECT,
            object=int(number),
            name=world.object_paths[number],
            share=total[number],
            own=near[number],
            is_self=int(number) == spot.object,
            rays=int(seen[number]),
            nearest=float(nearest[number]),
        )
        for number in np.flatnonzero(seen)
    ]


def _sent_once(rays: TracedRays, ray: Int64Array) -> BoolArray:
    """Which of some rays, counted through, do not stand for an earlier one of their sample."""
    most = rays.face.shape[1]
    return ray % max(most, 1) < rays.sent[ray // max(most, 1)]


def _split_by_depth(rays: TracedRays, passes: Float64Array) -> Float64Array:
    """Each crossing's part of what its ray loses to fog and trees, shape (c,)."""
    crossing = rays.crossings
    depth = crossing.depth.astype(np.float64)
    sums = scatter_add(crossing.ray, depth, len(passes))
    along = sums[crossing.ray]
    part: Float64Array = np.divide(depth, along, out=np.zeros_like(depth), where=along > 0.0)
    return part * (1.0 - passes[crossing.ray])


def _rays_of(
    count: int, stopped: Int64Array, stopper: np.ndarray, crossed: Int64Array, dimmer: np.ndarray
) -> Int64Array:
    """How many rays each object stops or dims, a ray counted once an object, shape (count,)."""
    pairs = np.concatenate([stopped * count + stopper, crossed * count + dimmer])
    return np.bincount(np.unique(pairs) % count, minlength=count)


def _nameless(kind: ShareKind, share: Float64Array, own: Float64Array) -> Share:
    return Share(kind, -1, NAMES[kind], share, own, is_self=False, rays=0, nearest=math.inf)
