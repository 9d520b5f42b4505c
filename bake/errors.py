"""Every error that leaves the engine, as one tree.

    ObscuraError
    ├── InputError            the user's files or settings are wrong (exit 2)
    │   ├── SceneError        a scene file, its side file or its content
    │   ├── SettingsError     an option out of range, unknown or contradictory
    │   └── ResultError       a result folder that is not one, or is damaged
    ├── DeviceError           no such device, or a device that failed
    ├── OutOfMemoryError      the bake does not fit
    ├── StorageError          a result could not be written (exit 2)
    ├── SolveError            a linear system that did not converge
    └── Cancelled             the user stopped the work

A message is one sentence of three parts: what is wrong, where (file, object), what to do.
"""

from __future__ import annotations


class ObscuraError(Exception):
    """What is wrong, where, and what to do about it.

    Args:
        what: What is wrong, without a full stop.
        where: File, object or option at fault; empty if it is nowhere in particular.
        remedy: What the user can do; empty if nothing can be done.
    """

    exit_code = 1

    def __init__(self, what: str, *, where: str = "", remedy: str = "") -> None:
        self.what = what
        self.where = where
        self.remedy = remedy
        super().__init__(what, where, remedy)

    def __str__(self) -> str:
        line = f"{self.where}: {self.what}" if self.where else self.what
        if self.remedy:
            line = f"{line}; {self.remedy}"
        return " ".join(line.split())

    def __reduce__(self) -> tuple[object, ...]:
        # Keyword-only arguments would otherwise be lost on the way out of the engine process.
        return _rebuild, (type(self), self.what, self.where, self.remedy)


def _rebuild(kind: type[ObscuraError], what: str, where: str, remedy: str) -> ObscuraError:
    return kind(what, where=where, remedy=remedy)


class InputError(ObscuraError):
    """The user's input is at fault: refused before work begins."""

    exit_code = 2


class SceneError(InputError):
    """A scene file, its side file or its content cannot be used."""


class SettingsError(InputError):
    """A setting is unknown, out of range or contradicts another."""


class ResultError(InputError):
    """A folder is no result, was written by another version, or is damaged."""


class DeviceError(ObscuraError):
    """A device is missing or failed."""


class OutOfMemoryError(ObscuraError):
    """The work does not fit into memory."""


class StorageError(ObscuraError):
    """A result or an export could not be written; what was there before is untouched."""

    exit_code = 2  # the place that the user named is at fault


class SolveError(ObscuraError):
    """A linear system could not be solved to its tolerance."""


class Cancelled(ObscuraError):
    """The user stopped the work; nothing was changed."""

    exit_code = 130

    def __init__(self, what: str = "cancelled", *, where: str = "", remedy: str = "") -> None:
        super().__init__(what, where=where, remedy=remedy)
