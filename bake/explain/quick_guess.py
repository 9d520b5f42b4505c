"""A first guess at the cause of each spot from the signs alone, for a table that must be there at once."""

from __future__ import annotations

import numpy as np

from bake.explain.cause_names import CauseKind
from bake.explain.vertex_signs import VertexSigns
from bake.types import BakeResult, Int64Array

GOOD_PART = 0.2
"""Share of an object's vertices or faces with a defect from which on its spots are put down to it."""


def guess_causes(result: BakeResult, signs: VertexSigns, vertices: Int64Array) -> tuple[CauseKind, ...]:
    """The likeliest cause of each vertex by what can be seen without a ray.

    Args:
        result: A bake.
        signs: Of all vertices.
        vertices: Shape (s,).
    """
    world = result.world
    owner = np.searchsorted(world.first_vertex, vertices, side="right") - 1
    faces, points = np.diff(world.first_face), np.diff(world.first_vertex)
    turned = _mostly(result, points, "opposing-normals") | _mostly(result, faces, "inconsistent-winding")
    shells = _objects_with(result, "encloses-scene")
    offsets = np.array([keys.offset or 0.0 for keys in world.object_keys])
    opposed = _mostly(result, faces, "opposed-faces")
    longest = float(np.ptp(world.positions, axis=0).max())
    small = longest < min(result.settings.column_distances)
    guesses: list[CauseKind] = []
    for vertex, item in zip(vertices.tolist(), owner.tolist(), strict=True):
        if small or offsets[item] > 0.01:
            guess = CauseKind.UNIT
        elif len(shells):
            guess = CauseKind.SHELL
        elif item in turned:
            guess = CauseKind.AGAINST_FACE
        elif signs.filled[vertex] or signs.invalid[vertex] > 0.75:
            guess = CauseKind.STARVED
        elif signs.held[vertex] < 0 and signs.slenderness[vertex] > 10.0:
            guess = CauseKind.OVERSHOOT
        elif signs.seam[vertex] > 0.15:
            guess = CauseKind.SEAM
        elif signs.slant[vertex] < 0.5:
            guess = CauseKind.BELOW_PLANE
        elif item in opposed:
            guess = CauseKind.TWIN
        elif signs.residual[vertex] > 0.15 or signs.back[vertex] > 0.15:
            guess = CauseKind.BURIED
        else:
            guess = CauseKind.CREVICE
        guesses.append(guess)
    return tuple(guesses)


def _objects_with(result: BakeResult, *what: str) -> set[int]:
    """Numbers of the objects with such a finding."""
    paths = {finding.object for finding in result.findings if finding.what in what}
    return {number for number, path in enumerate(result.world.object_paths) if path in paths}


def _mostly(result: BakeResult, elements: Int64Array, *what: str) -> set[int]:
    """Numbers of the objects of which such findings concern a good part: of large ones, a few say nothing of a spot.

    Args:
        result: A bake.
        elements: Shape (o,): how many elements that findings count each object has.
        what: Names of findings.
    """
    counts = dict[str, int]()
    for finding in result.findings:
        if finding.what in what:
            counts[finding.object] = counts.get(finding.object, 0) + finding.count
    pairs = enumerate(zip(result.world.object_paths, elements.tolist(), strict=True))
    return {number for number, (path, all_of_them) in pairs if counts.get(path, 0) > GOOD_PART * all_of_them}
