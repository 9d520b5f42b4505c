"""The values of a bake after a small change, without solving for all of them again."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from bake.change_types import WorldChange
from bake.errors import SolveError
from bake.settings import BakeSettings
from bake.solve.block import Bake, Block, begun, cut_into_blocks, drafted
from bake.solve.block_field import read_values, report_of, write_unbaked, write_values
from bake.solve.block_solve import Solved, begin_values, solve_whole
from bake.solve.block_step import BlockStep
from bake.solve.conjugate_gradient import Columns
from bake.solve.far_fill import Sources, filled_from_afar, find_sources
from bake.solve.object_match import Match, receivers
from bake.solve.prior import ScatterSums, SceneScatter
from bake.solve.regroup import regroup
from bake.solve.weld import weld_quantum
from bake.types import (
    BoolArray,
    Float32Array,
    Int64Array,
    SampleSet,
    SolveReport,
    UInt8Array,
    VertexField,
    VertexState,
    World,
)

TOLERANCE = 5e-4
"""How far values may be from those of a whole solve, in AO, unless told otherwise: an eighth of 1/255."""

NONE = 255
"""In place of a `VertexState`: the vertex was not there."""

A = TypeVar("A")
B = TypeVar("B")


@dataclass(frozen=True, slots=True)
class FieldUpdate:
    """What became of the values.

    Attributes:
        keeper: Of the changed bake; the one before it stays as it was.
        field: The changed bake's values.
        vertices: Shape (n,), int64, sorted: vertices of the changed world whose value or state is another one, and
            those that it did not have before.
        bound: Estimate of how far any value may be from that of a whole solve, in AO.
        solved: Unknowns that were solved for.
    """

    keeper: FieldKeeper
    field: VertexField
    vertices: Int64Array
    bound: float
    solved: int


@dataclass(frozen=True, slots=True)
class _State:
    """A keeper's insides."""

    bake: Bake
    blocks: tuple[Block, ...]
    sources: Sources
    extent: float


