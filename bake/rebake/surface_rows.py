"""The surface samples of an edited world: carried, or to be looked at because the edit can reach them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.rebake.carry import carried_tally, marginal
from bake.rebake.casters import Casters, changed_casters
from bake.rebake.changes import compare
from bake.rebake.reach import Places, reach
from bake.rebake.rows import RowMap
from bake.rebake.state import Anchor, Edit, State
from bake.types import Float32Array, Int64Array, SampleSet, Tally

CHECKED = 1.0 / 2.0
"""Share of the bound above which a sample is looked at; what is below adds up until it exceeds the bound."""

ONE_RAY = 1.0 / 4.0
"""Share of the bound that one ray may do at a sample that is not looked at."""


@dataclass(frozen=True, slots=True)
class SurfaceRows:
    """What has to be done for each sample of the edited world.

    Attributes:
        map: Where they were.
        tally: What they saw before; of those that moved too.
        whole: Shape (w,), int64, ascending: to be traced with all rays.
        check: Shape (c,), int64, ascending: to be traced where changed rays are found; none of `whole`.
        skipped: Shape (n,), float32: what is skipped after this edit, of those that are not touched.
        stale: Shape (s,), int64: those that the edit may reach, but that were told to be left alone.
        bound: Shape (n,), float32: what the edit may do to each, in AO.
        anchor: For the state after the edit.
    """

    map: RowMap
    tally: Tally
    whole: Int64Array
    check: Int64Array
    skipped: Float32Array
    stale: Int64Array
    bound: Float32Array
    anchor: Anchor


def plan_rows(state: State, edit: Edit, samples: SampleSet, where: RowMap, places: Places, bound: float) -> SurfaceRows:
    """Sorts the samples into those that are carried and those to be looked at.

    Args:
        state: Before the edit.
        edit: What differs.
        samples: Of the edited world.
        where: Where they were.
        places: Where they are.
        bound: Most that may be skipped for one.
    """
    result, world, settings = state.result, edit.world, edit.settings
    tally = carried_tally(result.tally, where, former=True)
    whole = where.lacking()
    if "rays" in edit.settings_change.names:
        whole[:] = True
    if result.stale:
        left = np.array([path in set(result.stale) for path in world.object_paths], np.bool_)
        whole |= left[world.face_object[samples.face]]
    skipped = where.carried(state.skipped)
    one_ray = ONE_RAY * bound * settings.rays
    found = reach(places, edit.casters, settings, near=CHECKED * bound, near_single=one_ray)
    counts = found.single > np.float32(one_ray)
    check = found.touched if bound <= 0.0 else (found.bound > np.float32(CHECKED * bound)) | counts
    if bound > 0.0 and len(edit.casters):
        check = check | (found.touched & marginal(tally, settings.back_face_threshold, settings.rays))
    check = check & ~whole
    skipped = np.where(check, skipped, skipped + found.bound)
    anchor = state.anchored
    untouched = where.carried(anchor.untouched) & ~check & ~whole
    before = where.carried(anchor.skipped)
    if bound > 0.0 and state.anchor is not None and (untouched & (skipped > np.float32(bound))).any():
        net = reach(places, _since(anchor, edit), settings, near=CHECKED * bound)
        skipped = np.where(untouched, np.minimum(skipped, before + net.bound), skipped)
    whole |= ~check & (skipped > np.float32(bound))
    stale = np.zeros(0, np.int64)
    if edit.selects:  # what nobody asked for stays as it was, if it was ever traced
        left = ~edit.wanted_faces[samples.face] & ~where.lacking(former=True)
        stale = np.flatnonzero(left & (whole | check))
        whole &= ~left
        check = check & ~left
    skipped[whole] = 0.0
    anchor = Anchor(anchor.world, anchor.fog, before, untouched & ~whole)
    return SurfaceRows(where, tally, np.flatnonzero(whole), np.flatnonzero(check), skipped, stale, found.bound, anchor)


def _since(anchor: Anchor, edit: Edit) -> Casters:
    """What rays see differently since the session began."""
    change = compare(anchor.world, edit.world)
    return changed_casters(anchor.world, edit.world, change, anchor.fog, edit.fog)
