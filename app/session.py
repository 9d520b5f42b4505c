"""A session as it is put aside every so often, and what earlier ones left behind that did not end well."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from app.plain import from_plain, to_plain
from viewer.camera import Camera
from viewer.display import Display

_SUFFIX = ".session.json"
_OLDEST_DAYS = 30.0


@dataclass(frozen=True, slots=True)
class Session:
    """What is worth coming back to.

    Attributes:
        scene: The scene's file; empty if nothing was open.
        result: The result's folder; empty while there was none.
        up_axis: Which way was up.
        camera: Where the view stood.
        display: How the surface was shown.
        threshold: Back-face threshold in view.
        selected: Paths of the selected objects, the one chosen last at the end.
        hidden: Paths of the objects that were not drawn.
        options: Settings of the bake as edited, as JSON text.
        layout: Arrangement of the panels, in hexadecimal digits.
        when: Seconds since 1970.
    """

    scene: str = ""
    result: str = ""
    up_axis: int = 1
    camera: Camera = Camera()
    display: Display = Display()
    threshold: float = 0.25
    selected: tuple[str, ...] = ()
    hidden: tuple[str, ...] = ()
    options: str = ""
    layout: str = ""
    when: float = 0.0


class SessionFile:
    """The session of this process, and those of processes that are gone.

    Args:
        cache: The window's cache folder.
        number: Tells the windows of a process apart.
    """

    def __init__(self, cache: Path, number: int = 0) -> None:
        self._folder = cache / "sessions"
        self._path = self._folder / f"{os.getpid()}-{number}{_SUFFIX}"

    def write(self, session: Session) -> None:
        """Puts a session aside, whole or not at all.

        Raises:
            OSError: it could not be written.
        """
        text = json.dumps(to_plain(dataclasses.replace(session, when=time.time())))
        self._folder.mkdir(parents=True, exist_ok=True)
        staged = self._path.with_suffix(".part")
        staged.write_text(text, encoding="utf-8")
        staged.replace(self._path)

    def remove(self) -> None:
        """Marks the end of the session as a proper one."""
        with contextlib.suppress(OSError):
            self._path.unlink()

    def take_left(self) -> Session | None:
        """The latest session that did not end properly and had something open; all of them are then forgotten."""
        found: list[Session] = []
        for path in list(self._orphans()):
            with contextlib.suppress(OSError, ValueError):
                found.append(from_plain(Session, json.loads(path.read_text(encoding="utf-8"))))
            with contextlib.suppress(OSError):
                path.unlink()
        recent = [session for session in found if session.scene and time.time() - session.when < 86400 * _OLDEST_DAYS]
        return max(recent, key=lambda session: session.when, default=None)

    def _orphans(self) -> Iterator[Path]:
        with contextlib.suppress(FileNotFoundError):
            for path in self._folder.iterdir():
                owner = path.name.partition("-")[0]
                if path.name.endswith(_SUFFIX) and owner.isdigit() and not is_running(int(owner)):
                    yield path


def is_running(pid: int) -> bool:
    """Whether there is a process of this number."""
    if pid == os.getpid():
        return True
    if sys.platform == "win32":
        return _is_running_windows(pid)
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def _is_running_windows(pid: int) -> bool:
    import ctypes

    kernel = ctypes.windll.kernel32  # type: ignore[attr-defined]
    handle = kernel.OpenProcess(0x1000, False, pid)  # the right to ask, and no other
    if not handle:
        return False
    code = ctypes.c_ulong()
    kernel.GetExitCodeProcess(handle, ctypes.byref(code))
    kernel.CloseHandle(handle)
    return code.value == 259  # still active