class FieldKeeper:
    """The values of one bake and what they hang on, kept to follow small changes.

    Args:
        world: The flattened scene.
        samples: Where AO was estimated.
        ao: Shape (n, k), float32, in [0, 1]: AO of the samples.
        valid: Shape (n,), bool: samples to use.
        settings: Mapping, alpha, welding.
        field: What `map_to_vertices` makes of these, solved to the end; solved for if None.

    Attributes:
        field: The values.

    Raises:
        SolveError: a value that should be used is not finite.
    """

    def __init__(
        self,
        world: World,
        samples: SampleSet,
        ao: Float32Array,
        valid: BoolArray,
        settings: BakeSettings,
        *,
        field: VertexField | None = None,
    ) -> None:
        _check_finite(ao[valid])
        bake = Bake.of(world, samples, ao, valid, settings)
        extent = bake.extent()
        groups = cut_into_blocks(world, receivers(world), weld_instances=settings.weld_instances)
        drafts = _each(lambda objects: drafted(bake, objects, extent), groups)
        scene = _mean(draft.sums for draft in drafts)
        blocks = _each(lambda draft: begun(draft, scene), drafts)
        new = [-1] * len(blocks)
        sources = find_sources([block.places for block in blocks], [None] * len(blocks), new, Sources.none())
        filled = filled_from_afar([block.equations for block in blocks], sources)
        blocks = [replace(block, equations=own) for block, own in zip(blocks, filled, strict=True)]
        if field is None:
            blocks = [replace(block, values=block.equations.average) for block in blocks]
            solved = _solved(
                blocks,
                lambda block, columns: solve_whole(
                    block, settings.alpha, settings.mapping, 0.0, columns, settings.device
                ),
            )
            blocks = [one.block for one in solved]
            field = _field_of(bake, blocks, solved)
        else:
            known = field
            blocks = _each(
                lambda block: begin_values(
                    block, read_values(world, block, known.ao), settings, averaged=known.report.averaged > 0
                ),
                blocks,
            )
        self.field: VertexField = field
        self._state = _State(bake, tuple(blocks), sources, extent)

    def updated(
        self,
        world: World,
        samples: SampleSet,
        ao: Float32Array,
        valid: BoolArray,
        change: WorldChange | None,
        changed_rows: Int64Array,
        settings: BakeSettings,
        *,
        tolerance: float = TOLERANCE,
    ) -> FieldUpdate:
        """The values after a change; this keeper stays as it is.

        Args:
            world, samples, ao, valid: The changed bake's.
            change: How its world follows from this keeper's; None if it is the same.
            changed_rows: Shape (r,), int64: rows of `samples` whose AO or validity is another one than before. Those
                on faces of objects that receive anew need not be named.
            settings: The changed bake's.
            tolerance: How far values may be from those of a whole solve, in AO; 0 for a whole solve.

        Raises:
            SolveError: a value that should be used is not finite.
        """
        old = self._state
        _check_finite(ao[changed_rows[valid[changed_rows]]])
        bake = Bake.of(world, samples, ao, valid, settings)
        extent = old.extent if change is None else bake.extent()
        before, state = self._carried(world, change, ao.shape[1])
        if self._is_another(settings, ao, extent):
            keeper = FieldKeeper(world, samples, ao, valid, settings)
            changed = _differing(before, state, keeper.field)
            return FieldUpdate(keeper, keeper.field, changed, 0.0, keeper.field.report.unknowns)

        groups, matches = regroup(
            old.bake.world,
            [block.objects for block in old.blocks],
            world,
            change,
            weld_instances=settings.weld_instances,
        )
        steps = [BlockStep(group, old.blocks[group.before] if group.before >= 0 else None) for group in groups]
        faces = _changed_faces(bake, change, matches, changed_rows)
        _each(lambda step: step.gather(bake, extent, faces), steps)
        scene = _mean(step.sums for step in steps)
        _each(lambda step: step.assemble(scene), steps)
        came_from = [step.came_from for step in steps]
        places, past = [step.places for step in steps], [step.past for step in steps]
        sources = find_sources(places, past, came_from, old.sources)
        filled = filled_from_afar([step.equations for step in steps], sources)
        for step, equations in zip(steps, filled, strict=True):
            step.equations = equations
        moving = [step for step in steps if not step.resting(settings, old.bake.settings, tolerance)]
        solved = _solved(
            moving,
            lambda step, columns: step.solve(bake, old.bake.settings, scene, before, tolerance, columns),
        )
        now = {id(step): one.block for step, one in zip(moving, solved, strict=True)}
        blocks = [now.get(id(step), step.block) for step in steps]
        field = _field_after(
            bake, blocks, [step.another(now.get(id(step))) for step in steps], solved, matches, before, state
        )
        bound = max((one.missed for one in solved), default=0.0)
        keeper = FieldKeeper.__new__(FieldKeeper)
        keeper.field, keeper._state = field, _State(bake, tuple(blocks), sources, extent)
        changed = _differing(before, state, field)
        return FieldUpdate(keeper, field, changed, bound, sum(one.unknowns for one in solved))

    def _carried(self, world: World, change: WorldChange | None, columns: int) -> tuple[Float32Array, UInt8Array]:
        """Values and states of before at the world's vertices; NaN and `NONE` where there were none."""
        count = len(self.field.ao)
        if change is None or (world.vertex_count == count and np.array_equal(change.old_vertex, np.arange(count))):
            return self.field.ao, self.field.state
        ao = np.full((world.vertex_count, columns), np.nan, np.float32)
        state = np.full(world.vertex_count, NONE, np.uint8)
        told = np.flatnonzero(change.old_vertex >= 0)
        ao[told], state[told] = self.field.ao[change.old_vertex[told]], self.field.state[change.old_vertex[told]]
        return ao, state

    def _is_another(self, settings: BakeSettings, ao: Float32Array, extent: float) -> bool:
        """Whether the surface itself is another one, and nothing can be carried over."""
        old = self._state
        return (
            (settings.crease_angle, settings.weld_instances)
            != (old.bake.settings.crease_angle, old.bake.settings.weld_instances)
            or ao.shape[1] != old.bake.ao.shape[1]
            or weld_quantum(extent) != weld_quantum(old.extent)
        )


