"""How each tracer finds a closest hit, and whether it may leak at vertices."""

from __future__ import annotations

from typing import Any

from bake.kernels.closest import bvh_closest, embree_closest
from bake.kernels.closest_without import bvh_closest_without

CLOSEST: dict[str, tuple[Any, bool]] = {
    "embree": (embree_closest, True),
    "warp": (bvh_closest, False),
    "embree-without": (embree_closest, True),
    "warp-without": (bvh_closest_without, False),
}
