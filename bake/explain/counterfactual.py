"""The whole surface if one object did not cast.

That is what a bake of the scene gives in which the object receives as before and casts nothing, with the same seeds:
only samples with a ray that meets the object are traced again, back-face shares and validity follow, and the fit is
solved for anew. `bake/explain/local_solve.py` does the same for one spot.
"""

from __future__ import annotations

import time
from collections.abc import Generator
from typing import TypeVar

import numpy as np

from bake.explain.types import SurfaceWithout
from bake.explain.without import Without
from bake.settings import BakeSettings
from bake.solve.mapper import VertexMapper
from bake.solve.prior import SceneScatter, scene_scatter
from bake.stages import patiently
from bake.types import BakeResult, Int64Array, Progress, Tally, VertexField, VertexState

CHUNK = 1 << 16
"""Samples that are looked at between two signs of life."""

_T = TypeVar("_T")


def surface_without(
    result: BakeResult, field: VertexField, scene: Without, wanted: int, mapper: VertexMapper, settings: BakeSettings
) -> Generator[Progress, None, tuple[SurfaceWithout, SceneScatter | None]]:
    """All values if an object did not cast; close the generator to cancel.

    Args:
        result: A bake.
        field: The values now.
        scene: The bake without the object.
        wanted: The object.
        mapper: Over the bake's samples.
        settings: Mapping, alpha and back-face threshold.

    Returns:
        The values, and the scene's mean scatter then; None if nothing changes.
    """
    begin = time.perf_counter()
    samples, old = result.samples, result.tally
    noticed = np.zeros(len(samples), np.bool_)
    new = Tally(old.ao.copy(), old.rays, old.hits.copy(), old.back_faces.copy())
    for batch in samples.batches(CHUNK if scene.casts else max(len(samples), 1)):
        rows: Int64Array = np.arange(batch.start, batch.stop, dtype=np.int64)
        rows = rows[scene.noticed(rows)]
        noticed[rows] = True
        if len(rows):
            found = scene.traced(rows)
            new.ao[rows], new.hits[rows], new.back_faces[rows] = found.ao, found.hits, found.back_faces
        yield Progress("trace", batch.stop, len(samples), time.perf_counter() - begin)
    threshold = settings.back_face_threshold
    now, then = new.valid(threshold), old.valid(threshold)
    ao, state, scatter = field.ao, field.state, None
    if noticed.any():
        solved, _ = yield from patiently("solve", lambda: mapper.solve(new.ao, now))
        scatter = scene_scatter(mapper.moments(new.ao, now))
        # what is no fit of these samples (levels of detail) stays as it is
        fitted = solved.state != VertexState.NOT_BAKED
        ao = np.where(fitted[:, None], solved.ao, field.ao)
        state = np.where(fitted, solved.state, field.state)
    found = SurfaceWithout(
        object=wanted,
        ao=ao,
        state=state,
        samples=int(noticed.sum()),
        became_valid=int((now & ~then).sum()),
        became_invalid=int((then & ~now).sum()),
        rays=int(old.rays[noticed].sum(dtype=np.int64)),
        seconds=time.perf_counter() - begin,
    )
    return found, scatter
