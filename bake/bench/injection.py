"""What one injected defect consists of, and how a set of them becomes part of a real scene."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bake.arrays import Float64Array
from bake.bench.shapes import Shaded
from bake.explain.cause_names import CauseKind
from bake.types import Material, Mesh, ObjectKeys, Role, Scene, SceneObject

Keys = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Prop:
    """One object of a defect, in metres from the middle of the top of its plinth.

    Attributes:
        shape: Geometry with normals.
        two_sided: Its material's flag.
        keys: Keys that it carries, role included.
    """

    shape: Shaded
    two_sided: bool = False
    keys: Keys = field(default_factory=dict[str, Any])


@dataclass(frozen=True, slots=True)
class Injection:
    """One defect with a known cause.

    Attributes:
        cause: What makes it dark.
        variant: Which kind of it, for the report.
        props: By name.
        dark: Name of the object with the dark spot.
        spot: Shape (3,): a point on that object.
        normal: Shape (3,): unit, on the side that is looked at.
        cure: Keys by name of object that remedy it; empty if no key does.
        longest: Whether it shows at the longest distance, instead of the shortest.
    """

    cause: CauseKind
    variant: str
    props: Mapping[str, Prop]
    dark: str
    spot: tuple[float, float, float]
    normal: tuple[float, float, float]
    cure: Mapping[str, Keys] = field(default_factory=dict[str, Keys])
    longest: bool = False

    @property
    def column(self) -> int:
        """Column of the AO at which it shows."""
        return -1 if self.longest else 0


@dataclass(frozen=True, slots=True)
class Placed:
    """An injection in a scene.

    Attributes:
        injection: What.
        folder: Path that its objects lie below.
        spot: Shape (3,), world metres.
        normal: Shape (3,), unit.
        scale: Its size against the injection as designed.
    """

    injection: Injection
    folder: str
    spot: Float64Array
    normal: Float64Array
    scale: float

    @property
    def dark_path(self) -> str:
        """Path of the object with the dark spot."""
        return f"{self.folder}/{self.injection.dark}" if self.folder else self.injection.dark


def inject(
    scene: Scene, injections: Sequence[Injection], places: Float64Array, turns: Sequence[float], scale: float
) -> tuple[Scene, list[Placed]]:
    """The scene with one injection at each place.

    Args:
        scene: A loaded scene.
        injections: n of them.
        places: Shape (n, 3), world metres: where the middle of each plinth's top goes.
        turns: n angles about the up axis, radians.
        scale: Metres in the scene for a metre of the injection.
    """
    up = scene.up_axis if scene.up_axis >= 0 else 1
    materials = [*scene.materials, Material("injected"), Material("injected two-sided", two_sided=True)]
    meshes, objects, placed = list(scene.meshes), list(scene.objects), list[Placed]()
    for number, (injection, place, turn) in enumerate(zip(injections, places, turns, strict=True)):
        transform = _placement(place, turn, scale, up)
        folder = f"Injected/{number:03}_{injection.cause}"
        for name, prop in injection.props.items():
            meshes.append(_mesh(name, prop, len(materials) - (1 if prop.two_sided else 2)))
            keys = {key: scale * value if key == "offset" else value for key, value in prop.keys.items()}
            objects.append(_object(f"{folder}/{name}", len(meshes) - 1, transform, keys))
        spot = transform[:3, :3] @ np.array(injection.spot) + transform[:3, 3]
        normal = transform[:3, :3] @ np.array(injection.normal) / scale
        placed.append(Placed(injection, folder, spot, normal, scale))
    whole = dataclasses.replace(
        scene, meshes=tuple(meshes), materials=tuple(materials), objects=tuple(objects), findings=()
    )
    return whole, placed


def cured(scene: Scene, placed: Sequence[Placed]) -> Scene:
    """The same scene with every injection's cure applied."""
    said: dict[str, Keys] = {}
    for item in placed:
        said |= {f"{item.folder}/{name}": keys for name, keys in item.injection.cure.items()}
    objects = [
        dataclasses.replace(item, **_role_and_keys({**_said(item), **said[item.path]})) if item.path in said else item
        for item in scene.objects
    ]
    return dataclasses.replace(scene, objects=tuple(objects))


def _said(item: SceneObject) -> dict[str, Any]:
    keys = {name: value for name, value in dataclasses.asdict(item.keys).items() if value is not None}
    return {"role": item.role, **keys}


def _role_and_keys(said: Keys) -> dict[str, Any]:
    keys = {name: value for name, value in said.items() if name != "role"}
    return {"role": Role(said.get("role", Role.STATIC)), "keys": ObjectKeys(**keys)}


def _mesh(name: str, prop: Prop, material: int) -> Mesh:
    shape = prop.shape
    return Mesh(name, shape.positions, shape.normals, shape.faces, np.full(len(shape.faces), material, np.int32))


def _object(path: str, mesh: int, transform: Float64Array, keys: Keys) -> SceneObject:
    return SceneObject(path=path, mesh=mesh, transform=transform, **_role_and_keys(keys))


def _placement(place: Float64Array, turn: float, scale: float, up: int) -> Float64Array:
    """Rotation about the up axis, from y-up to the scene's up, scale and shift, shape (4, 4)."""
    cosine, sine = np.cos(turn), np.sin(turn)
    about_y = np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
    matrix = np.eye(4)
    # y becomes the scene's up axis by a cyclic exchange of axes, which is a rotation
    matrix[:3, :3] = scale * np.roll(about_y, up - 1, axis=0)
    matrix[:3, 3] = place
    return matrix
