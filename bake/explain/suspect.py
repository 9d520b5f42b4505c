"""What every test for a cause is given: the explained spot, what was measured there, and the bake behind it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.explain.evidence import Evidence
from bake.explain.explainer import Explainer
from bake.explain.looks import mean_ao
from bake.explain.types import Explanation
from bake.types import Float64Array, World


@dataclass(frozen=True, slots=True)
class Suspect:
    """A spot under suspicion.

    Attributes:
        explainer: Of the bake.
        evidence: What was measured.
    """

    explainer: Explainer
    evidence: Evidence

    @property
    def world(self) -> World:
        """The flattened scene."""
        return self.explainer.result.world

    @property
    def explanation(self) -> Explanation:
        """Of the spot."""
        return self.evidence.explanation

    @property
    def object(self) -> int:
        """The object that the spot lies on."""
        return self.explanation.spot.object

    @property
    def path(self) -> str:
        """Its path."""
        return self.world.object_paths[self.object]

    def change(self, ao: Float64Array) -> float:
        """How much the value changes if the heavy samples have other AO, shape (h,)."""
        heavy = self.evidence.heavy
        return float(heavy.weight @ (ao - heavy.ao))

    def retraced(self, origins: Float64Array, directions: Float64Array) -> Float64Array:
        """AO of the heavy samples by other rays, shape (h,), at the distance looked at.

        Args:
            origins: Shape (h, 3).
            directions: Shape (h, r, 3).
        """
        return mean_ao(self.explainer.tracer, origins, directions)[:, self.evidence.column]

    def longest_side(self) -> float:
        """Of the box around all that casts or receives, metres."""
        world = self.world
        used = np.zeros(world.vertex_count, np.bool_)
        used[world.faces[world.face_casts | world.face_samples].ravel()] = True
        return float(np.ptp(world.positions[used], axis=0).max(initial=0.0)) if used.any() else 0.0
