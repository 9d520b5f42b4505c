"""The few functions of Embree 4's C interface that a triangle scene needs.

The library is the one that the package `embreex` carries. Its Python interface takes arrays of rays; calling the
library from inside the kernel instead saves writing and reading 60 bytes a ray.
"""

from __future__ import annotations

import copy
import ctypes
import importlib
import importlib.util
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from bake.errors import DeviceError, OutOfMemoryError
from bake.types import Float32Array, UInt32Array

_TRIANGLES, _INDEX_BUFFER, _VERTEX_BUFFER = 0, 0, 1
_UINT3, _FLOAT3 = 0x5003, 0x9003
_ROBUST = 1 << 2
_OUT_OF_MEMORY = 4
_ERRORS = {1: "unknown error", 2: "invalid argument", 3: "invalid operation", 5: "unsupported processor"}


@cache
def _library() -> Any:
    remedy = "install the package embreex, or use --tracer warp"
    spec = importlib.util.find_spec("embreex")
    if spec is None or spec.origin is None:
        raise DeviceError("Embree is not installed", where="--tracer", remedy=remedy)
    package = Path(spec.origin).parent
    places = (package.parent / "embreex.libs", package / ".dylibs", package)
    found = [f for place in places if place.is_dir() for f in sorted(place.glob("*embree4*")) if f.is_file()]
    try:
        importlib.import_module("embreex.rtcore_scene")  # loads the libraries that Embree needs

        library = ctypes.CDLL(str(found[0]))
    except (ImportError, OSError, IndexError) as error:
        raise DeviceError(f"Embree does not load ({error})", where="--tracer", remedy=remedy) from error
    pointer, size = ctypes.c_void_p, ctypes.c_size_t
    signatures: dict[str, tuple[Any, list[Any]]] = {
        "rtcNewDevice": (pointer, [ctypes.c_char_p]),
        "rtcGetDeviceError": (ctypes.c_int, [pointer]),
        "rtcNewScene": (pointer, [pointer]),
        "rtcSetSceneFlags": (None, [pointer, ctypes.c_int]),
        "rtcCommitScene": (None, [pointer]),
        "rtcRetainScene": (None, [pointer]),
        "rtcReleaseScene": (None, [pointer]),
        "rtcNewGeometry": (pointer, [pointer, ctypes.c_int]),
        "rtcSetSharedGeometryBuffer": (
            None, [pointer, ctypes.c_int, ctypes.c_uint, ctypes.c_int, pointer, size, size, size],
        ),
        "rtcCommitGeometry": (None, [pointer]),
        "rtcAttachGeometry": (ctypes.c_uint, [pointer, pointer]),
        "rtcReleaseGeometry": (None, [pointer]),
    }  # fmt: skip
    for name, (result, arguments) in signatures.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library


@cache
def _device() -> Any:
    """One for the whole process: each starts threads, and is slow to make."""
    return _library().rtcNewDevice(None)


class EmbreeScene:
    """A committed scene of triangles.

    Attributes:
        address: The RTCScene; 0 once closed.
        triangles: How many it has.
        intersect_address, intersect_packet_address: The functions rtcIntersect1 and rtcIntersect16.
    """

    def __init__(self, points: Float32Array, faces: UInt32Array) -> None:
        """Builds the BVH.

        Args:
            points: Shape (n, 3).
            faces: Shape (m, 3).

        Raises:
            DeviceError: Embree is missing or refuses.
            OutOfMemoryError: the BVH does not fit.
        """
        library = self._library = _library()
        # Embree reads vertices 16 bytes at a time, so the last one needs something behind it.
        self._points = np.concatenate([points.ravel(), np.zeros(4, np.float32)])
        self._faces = np.ascontiguousarray(faces)
        self.triangles = len(faces)
        device = _device()
        self.address = library.rtcNewScene(device)
        # Robust: watertight at edges and vertices, for a few per cent of speed.
        library.rtcSetSceneFlags(self.address, _ROBUST)
        geometry = library.rtcNewGeometry(device, _TRIANGLES)
        share = library.rtcSetSharedGeometryBuffer
        share(geometry, _VERTEX_BUFFER, 0, _FLOAT3, self._points.ctypes.data, 0, 12, len(points))
        share(geometry, _INDEX_BUFFER, 0, _UINT3, self._faces.ctypes.data, 0, 12, len(faces))
        library.rtcCommitGeometry(geometry)
        library.rtcAttachGeometry(self.address, geometry)
        library.rtcReleaseGeometry(geometry)
        library.rtcCommitScene(self.address)
        code = library.rtcGetDeviceError(device)
        if code:
            self.close()
            if code == _OUT_OF_MEMORY:
                raise OutOfMemoryError("the BVH does not fit", where="trace", remedy="close other programs")
            raise DeviceError(f"Embree: {_ERRORS.get(code, code)}", where="trace", remedy="use --tracer warp")
        self.intersect_address = _address(library.rtcIntersect1)
        self.intersect_packet_address = _address(library.rtcIntersect16)

    def shared(self) -> EmbreeScene:
        """The same scene for another owner; it is freed when all of them have closed it."""
        self._library.rtcRetainScene(self.address)
        return copy.copy(self)

    def close(self) -> None:
        """Gives the BVH up; safe to call twice."""
        if self.address:
            self._library.rtcReleaseScene(self.address)
            self.address = 0


def _address(function: Any) -> int:
    return int(ctypes.cast(function, ctypes.c_void_p).value or 0)
