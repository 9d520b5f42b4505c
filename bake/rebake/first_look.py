"""The first picture of an edit: a few rays of the samples that it can do most to, before all others are looked at."""

from __future__ import annotations

import numpy as np

from bake.rebake.preview import DeltaPreview
from bake.rebake.reach import BLOCK, Places, nearest_blocks
from bake.rebake.state import Edit, State
from bake.rebake.surface_trace import traced
from bake.rebake.types import Partial
from bake.trace import Tracer
from bake.trace.changed_rays import ChangedRays
from bake.types import Int64Array

RAYS = 4
"""Rays of each sample near what changed that are looked at."""

MOST_SAMPLES = 1 << 16
"""Samples near what changed that are looked at."""

THIN = 8
"""One in so many of the samples that moved is traced whole; they are traced again when all are."""

MOST_RAYS = 1 << 14
"""Most rays of samples that moved."""


def can_look(state: State, edit: Edit) -> bool:
    """Whether the samples are still numbered as they were, and all is at hand that a first look needs."""
    old, new = state.result.world, edit.world
    return (
        state.tracer is not None
        and state.places is not None
        and len(edit.casters) > 0
        and not edit.selects
        and not edit.settings_change.names
        and old.object_paths == new.object_paths
        and np.array_equal(old.first_face, new.first_face)
        and np.array_equal(old.first_vertex, new.first_vertex)
    )


def first_look(state: State, edit: Edit, tracer: Tracer) -> tuple[Partial, int]:
    """Estimates of what changes most, and the rays that they took.

    What is read off a few rays is noisy, but right on average, and it is there before anybody has gone through all
    samples of the level.

    Args:
        state: Before the edit.
        edit: What differs; `can_look` has to hold.
        tracer: Of the edited world.
    """
    assert state.tracer is not None and state.places is not None
    samples, settings = state.result.samples, edit.settings
    moved, rows = _chosen(state, edit, state.places)
    found: list[Partial] = []
    rays = 0
    if len(moved):
        own = samples.only(moved)
        after = traced(tracer, own)
        rays += len(moved) * settings.rays
        delta = after.ao - state.result.tally.ao[moved]
        known = np.ones(len(moved), np.bool_)
        found.append(DeltaPreview(state.result, edit, own).partial(np.arange(len(moved)), delta, known, 0, 0))
    if len(rows):
        near = samples.only(rows)
        low, high = edit.casters.boxes
        opaque = np.concatenate([edit.casters.before.opaque, edit.casters.after.opaque])
        part = min(RAYS, settings.rays)
        with ChangedRays(state.tracer, tracer, edit.change, low, high, opaque) as changed:
            change = changed.trace(near, rays=slice(0, part))
        rays += int(change.traced.sum(dtype=np.int64))
        hit = np.flatnonzero(change.changed)
        estimate = (change.ao[hit] * (settings.rays / part)).astype(np.float32)
        found.append(DeltaPreview(state.result, edit, near).spread(hit, estimate, 0, 0))
    return _joined(found, rays, edit), rays


def _chosen(state: State, edit: Edit, places: Places) -> tuple[Int64Array, Int64Array]:
    """Rows of samples that moved, a thin spread of them, and of others near what changed."""
    result, change = state.result, edit.change
    objects = np.flatnonzero(change.object_receives_anew)
    ends = result.world.first_face[np.stack((objects, objects + 1))].astype(result.samples.face.dtype)
    spans = np.searchsorted(result.samples.face, ends)
    runs: list[Int64Array] = [np.arange(a, b) for a, b in spans.T.tolist()]
    moved: Int64Array = np.concatenate([np.zeros(0, np.int64), *runs])
    blocks = nearest_blocks(places, edit.casters, edit.settings, MOST_SAMPLES // BLOCK)
    rows = (blocks[:, None] * BLOCK + np.arange(BLOCK)).ravel()
    rows = rows[rows < len(places)]
    rows = rows[change.new_face[result.samples.face[rows]] >= 0]
    step = -(-len(moved) * edit.settings.rays // MOST_RAYS)
    return moved[:: max(step, THIN)], rows


def _joined(parts: list[Partial], rays: int, edit: Edit) -> Partial:
    """All vertices of several partials, ascending; what comes twice has the value of the first."""
    columns = edit.settings.distance_count
    vertices = np.concatenate([np.zeros(0, np.int64), *(part.vertices for part in parts)])
    ao = np.concatenate([np.zeros((0, columns), np.float32), *(part.ao for part in parts)])
    vertices, first = np.unique(vertices, return_index=True)
    return Partial(vertices, ao[first], rays, max(rays, 1))
