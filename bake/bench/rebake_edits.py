"""Random edits of a level, as an artist might make them, for checks of rebakes against whole bakes."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bake.settings import BakeSettings
from bake.types import Float64Array, Mesh, ObjectKeys, Role, Scene, SceneObject

MOST_CELLS = 100_000
"""Cells of the tree volume in the box of the largest object that becomes a tree; nobody makes one of mountains."""

Change = Callable[[Scene, BakeSettings, int, np.random.Generator], tuple[Scene, BakeSettings]]


@dataclass(frozen=True, slots=True)
class RandomEdit:
    """One edit.

    Attributes:
        kind: Its name in `KINDS`.
        object: Path of the object that it was made to; empty for settings and for an undo.
        scene, settings: As they are afterwards.
    """

    kind: str
    object: str
    scene: Scene
    settings: BakeSettings


class RandomEdits:
    """A reproducible sequence of edits.

    Args:
        scene, settings: The level before the first.
        seed: Of the sequence.
        most_faces: Objects with more faces are left where they are, for a level's floor is no prop; roles and keys of
            all objects change.
    """

    def __init__(self, scene: Scene, settings: BakeSettings, seed: int, *, most_faces: int = 20_000) -> None:
        self._random = np.random.default_rng(seed)
        self._history = [(scene, settings)]
        self._most_faces = most_faces

    def next(self, kind: str | None = None) -> RandomEdit:
        """One more edit of the level as the last left it.

        Args:
            kind: One of `KINDS`; chosen by chance if None.
        """
        scene, settings = self._history[-1]
        if kind is None:
            kind = str(self._random.choice(list(KINDS)))
        if kind == "undo":
            if len(self._history) > 1:
                self._history.pop()
            return RandomEdit(kind, "", *self._history[-1])
        number = self._pick(scene, kind)
        changed, wanted = KINDS[kind](scene, settings, number, self._random)
        if not any(item.role.receives_per_vertex for item in changed.objects):
            changed = scene
        self._history.append((changed, wanted))
        path = "" if kind in ("alpha", "threshold") else scene.objects[number].path
        return RandomEdit(kind, path, changed, wanted)

    def _pick(self, scene: Scene, kind: str) -> int:
        numbers = np.arange(len(scene.objects))
        if kind not in ("role", "keys"):
            faces = np.array([len(scene.meshes[item.mesh].faces) for item in scene.objects])
            sizes = np.array([_extent(scene, item) for item in scene.objects])
            # Props, not the ground: of moderate size, against the level's.
            few = (faces <= self._most_faces) & (sizes <= max(0.25 * float(sizes.max()), float(np.median(sizes))))
            numbers = numbers[few] if few.any() else numbers
        by_role: dict[Role, list[int]] = {}
        for number in numbers.tolist():
            by_role.setdefault(scene.objects[number].role, []).append(number)
        # Every role has its turn, however few objects it has.
        role = list(by_role)[int(self._random.integers(len(by_role)))]
        return int(self._random.choice(by_role[role]))


def _extent(scene: Scene, item: SceneObject) -> float:
    box = scene.meshes[item.mesh].positions
    if not len(box):
        return 0.0
    size = box.max(axis=0) - box.min(axis=0)
    return float(np.linalg.norm(item.transform[:3, :3] @ size))


def _cells(scene: Scene, item: SceneObject, spacing: float) -> float:
    """Cells of a volume around an object, about."""
    points = scene.meshes[item.mesh].positions @ item.transform[:3, :3].T
    if not len(points):
        return 0.0
    size: Float64Array = np.ceil((points.max(axis=0) - points.min(axis=0)) / spacing) + 1.0
    return float(size.prod())


def _with(scene: Scene, number: int, item: SceneObject) -> Scene:
    return dataclasses.replace(scene, objects=(*scene.objects[:number], item, *scene.objects[number + 1 :]))


def _transformed(scene: Scene, number: int, linear: Float64Array, shift: Float64Array) -> Scene:
    """The object turned and scaled about the middle of its mesh, and shifted, in world space."""
    item = scene.objects[number]
    points = scene.meshes[item.mesh].positions
    middle = points.mean(axis=0) if len(points) else np.zeros(3)
    pivot = item.transform[:3, :3] @ middle + item.transform[:3, 3]
    about = np.eye(4)
    about[:3, :3] = linear
    about[:3, 3] = pivot - linear @ pivot + shift
    return _with(scene, number, dataclasses.replace(item, transform=about @ item.transform))


def _move(scene: Scene, settings: BakeSettings, number: int, random: np.random.Generator) -> tuple[Scene, BakeSettings]:
    size = max(_extent(scene, scene.objects[number]), 0.1)
    return _transformed(scene, number, np.eye(3), random.normal(0.0, 0.7 * size, 3)), settings


def _rotate(
    scene: Scene, settings: BakeSettings, number: int, random: np.random.Generator
) -> tuple[Scene, BakeSettings]:
    angle = float(random.uniform(-math.pi, math.pi))
    c, s = math.cos(angle), math.sin(angle)
    return _transformed(scene, number, np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]), np.zeros(3)), settings


def _scale(
    scene: Scene, settings: BakeSettings, number: int, random: np.random.Generator
) -> tuple[Scene, BakeSettings]:
    factor = float(np.exp(random.uniform(-0.6, 0.6)))
    return _transformed(scene, number, factor * np.eye(3), np.zeros(3)), settings


def _hide(scene: Scene, settings: BakeSettings, number: int, random: np.random.Generator) -> tuple[Scene, BakeSettings]:
    if _is_named(scene, number):
        return _move(scene, settings, number, random)
    return _with(scene, number, dataclasses.replace(scene.objects[number], role=Role.IGNORE)), settings


def _delete(
    scene: Scene, settings: BakeSettings, number: int, random: np.random.Generator
) -> tuple[Scene, BakeSettings]:
    if _is_named(scene, number) or len(scene.objects) < 3:
        return _move(scene, settings, number, random)
    return dataclasses.replace(scene, objects=scene.objects[:number] + scene.objects[number + 1 :]), settings


def _is_named(scene: Scene, number: int) -> bool:
    """Whether a lower level of detail takes its values from this object: without it the level is an error."""
    path = scene.objects[number].path
    names = [item.keys.of for item in scene.objects if item.role is Role.LOD and item.keys.of is not None]
    return any(path == name or path.startswith((f"{name}/", f"{name}#")) for name in names)


def _add(scene: Scene, settings: BakeSettings, number: int, random: np.random.Generator) -> tuple[Scene, BakeSettings]:
    item = scene.objects[number]
    taken = {other.path for other in scene.objects}
    path = next(path for i in range(1, len(taken) + 2) if (path := f"{item.path} copy {i}") not in taken)
    place = int(random.integers(len(scene.objects) + 1))
    copy = dataclasses.replace(item, path=path, node=-1, node_instance=-1)
    more = dataclasses.replace(scene, objects=(*scene.objects[:place], copy, *scene.objects[place:]))
    return _move(more, settings, place, random)


def _replace(
    scene: Scene, settings: BakeSettings, number: int, random: np.random.Generator
) -> tuple[Scene, BakeSettings]:
    """Another mesh in its place: one of its triangles is missing, and the rest is a little thicker."""
    item = scene.objects[number]
    mesh = scene.meshes[item.mesh]
    if len(mesh.faces) < 2:
        return _scale(scene, settings, number, random)
    middle = mesh.positions.mean(axis=0)
    changed = Mesh(
        name=f"{mesh.name} anew",
        positions=middle + (mesh.positions - middle) * random.uniform(0.8, 1.25, 3),
        normals=mesh.normals,
        faces=mesh.faces[:-1],
        face_material=mesh.face_material[:-1],
        uvs=mesh.uvs,
    )
    more = dataclasses.replace(scene, meshes=(*scene.meshes, changed))
    return _with(more, number, dataclasses.replace(item, mesh=len(scene.meshes))), settings


def _role(scene: Scene, settings: BakeSettings, number: int, random: np.random.Generator) -> tuple[Scene, BakeSettings]:
    item = scene.objects[number]
    choices = [Role.STATIC, Role.BLOCKER, Role.RECEIVER, Role.SHRUB, Role.SMALL, Role.IGNORE]
    if _is_named(scene, number):
        choices = [Role.STATIC, Role.RECEIVER]
    if len(scene.meshes[item.mesh].faces) < 5000:
        choices.append(Role.TREE)
    others = [role for role in choices if role is not item.role]
    role = others[int(random.integers(len(others)))]
    if role is Role.TREE and _cells(scene, item, settings.volume_spacing) > MOST_CELLS:
        role = Role.BLOCKER if item.role is not Role.BLOCKER else Role.STATIC
    return _with(scene, number, dataclasses.replace(item, role=role)), settings


def _keys(scene: Scene, settings: BakeSettings, number: int, random: np.random.Generator) -> tuple[Scene, BakeSettings]:
    item = scene.objects[number]
    choices: list[dict[str, object]] = [
        {"two_sided": True},
        {"two_sided": False},
        {"offset": float(random.uniform(0.0, 0.05))},
        {"samples": int(random.integers(1, 8))},
        {"alpha": float(random.choice([0.0, 0.01, 0.3]))},
        {"winding": "flipped"},
    ]
    if item.role is Role.SHRUB:
        choices = [{"density": float(random.uniform(0.05, 1.0))}]
    if item.role is Role.TREE:
        choices = [{"transmission": float(random.uniform(0.1, 0.9))}]
    said = choices[int(random.integers(len(choices)))]
    keys: ObjectKeys = dataclasses.replace(item.keys, **said)  # pyright: ignore[reportArgumentType]
    return _with(scene, number, dataclasses.replace(item, keys=keys)), settings


def _alpha(
    scene: Scene, settings: BakeSettings, _number: int, random: np.random.Generator
) -> tuple[Scene, BakeSettings]:
    return scene, settings.replaced(alpha=float(random.choice([0.0, 0.01, 0.03, 0.1, 0.5])))


def _threshold(
    scene: Scene, settings: BakeSettings, _number: int, random: np.random.Generator
) -> tuple[Scene, BakeSettings]:
    return scene, settings.replaced(back_face_threshold=float(random.choice([0.1, 0.2, 0.25, 0.4])))


def _undo(
    scene: Scene, settings: BakeSettings, _number: int, _random: np.random.Generator
) -> tuple[Scene, BakeSettings]:
    return scene, settings  # `RandomEdits.next` goes back by itself


KINDS: dict[str, Change] = {
    "move": _move,
    "rotate": _rotate,
    "scale": _scale,
    "hide": _hide,
    "delete": _delete,
    "add": _add,
    "replace": _replace,
    "role": _role,
    "keys": _keys,
    "alpha": _alpha,
    "threshold": _threshold,
    "undo": _undo,
}
