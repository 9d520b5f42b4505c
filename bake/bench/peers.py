"""Other bakers on the same mesh, each in an interpreter of its own that has it installed."""

from __future__ import annotations

import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import bake.bench.peer_programs as programs
from bake.errors import InputError
from bake.types import Float32Array

_NOT_INSTALLED = 3
_LONGEST = 400.0
_LIBRARY = "import ctypes.util, importlib.metadata as m\ntry: print(m.version({!r}))\nexcept Exception: print('')"


@dataclass(frozen=True, slots=True)
class Peer:
    """A baker.

    Attributes:
        name: As its users call it.
        program: File in `bake/bench/peer_programs`.
        package: What has to be installed for it.
        bounded: Whether it knows a greatest distance.
        efforts: What to ask of it, from fast to good: its rays or samples.
        way: What else its program is told.
    """

    name: str
    program: str
    package: str
    bounded: bool
    efforts: tuple[int, ...]
    way: str = ""


CYCLES = "Blender Cycles, corner colours"
"""The way that has a gate: a colour at each corner of each face, as painting tools make them, smooth-shaded."""

PEERS = (
    Peer(CYCLES, "with_cycles.py", "bpy", True, (16, 64, 256), "smooth"),
    Peer("Blender Cycles, corner colours, sharp edges", "with_cycles.py", "bpy", True, (16, 64), "sharp"),
    Peer("Blender Cycles, vertex colours", "with_cycles.py", "bpy", True, (4, 16, 64), "point"),
    Peer("rays from vertices (Open3D)", "with_open3d.py", "open3d", True, (16, 64)),
    Peer("libigl", "with_libigl.py", "libigl", False, (16,)),
    Peer("PyMeshLab", "with_pymeshlab.py", "pymeshlab", False, (16,)),
)


@dataclass(frozen=True, slots=True)
class PeerBake:
    """What a peer made of a mesh.

    Attributes:
        ao: Shape (v, 1) at the vertices, or (m, 3, 1) at the corners of the faces; float32.
        seconds: From the mesh's file to the stored result, as the peer's own process measured it.
    """

    ao: Float32Array
    seconds: float


def peer_version(python: Path, peer: Peer) -> str:
    """The version that an interpreter has of a peer; empty if none.

    Raises:
        InputError: there is no such interpreter.
    """
    try:
        ended = subprocess.run(
            [str(python), "-c", _LIBRARY.format(peer.package)], capture_output=True, text=True, timeout=60, check=False
        )
    except OSError as error:
        raise InputError(
            f"no interpreter ({error.strerror})", where=str(python), remedy="give the path of a python"
        ) from error
    return ended.stdout.strip()


def bake_with(
    python: Path, peer: Peer, mesh: Path, folder: Path, *, max_distance: float, effort: int
) -> PeerBake | None:
    """Lets a peer bake a mesh.

    Args:
        python: An interpreter that has the peer.
        peer: Who.
        mesh: An .npz with `positions` and `faces`.
        folder: For its result.
        max_distance: Metres; ignored by those that know none.
        effort: Its rays or samples.

    Returns:
        None if it failed or took longer than `_LONGEST` seconds.
    """
    output = folder / f"{peer.package}-{peer.way}-{effort}.npy"
    program = Path(programs.__path__[0]) / peer.program
    command = [str(python), str(program), str(mesh), str(output), f"{max_distance:g}", str(effort), peer.way]
    try:
        ended = subprocess.run(command, capture_output=True, text=True, timeout=_LONGEST, check=False, cwd=folder)
    except subprocess.TimeoutExpired:
        return None
    if ended.returncode == _NOT_INSTALLED or not output.is_file():
        return None
    ao = np.load(output, allow_pickle=False).astype(np.float32)
    return PeerBake(np.nan_to_num(ao, nan=1.0)[..., None], float(ended.stdout.split()[-1]))
