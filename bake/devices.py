"""Compute devices, and Warp's start-up: quiet, once, with its messages in our log."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from typing import Any

from bake.errors import DeviceError

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Device:
    """A place to compute.

    Attributes:
        alias: "cpu" or "cuda:N".
        name: What people call it.
        memory_mb: Its memory in MB; 0 if unknown.
    """

    alias: str
    name: str
    memory_mb: float = 0.0

    @property
    def is_cuda(self) -> bool:
        """Whether it is a CUDA device."""
        return self.alias.startswith("cuda")


class _WarpLog:
    """Warp's logger protocol over ours."""

    def debug(self, message: str) -> None:
        _log.debug("%s", message)

    def info(self, message: str) -> None:
        _log.debug("%s", message)

    def warning(self, message: str, *_: Any, **__: Any) -> None:
        _log.warning("%s", message)

    def error(self, message: str) -> None:
        _log.error("%s", message)


@contextmanager
def _native_stderr_silenced() -> Generator[None]:
    # Warp's C++ code reports a missing CUDA driver straight to file descriptor 2; on a CPU machine that is no news.
    try:
        sys.stderr.flush()
        saved, sink = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    except (OSError, AttributeError, ValueError):
        yield
        return
    try:
        os.dup2(sink, 2)
        yield
    finally:
        os.dup2(saved, 2)
        os.close(saved)
        os.close(sink)


@cache
def initialised_warp() -> Any:
    """The Warp module, initialised.

    Raises:
        DeviceError: Warp is not installed or does not start.
    """
    try:
        import warp

        warp.set_logger(_WarpLog())
        with _native_stderr_silenced():
            warp.init()
    except (ImportError, RuntimeError, OSError) as error:
        raise DeviceError(
            f"Warp does not start ({error})", where="device", remedy="reinstall the package warp-lang"
        ) from error
    return warp


def cuda_devices() -> tuple[Device, ...]:
    """The CUDA devices of this machine, in Warp's order."""
    warp = initialised_warp()
    return tuple(Device(d.alias, d.name, d.total_memory / 2**20) for d in warp.get_cuda_devices())


def resolve(wanted: str) -> Device:
    """The device that "auto", "cpu", "cuda" or "cuda:N" means here.

    Raises:
        DeviceError: it does not exist; the message lists those that do.
    """
    cpu = Device("cpu", "CPU")
    if wanted == "cpu":
        return cpu
    found = cuda_devices()
    if wanted == "auto":
        return found[0] if found else cpu
    alias = "cuda:0" if wanted == "cuda" else wanted
    for device in found:
        if device.alias == alias:
            return device
    known = ", ".join(["cpu", *(f"{d.alias} ({d.name})" for d in found)])
    raise DeviceError(f"no device {wanted!r} on this machine", where="--device", remedy=f"use one of: {known}")


def worker_count() -> int:
    """Number of CPU threads that trace: those that there are, or fewer by the variable `OBSCURA_THREADS`."""
    try:
        there = len(os.sched_getaffinity(0))
    except AttributeError:  # not on this platform
        there = os.cpu_count() or 1
    wanted = os.environ.get("OBSCURA_THREADS", "")
    return max(1, min(there, int(wanted)) if wanted.isdecimal() and int(wanted) else there)
