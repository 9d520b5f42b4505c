"""What every file reader hands to `load_scene`: geometry and where it stands, before roles are known."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from bake.types import Finding, Float64Array, Material, Mesh


@dataclass(frozen=True, slots=True)
class Placement:
    """One placed mesh, under the unique path that it keeps for good.

    Attributes:
        path: Unique path.
        name_path: The path before repeats were numbered; patterns may match either.
        mesh: Index into the file's meshes.
        transform: Shape (4, 4), float64, to world.
        node, node_instance: As in `SceneObject`.
        declared: What the file itself says about the object, unchecked: role and keys.
        copy_of: As in `SceneObject`.
        own: What the side file says of a copy where it makes it, checked.
    """

    path: str
    name_path: str
    mesh: int
    transform: Float64Array
    node: int = -1
    node_instance: int = -1
    declared: Mapping[str, Any] = field(default_factory=dict[str, Any])
    copy_of: str = ""
    own: Mapping[str, Any] = field(default_factory=dict[str, Any])


@dataclass(frozen=True, slots=True)
class ParsedFile:
    """A file's content: `Placement.mesh` indexes `meshes`."""

    meshes: Sequence[Mesh]
    materials: Sequence[Material]
    placements: Sequence[Placement]
    findings: Sequence[Finding]
    up_axis: int = -1


def number_repeats(paths: Sequence[str]) -> list[str]:
    """Makes paths unique: every one that occurs more than once gets `#1`, `#2` … in the given order.

    Numbers that would collide with a path of the file itself are left out.
    """
    counts = Counter(paths)
    next_number: Counter[str] = Counter()
    taken = set(counts)
    numbered: list[str] = []
    for path in paths:
        if counts[path] == 1:
            numbered.append(path)
            continue
        while True:
            next_number[path] += 1
            candidate = f"{path}#{next_number[path]}"
            if candidate not in taken:
                break
        numbered.append(candidate)
    return numbered
