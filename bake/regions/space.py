"""The space in which objects move, before anything is baked there: regions, links, and which points count."""

from __future__ import annotations

from dataclasses import dataclass

from bake.region_types import RegionGraph
from bake.types import BoolArray, Finding


@dataclass(frozen=True, slots=True)
class RegionSpace:
    """What `make_graph` finds.

    Attributes:
        graph: Regions and links.
        valid: Shape (r · GRID³,), bool, in the order of `grid_positions`: the point is reachable in free space from
            its region's seed, or its bit is set in the file.
        findings: What was set aside, coarsened or looks odd.
        coverage: Share of the walkable floor that lies in a region and can be reached there from its seed, in [0, 1];
            NaN where the regions were not made automatically.
        rays: Rays traced for it.
    """

    graph: RegionGraph
    valid: BoolArray
    findings: tuple[Finding, ...]
    coverage: float
    rays: int
