"""A block's equations after some of its samples changed, assembled anew only where they can differ.

A face's samples enter the rows of its corners and, through the masses that bound the regulariser, those of the
butterflies there: all within two rings. A fill reaches as far as the vertices without samples do.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.solve.block import Block
from bake.solve.mass import FaceMoments
from bake.solve.part import SurfacePart, part_of
from bake.solve.prior import SceneScatter
from bake.solve.regulariser import EdgeTerms
from bake.solve.scatter import scatter_add
from bake.solve.system import Equations, build_equations
from bake.types import Int64Array

WORTHWHILE = 0.4
"""Share of the block's faces beyond which all of it is assembled."""

SPREAD = 0.1
"""Share of changed faces beyond which nobody looks how large a part they make."""


def update_equations(
    block: Block, moments: FaceMoments, faces: Int64Array, scene: SceneScatter
) -> tuple[Equations, Int64Array]:
    """The equations for other sums.

    Args:
        block: As it was.
        moments: The sums as they are now.
        faces: Shape (f,), int64: those whose sums differ.
        scene: The mean scatter of the scene now.

    Returns:
        The equations, and the unknowns whose rows may differ otherwise than by the scene's mean scatter, sorted.
    """
    count, total = block.surface.unknown_count, len(block.surface.corners)
    rows = zone = np.arange(0)
    if len(faces) <= SPREAD * total:
        zone = _zone(block, moments, faces)
        if len(zone) <= WORTHWHILE * count:
            rows = _distinct(block.faces_of(np.flatnonzero(block.rings(zone, 2))), total)
    if len(faces) > SPREAD * total or max(len(zone) / count, len(rows) / total) > WORTHWHILE:
        whole = build_equations(block.surface, moments, block.own_alpha, scene)
        return whole, np.arange(count)
    equations = block.equations
    if scene != block.scene:
        equations = replace(equations, trust=equations.trust.under(scene))
    if not len(zone):
        return equations, zone
    part = part_of(block.surface, rows)
    own_alpha = block.own_alpha[rows]
    found = build_equations(part.surface, moments.only(rows), own_alpha, scene)
    return _spliced(equations, part, found, zone, count), zone


def _zone(block: Block, moments: FaceMoments, faces: Int64Array) -> Int64Array:
    """The unknowns whose rows may differ, sorted."""
    touched = _distinct(block.surface.corners[faces].ravel(), block.surface.unknown_count)
    if not len(touched):
        return touched
    around = block.faces_of(touched)
    mass = scatter_add(block.surface.corners[around], moments.mass[around], block.surface.unknown_count)
    either = block.equations.starved.copy()  # without samples before or now
    either[touched] |= mass[touched] <= 0.0
    near = block.rings(touched, 2)
    front = np.flatnonzero(near & either)
    if len(front):
        while len(front):
            reached = block.surface.corners[block.faces_of(front)].ravel()
            front = _distinct(reached[either[reached] & ~near[reached]], len(near))
            near[front] = True
        near = block.rings(np.flatnonzero(near & either | block.rings(touched, 0)), 2)
    return np.flatnonzero(near)


def _distinct(numbers: Int64Array, size: int) -> Int64Array:
    """Sorted, each once."""
    seen = np.zeros(size, np.bool_)
    seen[numbers] = True
    return np.flatnonzero(seen)


def _spliced(whole: Equations, part: SurfacePart, found: Equations, zone: Int64Array, count: int) -> Equations:
    """The whole's equations with those of the part at the rows of a zone, which the part knows in full."""
    here = part.local(zone)
    inside = np.zeros(count, np.bool_)
    inside[zone] = True
    own = inside[part.unknowns]
    edge = np.flatnonzero(own[part.surface.edges].all(axis=1))
    wing = np.flatnonzero(own[part.surface.butterflies.stencil].all(axis=1))

    def unknowns(old: NDArray[Any], new: NDArray[Any]) -> NDArray[Any]:
        return _put(old, zone, new[here])

    def terms(old: EdgeTerms, new: EdgeTerms | None) -> EdgeTerms:
        if new is None:
            nothing = np.zeros(len(part.unknowns))
            new = EdgeTerms(nothing, np.zeros(len(part.edges)), np.zeros(len(part.wings)))
        return EdgeTerms(
            unknowns(old.diagonal, new.diagonal),
            _put(old.edges, part.edges[edge], new.edges[edge]),
            _put(old.wings, part.wings[wing], new.wings[wing]),
        )

    pooled, anew = whole.trust.pooled, found.trust.pooled
    trust = replace(
        whole.trust,
        count=unknowns(whole.trust.count, found.trust.count),
        shrinkage=unknowns(whole.trust.shrinkage, found.trust.shrinkage),
        pooled=replace(
            pooled,
            explained=unknowns(pooled.explained, anew.explained),
            rest=unknowns(pooled.rest, anew.rest),
            freedom=unknowns(pooled.freedom, anew.freedom),
            usable=unknowns(pooled.usable, anew.usable),
            count=unknowns(pooled.count, anew.count),
        ),
    )
    return replace(
        whole,
        mass=unknowns(whole.mass, found.mass),
        data=unknowns(whole.data, found.data),
        average=unknowns(whole.average, found.average),
        starved=unknowns(whole.starved, found.starved),
        bounded=_put(whole.bounded, part.wings[wing], found.bounded[wing]),
        trust=trust,
        diagonal=unknowns(whole.diagonal, found.diagonal),
        edges=_put(whole.edges, part.edges[edge], found.edges[edge]),
        anchor=unknowns(whole.anchor, found.anchor),
        common=terms(whole.common, found.common),
        own=None if whole.own is None else terms(whole.own, found.own),
    )


def _put(old: NDArray[Any], at: Int64Array, new: NDArray[Any]) -> NDArray[Any]:
    values = old.copy()
    values[at] = new
    return values
