"""What a scene's files say now, held against the result in view: which objects are stale, new or gone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from bake.settings import BakeSettings
from bake.types import BakeResult, ObjectKeys, Role


@dataclass(frozen=True, slots=True)
class SceneState:
    """The objects of a scene as its files describe them now.

    Attributes:
        files: SHA-256 of every file of the scene, as `Scene.files`.
        settings: What the side file asks for, over the defaults.
        objects: By path: role, keys and content hash.
        stale: Paths of the result in view whose content differs now.
        gone: Paths of the result in view that the scene no longer has.
        new: Paths that the result in view does not have.
        complaint: Why the files could not be read; then the rest is empty.
    """

    files: Mapping[str, str]
    settings: BakeSettings
    objects: Mapping[str, tuple[Role, ObjectKeys, str]]
    stale: frozenset[str] = frozenset()
    gone: frozenset[str] = frozenset()
    new: frozenset[str] = frozenset()
    complaint: str = ""

    @property
    def is_fresh(self) -> bool:
        """Whether a bake would find what the last one found."""
        return not (self.stale or self.gone or self.new or self.complaint)

    def role_of(self, path: str, known: Role) -> Role:
        """The role that an object has now; `known` if the scene does not have it."""
        return self.objects[path][0] if path in self.objects else known

    def summary(self) -> str:
        """What differs, in a line; empty if nothing does."""
        if self.complaint:
            return self.complaint
        parts = ((self.stale, "changed"), (self.new, "new"), (self.gone, "gone"))
        return ", ".join(f"{len(paths):,} {word}" for paths, word in parts if paths)


def read_scene_state(path: Path, result: BakeResult | None) -> SceneState:
    """Reads what a scene's files say now. Takes as long as loading the scene, unless no file has changed.

    Args:
        path: The scene's file.
        result: What to hold it against; None for nothing.

    Raises:
        InputError: the scene or its side file cannot be used.
    """
    from bake.pipeline import settings_for
    from bake.scene import hash_files, load_scene
    from bake.scene.content_hash import ContentHasher

    settings = settings_for(path, {})
    if result is not None and hash_files(path, result.files) == dict(result.files):
        world = result.world
        rows = zip(world.object_paths, world.object_roles, world.object_keys, world.object_hash, strict=True)
        return SceneState(result.files, settings, {path: (role, keys, digest) for path, role, keys, digest in rows})
    baked_with = settings if result is None else result.settings
    scene = load_scene(path, crease_angle=baked_with.crease_angle)
    hasher = ContentHasher(scene)
    objects = {item.path: (item.role, item.keys, hasher.object_hash(item)) for item in scene.objects}
    if result is None:
        return SceneState(scene.files, settings, objects)
    baked = dict(zip(result.world.object_paths, result.world.object_hash, strict=True))
    if result.settings.ground is not None:
        baked.popitem()  # the bake's own ground plane, which no file has
    return SceneState(
        files=scene.files,
        settings=settings,
        objects=objects,
        stale=frozenset(name for name, digest in baked.items() if name in objects and objects[name][2] != digest),
        gone=frozenset(baked.keys() - objects.keys()),
        new=frozenset(objects.keys() - baked.keys()),
    )
