"""What a scene's files say now, held against the result in view: which objects are stale, new or gone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from app.scene_preview import preview_world
from bake.settings import BakeSettings
from bake.types import BakeResult, ObjectKeys, Role, Scene, SceneObject, World

if TYPE_CHECKING:
    from bake.scene.content_hash import ContentHasher
    from bake.scene.load import SceneReader


@dataclass(frozen=True)
class SceneState:
    """The objects of a scene as its files describe them now.

    Attributes:
        files: SHA-256 of every file of the scene, as `Scene.files`.
        settings: What the side file asks for, over the defaults.
        objects: By path: role, keys and content hash.
        stale: Paths of the result in view whose content differs now, or that a rebake left as they were.
        gone: Paths of the result in view that the scene no longer has.
        new: Paths that the result in view does not have.
        complaint: Why the files could not be read; then the rest is empty.
        scene: As read; None if it could not be.
        world: The geometry in view with every object where it is now; None as well.
    """

    files: Mapping[str, str]
    settings: BakeSettings
    objects: Mapping[str, tuple[Role, ObjectKeys, str]]
    stale: frozenset[str] = frozenset()
    gone: frozenset[str] = frozenset()
    new: frozenset[str] = frozenset()
    complaint: str = ""
    scene: Scene | None = None
    world: World | None = None

    @property
    def is_fresh(self) -> bool:
        """Whether a bake would find what the last one found."""
        return not (self.stale or self.gone or self.new or self.complaint)

    def item(self, path: str) -> SceneObject | None:
        """An object as the scene has it now; None if it has not."""
        return self._items.get(path)

    @cached_property
    def _items(self) -> dict[str, SceneObject]:
        return {} if self.scene is None else {item.path: item for item in self.scene.objects}

    def role_of(self, path: str, known: Role) -> Role:
        """The role that an object has now; `known` if the scene does not have it."""
        return self.objects[path][0] if path in self.objects else known

    def summary(self) -> str:
        """What differs, in a line; empty if nothing does."""
        if self.complaint:
            return self.complaint
        parts = ((self.stale, "changed"), (self.new, "new"), (self.gone, "gone"))
        return ", ".join(f"{len(paths):,} {word}" for paths, word in parts if paths)


class SceneStates:
    """Reads one scene's state again and again; what did not change is not read anew.

    Args:
        path: The scene's file.
        reader: Of that file, if somebody has read it already.
    """

    def __init__(self, path: Path, reader: SceneReader | None = None) -> None:
        from bake.scene.load import SceneReader

        self.path = path
        self._reader = reader or SceneReader(path)
        self._hasher: ContentHasher | None = None
        self._last: tuple[Scene, BakeResult | None, World | None, SceneState] | None = None

    def read(self, result: BakeResult | None, view: World | None, *, whole: bool = False) -> SceneState:
        """Reads what the scene's files say now.

        Args:
            result: What to hold it against; None for nothing.
            view: Geometry to be shown as it is now: the result's, or that of the scene when it was opened.
            whole: The scene itself is wanted too; otherwise it is not read if no file has changed since the bake.

        Raises:
            InputError: the scene or its side file cannot be used.
        """
        from bake.pipeline import settings_for
        from bake.scene import hash_files

        settings = settings_for(self.path, {})
        if not whole and result is not None and hash_files(self.path, result.files) == dict(result.files):
            baked = result.world
            rows = zip(baked.object_paths, baked.object_roles, baked.object_keys, baked.object_hash, strict=True)
            known = {path: (role, keys, digest) for path, role, keys, digest in rows}
            return SceneState(result.files, settings, known, stale=frozenset(result.stale), world=view)
        baked_with = settings if result is None else result.settings
        scene = self._reader.read(crease_angle=baked_with.crease_angle)
        last = self._last
        if last is not None and last[0] is scene and last[1] is result and last[2] is view:
            return last[3]
        state = self._against(scene, result, view, settings)
        self._last = (scene, result, view, state)
        return state

    def _against(
        self, scene: Scene, result: BakeResult | None, view: World | None, settings: BakeSettings
    ) -> SceneState:
        from bake.scene.content_hash import ContentHasher

        self._hasher = hasher = ContentHasher(scene, self._hasher)
        objects = {item.path: (item.role, item.keys, hasher.object_hash(item)) for item in scene.objects}
        state = SceneState(scene.files, settings, objects, scene=scene)
        if view is not None:
            hashes = {path: digest for path, (_, _, digest) in objects.items()}
            state = replace(state, world=preview_world(view, scene, hashes))
        if result is None:
            return state
        baked = dict(zip(result.world.object_paths, result.world.object_hash, strict=True))
        if result.settings.ground is not None:
            baked.popitem()  # the bake's own ground plane, which no file has
        return replace(
            state,
            stale=frozenset(
                name
                for name, digest in baked.items()
                if name in objects and (objects[name][2] != digest or name in result.stale)
            ),
            gone=frozenset(baked.keys() - objects.keys()),
            new=frozenset(objects.keys() - baked.keys()),
        )
