"""Which face each primitive of a tracer stands for, when the structure of an earlier world goes on being used."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.change_types import WorldChange
from bake.types import BoolArray, Int32Array, World

WORN_SHARE = 0.2
"""Share of primitives that are gone or were added, above which everything is built anew."""

WORN_COUNT = 1 << 12
"""And how many they are at least."""


@dataclass(frozen=True, slots=True)
class Primitives:
    """The primitives of two structures, counted through: one kept since it was built, one of what was added since.

    Attributes:
        kept: Shape (p,), int32, index into `World.faces`: the face of each primitive kept; -1 where it is gone.
        added: Shape (q,), int32, ascending: the faces in the second structure.
    """

    kept: Int32Array
    added: Int32Array

    @staticmethod
    def of(faces: BoolArray) -> Primitives:
        """All primitives in one structure: those of the faces marked, shape (m,)."""
        return Primitives(np.flatnonzero(faces).astype(np.int32), np.zeros(0, np.int32))

    def followed(self, faces: BoolArray, change: WorldChange) -> Primitives:
        """The same structure in the edited world.

        Args:
            faces: Shape (m,): the faces of the edited world that are to be found among the primitives.
            change: What was edited.
        """
        kept = np.where(self.kept >= 0, change.new_face[self.kept], np.int32(-1))
        kept[kept >= 0] = np.where(faces[kept[kept >= 0]], kept[kept >= 0], np.int32(-1))
        missing = faces.copy()
        missing[kept[kept >= 0]] = False
        return Primitives(kept, np.flatnonzero(missing).astype(np.int32))

    @property
    def gone(self) -> BoolArray:
        """Which of all primitives are gone, shape (p + q,)."""
        return self.faces < 0

    @property
    def faces(self) -> Int32Array:
        """The face of every primitive, -1 where it is gone, shape (p + q,)."""
        return np.concatenate((self.kept, self.added)) if len(self.added) else self.kept

    @property
    def worn(self) -> bool:
        """Whether so much is gone or was added that building anew serves better."""
        count = int(np.count_nonzero(self.kept < 0)) + len(self.added)
        return count > max(WORN_COUNT, WORN_SHARE * len(self.kept)) or not (self.kept >= 0).any()


def compact(world: World, points: np.ndarray, faces: Int32Array) -> tuple[np.ndarray, np.ndarray]:
    """Some of a world's faces with only the points that they use: shapes (u, 3) and (f, 3), uint32."""
    used, corners = np.unique(world.faces[faces], return_inverse=True)
    return points[used], corners.reshape(-1, 3).astype(np.uint32)
