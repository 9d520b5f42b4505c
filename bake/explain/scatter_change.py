"""The mean scatter of a scene's samples after a change, without tracing all of it.

The fit pools what each vertex knows of its noise with the mean face of the scene (`bake.solve.prior`). Faces near a
changed object are traced again, all or many of them, and some of the rest. What was known of these faces before is
taken out of the stored mean, and what was found now put in: where nothing changes, nothing changes to the last bit.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from bake.explain.explainer import Explainer
from bake.explain.patch import cut_out
from bake.solve import VertexMapper
from bake.solve.prior import SceneScatter, scene_scatter, usable_faces
from bake.trace import Tracer
from bake.types import BoolArray, Float32Array, SampleSet, Tally, World

NEAR_FACES = 4000
"""Most faces near the changed objects that are traced again."""

FAR_FACES = 600
"""Faces of the rest."""


@dataclass(frozen=True, slots=True)
class _Sums:
    """Scatter summed over faces: the mean and how many faces had enough samples."""

    mean: SceneScatter
    faces: float


def changed_scatter(
    explainer: Explainer, tracer: Tracer, samples: SampleSet, paths: set[str]
) -> tuple[SceneScatter, int]:
    """The mean scatter of the changed scene, and how many samples were traced for it.

    Args:
        explainer: Of the stored bake.
        tracer: Of the changed scene.
        samples: All samples of the changed scene.
        paths: The objects that changed.
    """
    world, before = tracer.world, explainer.result
    random = np.random.default_rng(1)
    takes = world.face_samples | before.world.face_samples
    near = _near(world, paths, min(before.settings.column_distances)) & takes
    total = scene_scatter(explainer.mapper.moments(before.tally.ao, explainer.valid))
    everywhere = _Sums(total, _usable(explainer))
    traced = 0
    for stratum, most in ((near, NEAR_FACES), (takes & ~near, FAR_FACES)):
        members = np.flatnonzero(stratum)
        if not len(members):
            continue
        chosen = np.zeros(world.face_count, np.bool_)
        chosen[random.choice(members, min(most, len(members)), replace=False)] = True
        blown = len(members) / int(chosen.sum())
        part, own, rows, _ = cut_out(world, samples, chosen)
        tally = trace_all(tracer, samples.only(rows))
        now = _sums(part, own, tally.ao, tally.valid(tracer.settings.back_face_threshold), tracer)
        former_part, former, former_rows, _ = cut_out(before.world, before.samples, chosen)
        stored = before.tally.ao[former_rows], explainer.valid[former_rows]
        then = _sums(former_part, former, *stored, explainer.tracer)
        everywhere = _exchanged(everywhere, then, now, blown)
        traced += len(rows)
    return everywhere.mean, traced


def trace_all(tracer: Tracer, samples: SampleSet) -> Tally:
    """Traces some samples."""
    tally = Tally.empty(len(samples), tracer.settings.distance_count)
    for batch in samples.batches(tracer.batch_size):
        tracer.accumulate(samples, batch, tally)
    return tally


def _near(world: World, paths: set[str], reach: float) -> BoolArray:
    """Faces in the boxes around the named objects, grown by `reach`, shape (m,)."""
    found = np.zeros(world.face_count, np.bool_)
    middle = world.positions[world.faces].mean(axis=1)
    for number, path in enumerate(world.object_paths):
        if path in paths:
            own = world.positions[world.first_vertex[number] : world.first_vertex[number + 1]]
            found |= np.all((middle > own.min(axis=0) - reach) & (middle < own.max(axis=0) + reach), axis=1)
            found[world.first_face[number] : world.first_face[number + 1]] = True
    return found


def _usable(explainer: Explainer) -> float:
    """Faces of the stored bake whose samples show their noise."""
    moments = explainer.mapper.moments(explainer.result.tally.ao, explainer.valid)
    return float(np.count_nonzero(usable_faces(moments)))


def _sums(part: World, samples: SampleSet, ao: Float32Array, valid: BoolArray, tracer: Tracer) -> _Sums:
    moments = VertexMapper(part, samples, tracer.settings).moments(ao, valid)
    return _Sums(scene_scatter(moments), float(np.count_nonzero(usable_faces(moments))))


def _exchanged(everywhere: _Sums, then: _Sums, now: _Sums, blown: float) -> _Sums:
    """The sums with some faces' former part taken out and the new one put in, both blown up to their stratum."""
    faces = max(everywhere.faces + blown * (now.faces - then.faces), 1.0)

    def mean(name: str) -> float:
        whole, old, new = (float(getattr(sums.mean, name)) for sums in (everywhere, then, now))
        return max(whole * everywhere.faces + blown * (new * now.faces - old * then.faces), 0.0) / faces

    return _Sums(SceneScatter(**{item.name: mean(item.name) for item in fields(SceneScatter)}), faces)