def _changed_faces(
    bake: Bake, change: WorldChange | None, matches: Sequence[Match], changed_rows: Int64Array
) -> Int64Array:
    """Faces whose samples changed, sorted: those named, and all of objects that receive anew or moved."""
    touched = np.zeros(bake.world.face_count, np.bool_)
    touched[bake.samples.face[changed_rows]] = True
    if change is not None:
        moved = np.array([match is Match.MOVED for match in matches], np.bool_)
        touched |= (change.object_receives_anew | moved)[bake.world.face_object]
    return np.flatnonzero(touched)


def _field_of(bake: Bake, blocks: Sequence[Block], solved: Sequence[Solved]) -> VertexField:
    """The field of blocks that are all of a scene."""
    world = bake.world
    ao = np.full((world.vertex_count, bake.ao.shape[1]), np.nan, np.float32)
    state = np.full(world.vertex_count, VertexState.UNREFERENCED, np.uint8)
    write_unbaked(world, np.setdiff1d(np.arange(world.object_count), receivers(world)), ao, state)
    for block in blocks:
        write_values(world, block, ao, state)
    return VertexField(ao, state, _report(bake, blocks, solved))


def _field_after(
    bake: Bake,
    blocks: Sequence[Block],
    written: Sequence[bool],
    solved: Sequence[Solved],
    matches: Sequence[Match],
    before: Float32Array,
    state: UInt8Array,
) -> VertexField:
    """The field where only some blocks have other values than before."""
    ao, state = before.copy(), state.copy()
    receiving = receivers(bake.world)
    other = np.array([match is Match.OTHER for match in matches], np.bool_)
    other[receiving] = False
    write_unbaked(bake.world, np.flatnonzero(other), ao, state)
    for block, anew in zip(blocks, written, strict=True):
        if anew:
            write_values(bake.world, block, ao, state)
    return VertexField(ao, state, _report(bake, blocks, solved))


def _report(bake: Bake, blocks: Sequence[Block], solved: Sequence[Solved]) -> SolveReport:
    iterations = max((one.iterations for one in solved), default=0)
    residual = max((one.residual for one in solved), default=0.0)
    return report_of(blocks, bake.ao.shape[1], bake.settings.alpha, iterations, residual)


def _differing(before: Float32Array, state: UInt8Array, field: VertexField) -> Int64Array:
    """Vertices whose value or state is another one than before, sorted."""
    same = (field.ao == before) | (np.isnan(field.ao) & np.isnan(before))
    return np.flatnonzero(~same.all(axis=1) | (state != field.state))


def _mean(sums: Iterable[ScatterSums]) -> SceneScatter:
    total = ScatterSums(0.0, 0.0, 0.0, 0.0, 0.0)
    for one in sums:
        total = total.plus(one)
    return total.mean()


def _check_finite(ao: Float32Array) -> None:
    if not np.isfinite(ao).all():
        raise SolveError("a valid sample has no finite AO", where="samples", remedy="trace the scene again")


def _each(function: Callable[[A], B], items: Iterable[A]) -> list[B]:
    """The function's answers, side by side: NumPy and SciPy let go of the interpreter while they work."""
    every = list(items)
    if len(every) < 2:
        return [function(item) for item in every]
    with ThreadPoolExecutor(os.cpu_count() or 1, "solve") as pool:
        return list(pool.map(function, every))


def _solved(items: Sequence[A], solve: Callable[[A, Columns], Solved]) -> list[Solved]:
    """Blocks side by side, or the distances of one alone."""
    if len(items) > 1:
        return _each(lambda item: solve(item, map), items)
    with ThreadPoolExecutor(os.cpu_count() or 1, "solve") as pool:
        return [solve(item, pool.map) for item in items]
