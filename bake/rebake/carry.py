"""What was traced before, at the samples of an edited world."""

from __future__ import annotations

import numpy as np

from bake.rebake.rows import RowMap
from bake.types import BoolArray, Tally


def carried_tally(old: Tally, rows: RowMap, *, former: bool = False) -> Tally:
    """The tally of samples as it was; zeros where there was none.

    Args:
        old: Before the edit.
        rows: Where the samples were.
        former: Samples that moved take over theirs as well.
    """
    return Tally(
        ao=rows.carried(old.ao, former=former),
        rays=rows.carried(old.rays, former=former),
        hits=rows.carried(old.hits, former=former),
        back_faces=rows.carried(old.back_faces, former=former),
    )


def marginal(tally: Tally, threshold: float, rays: int) -> BoolArray:
    """Samples that a few rays more or less would make valid or invalid, shape (n,).

    Those without any back face are not among them: only a newly seen back would turn them, which closed bodies never
    show, and a lonely hit in the open does not blacken a vertex.
    """
    hits, backs = tally.hits.astype(np.float32), tally.back_faces.astype(np.float32)
    slack = np.abs(np.float32(threshold) * hits - backs)
    return (backs > 0) & (slack <= np.float32(max(2.0, rays / 32.0)))
