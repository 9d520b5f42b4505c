"""One block on its way from one bake to the next: sums, then equations, then values.

Between the steps all blocks have to be known: their sums make the scene's mean scatter, their averages those of
components without samples.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bake.settings import BakeSettings, MappingKind
from bake.solve.block import (
    Bake,
    Block,
    Draft,
    alpha_of_faces,
    begun,
    drafted,
    local_faces,
    moments_of_faces,
    moved,
)
from bake.solve.block_equations import update_equations
from bake.solve.block_field import read_values
from bake.solve.block_solve import Solved, solve_block, solve_whole
from bake.solve.conjugate_gradient import Columns
from bake.solve.far_fill import Places
from bake.solve.mass import FaceMoments
from bake.solve.prior import ScatterSums, SceneScatter
from bake.solve.regroup import Group
from bake.solve.system import Equations
from bake.types import Float32Array, Int64Array

NOTHING = np.zeros(0, np.int64)


class BlockStep:
    """A block and what becomes of it.

    Args:
        group: Its objects in the changed world.
        before: As it was; None if it is taken anew.

    Attributes:
        block: As it was, in the changed world's numbers; from `assemble` on if it is taken anew.
        equations: As they are now, from `assemble` on.
        places: Where its unknowns are now, from `assemble` on.
        sums: Its part of the scene's mean scatter now, from `gather` on.
    """

    block: Block
    equations: Equations
    places: Places
    sums: ScatterSums

    def __init__(self, group: Group, before: Block | None) -> None:
        self._group, self._before = group, before
        self._draft: Draft | None = None
        self._moments: FaceMoments
        self._faces = self._zone = NOTHING

    def gather(self, bake: Bake, extent: float, faces: Int64Array) -> None:
        """Finds the surface and sums up the samples.

        Args:
            bake: The changed one.
            extent: Largest coordinate of the scene, in metres.
            faces: Shape (f,), int64, sorted: the world's faces whose samples changed, this block's among others.
        """
        objects = self._group.objects
        if self._before is None:
            self._draft = drafted(bake, objects, extent)
            self.sums = self._draft.sums
            return
        block = replace(self._before, objects=objects)
        if self._group.moved:
            block = replace(block, surface=moved(bake, objects, block.surface))
        own_alpha = alpha_of_faces(bake.world, objects)
        mine = faces[np.isin(bake.world.face_object[faces], objects)] if len(faces) else faces
        local = local_faces(bake.world, objects, mine)
        self._moments, self.sums = block.moments, block.sums
        if len(local):
            found = moments_of_faces(bake, mine)
            self._moments = block.moments.with_faces(local, found)
            past = block.moments.only(local)
            self.sums = block.sums.plus(ScatterSums.of(past), -1.0).plus(ScatterSums.of(found))
            block = replace(block, mass=block.mass - float(past.mass.sum()) + float(found.mass.sum()))
        if not np.array_equal(own_alpha, block.own_alpha, equal_nan=True):
            block = replace(block, own_alpha=own_alpha)
            local = np.arange(len(own_alpha))
        self.block, self._faces = block, local

    def assemble(self, scene: SceneScatter) -> None:
        """Brings the equations up to the sums and the scene's mean scatter."""
        if self._draft is not None:
            self.block = begun(self._draft, scene)
            self.equations, self.places = self.block.equations, self.block.places
            return
        self.equations, self.places = self.block.equations, self.block.places
        if len(self._faces) or scene != self.block.scene:
            self.equations, self._zone = update_equations(self.block, self._moments, self._faces, scene)
            starved = self.equations.starved
            if not self.places.same(self.block.surface.position, starved):
                self.places = Places(self.block.surface.position, starved, self.block.surface.first)

    @property
    def past(self) -> Places | None:
        """Where its unknowns were; None for a new block."""
        return None if self._before is None else self._before.places

    @property
    def came_from(self) -> int:
        """The block's number before; -1 for a new one."""
        return self._group.before

    def another(self, block: Block | None) -> bool:
        """Whether a block's values or states differ from those before; none is one at rest."""
        if block is None or self._before is None:
            return block is not None
        return block.values is not self._before.values or not np.array_equal(
            block.equations.starved, self._before.equations.starved
        )

    def resting(self, settings: BakeSettings, old: BakeSettings, tolerance: float) -> bool:
        """Whether nothing is left to be done."""
        same = (settings.alpha, settings.mapping) == (old.alpha, old.mapping)
        return (
            self._draft is None
            and self.equations is self.block.equations
            and same
            and self.block.tolerance <= tolerance
            and not len(self._faces)
        )

    def solve(
        self,
        bake: Bake,
        old: BakeSettings,
        scene: SceneScatter,
        before: Float32Array,
        tolerance: float,
        columns: Columns,
    ) -> Solved:
        """Solves for the values that need it.

        Args:
            bake: The changed one.
            old: Settings of the bake before.
            scene: The scene's mean scatter now.
            before: Shape (n, k), float32: values of the world's vertices before, NaN where there were none.
            tolerance: In AO; 0 for a whole solve to the end.
            columns: How distances are gone through.
        """
        settings = bake.settings
        if self._draft is not None:
            block = replace(self.block, equations=self.equations, values=self.equations.average, places=self.places)
            block = replace(block, values=read_values(bake.world, block, before))
            return solve_whole(block, settings.alpha, settings.mapping, tolerance, columns, settings.device)
        block = replace(self.block, scene=scene, sums=self.sums, places=self.places)
        if old.mapping is MappingKind.AVERAGE or settings.alpha != old.alpha or settings.mapping is not old.mapping:
            block = replace(block, equations=self.equations, moments=self._moments)
            return solve_whole(block, settings.alpha, settings.mapping, tolerance, columns, settings.device)
        return solve_block(
            block,
            self.equations,
            self._moments,
            self._zone,
            self._faces,
            alpha=settings.alpha,
            mapping=settings.mapping,
            tolerance=tolerance,
            columns=columns,
            device=settings.device,
        )
