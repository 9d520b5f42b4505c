"""What rebakes left out so far, in the numbering of the newest."""

from __future__ import annotations

import numpy as np

from bake.decorators.trees import BakedTrees
from bake.rebake.known_trees import KnownTrees
from bake.rebake.state import State
from bake.types import Float32Array, Skipped


def skipped_after(
    state: State,
    samples: Float32Array,
    trees: BakedTrees | None,
    known: KnownTrees | None,
    points: Float32Array | None = None,
) -> Skipped | None:
    """What was skipped, this rebake included; None if it is nothing.

    Args:
        state: Before the edit.
        samples: Of the edited world's samples.
        trees: As they are now.
        known: What of them was carried; None if all were baked anew or none reached.
        points: Of the traced points of the regions.
    """
    nothing = np.zeros(0, np.float32)
    voxels, fits = nothing, nothing
    if trees is not None:
        decorators, kept = state.result.decorators, state.result.skipped
        untouched = decorators is not None and trees.volume is decorators.volume
        if known is not None:
            voxels = known.skipped_voxels
            fits = np.array([known.skipped_trees.get(int(number), 0.0) for number in trees.fits.object], np.float32)
        elif untouched and kept is not None:
            voxels, fits = kept.voxels, kept.trees
    found = Skipped(samples, voxels, fits, nothing if points is None else points)
    every = (found.samples, found.voxels, found.trees, found.points)
    return found if any(part.any() for part in every) else None
