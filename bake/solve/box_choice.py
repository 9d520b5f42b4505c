"""Which solver a system gets: NumPy for small ones, kernels on CUDA or on all cores for large ones."""

from __future__ import annotations

import logging
from threading import Thread

from scipy.sparse import csr_array

from bake.devices import Device, resolve
from bake.errors import DeviceError
from bake.solve.conjugate_gradient import BoxSolver
from bake.solve.device_box import DeviceBoxSolver, load_kernels
from bake.types import Int64Array

_log = logging.getLogger(__name__)

SMALLEST = {"cuda": 100_000, "cpu": 150_000}
"""Unknowns from which on the kernels are worth having: they load in a tenth of a second, and compile in five, once."""


def box_solver(matrix: csr_array, first: Int64Array, wanted: str) -> BoxSolver:
    """The solver for a system.

    Args:
        matrix, first: As for `BoxSolver`.
        wanted: As the settings name devices. On a machine that has none of that name the CPU solves: nobody could tell
            by the values.
    """
    device = _device(matrix.shape[0], wanted)
    return BoxSolver(matrix, first) if device is None else DeviceBoxSolver(matrix, first, device)


def prepare(unknowns: int, columns: int, wanted: str) -> None:
    """Loads the kernels that a system of this size will ask for, in the background; the first time they are compiled.

    Args:
        unknowns, columns: The most that there may be, and the number of right-hand sides.
        wanted: As for `box_solver`.
    """
    device = _device(unknowns, wanted)
    if device is not None:
        Thread(target=_loaded, args=(columns, device), name="solve kernels").start()


def _loaded(columns: int, device: Device) -> None:
    try:
        load_kernels(columns, device)
    except (RuntimeError, OSError) as error:  # the solve meets it again and tells
        _log.debug("the kernels of the solve could not be loaded (%s)", error)


def _device(unknowns: int, wanted: str) -> Device | None:
    """Where a system of so many unknowns is solved; None for NumPy."""
    if unknowns < min(SMALLEST.values()):
        return None
    try:
        try:
            device = resolve(wanted)
        except DeviceError as error:
            _log.debug("solving on the CPU: %s", error)
            device = resolve("cpu")
    except DeviceError:  # no Warp here
        return None
    return device if unknowns >= SMALLEST["cuda" if device.is_cuda else "cpu"] else None
