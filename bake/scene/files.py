"""Reading a scene's files, and remembering which ones were read and what was in them.

The record is what tells an unchanged scene from a changed one without loading it again.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path, PurePosixPath
from urllib.parse import unquote

from bake.errors import SceneError
from bake.in_parts import meanwhile

ABSENT = ""  # stands for the hash of a file that was looked for and not found


class FileLedger:
    """Reads the files of one scene and keeps their hashes, by path relative to the scene's folder."""

    def __init__(self, scene: Path) -> None:
        self.scene = scene
        self.folder = scene.parent
        self._seen: dict[str, Callable[[], str]] = {}

    @property
    def seen(self) -> Mapping[str, str]:
        """SHA-256 in hex of every file read so far, `ABSENT` for those that were not there."""
        return {name: digest() for name, digest in self._seen.items()}

    def remember(self, seen: Mapping[str, str]) -> None:
        """Takes over what another ledger of the scene has read."""
        self._seen.update({name: partial(str, digest) for name, digest in seen.items()})

    def read(self, name: str, *, what: str) -> bytes:
        """The content of a file beside the scene.

        Args:
            name: Path relative to the scene's folder, with forward slashes.
            what: What the file is to the scene, for messages.

        Raises:
            SceneError: the file is missing or cannot be read.
        """
        try:
            content = (self.folder / name).read_bytes()
        except FileNotFoundError:
            self._seen[name] = partial(str, ABSENT)
            raise SceneError(f"{what} is missing", where=str(self.folder / name), remedy="check the path") from None
        except (OSError, ValueError) as problem:
            reason = problem.strerror if isinstance(problem, OSError) and problem.strerror else str(problem)
            raise SceneError(f"{what} cannot be read: {reason}", where=str(self.folder / name)) from None
        self._seen[name] = meanwhile(lambda: hashlib.sha256(content).hexdigest(), len(content))  # while it is parsed
        return content

    def read_if_present(self, name: str, *, what: str) -> bytes | None:
        """Like `read`, but None where no such file exists."""
        try:
            present = (self.folder / name).exists()
        except (OSError, ValueError):
            present = False
        if not present:
            self._seen[name] = partial(str, ABSENT)
            return None
        return self.read(name, what=what)

    def resolve_uri(self, uri: str, *, what: str) -> str:
        """Turns a relative URI of the scene file into a name for `read`.

        Files outside the scene's folder are refused: a level taken from elsewhere must not make the bake read and
        record whatever else lies on this machine.

        Raises:
            SceneError: the URI is absolute, has a scheme, or leaves the scene's folder.
        """
        path = unquote(uri).replace("\\", "/")
        scheme = path.split("/", 1)[0]
        if ":" in scheme or path.startswith("/"):
            raise SceneError(
                f"{what} {uri[:80]!r} is no relative path",
                where=str(self.scene),
                remedy="store it beside the scene and refer to it by a relative path",
            )
        name = os.path.normpath(path or ".").replace(os.sep, "/")
        if name == "." or name == ".." or name.startswith("../") or "\0" in name:
            raise SceneError(
                f"{what} {uri[:80]!r} lies outside the scene's folder",
                where=str(self.scene),
                remedy="store it beside the scene",
            )
        return str(PurePosixPath(name))


def hash_files(scene: Path, names: Iterable[str]) -> dict[str, str]:
    """Hashes the named files again, as `Scene.files` holds them, without loading the scene.

    A scene is unchanged exactly if `hash_files(scene.path, scene.files) == scene.files`.

    Args:
        scene: The scene file; names are relative to its folder.
        names: The keys of `Scene.files`.

    Returns:
        SHA-256 in hex by name; an empty string for files that are absent or unreadable.
    """
    hashes: dict[str, str] = {}
    for name in names:
        try:
            with (scene.parent / name).open("rb") as file:
                hashes[name] = hashlib.file_digest(file, "sha256").hexdigest()
        except (OSError, ValueError):
            hashes[name] = ABSENT
    return hashes
