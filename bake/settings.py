"""What a bake can be told: one frozen, validated type.

The command line's options, the window's form and the result's manifest are generated from the fields of
`BakeSettings`; each field's metadata holds its title, help, unit and bounds. A dataclass of our own rather than a
validation library, because the engine must import with NumPy, SciPy and Warp alone.
"""

from __future__ import annotations

import dataclasses
import difflib
import enum
import math
import typing
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from bake.errors import SettingsError
from bake.ground import Ground
from bake.options import convert, plain
from bake.setting_fields import check_bounds, option_name, setting


class MappingKind(enum.StrEnum):
    """How sample values become vertex values."""

    LEAST_SQUARES = "least-squares"
    AVERAGE = "average"


class Kernel(enum.StrEnum):
    """What a hit at distance d counts for."""

    OBSCURANCE = "obscurance"  # ρ(d) = 1 - 2^(-d/D), for every distance D (Sloan et al. 2013, equation 1)
    OCCLUSION = "occlusion"  # 0 for any hit within the maximum distance, else 1


class TracerKind(enum.StrEnum):
    """Which body traces."""

    AUTO = "auto"
    EMBREE = "embree"
    WARP = "warp"
    BRUTE = "brute"


class Quality(enum.StrEnum):
    """Presets for rays, samples and smoothing; what is set explicitly wins."""

    PREVIEW = "preview"
    FINAL = "final"
    REFERENCE = "reference"


QUALITY_PRESETS: Mapping[Quality, Mapping[str, Any]] = {
    Quality.PREVIEW: {"rays": 16, "samples_per_face": (1, 4), "alpha": 0.1},
    Quality.FINAL: {"rays": 64, "samples_per_face": (4, 16), "alpha": 0.03},
    Quality.REFERENCE: {"rays": 256, "samples_per_face": (16, 64), "alpha": 0.03},
}


@dataclass(frozen=True, slots=True, kw_only=True)
class BakeSettings:
    """Everything that decides a bake's result, besides the scene.

    Raises:
        SettingsError: on construction, if a value is out of its bounds; it names the option and the bound.
    """

    device: str = setting("auto", "Device", "auto, cpu, cuda or cuda:N", affects="nothing")
    tracer: TracerKind = setting(
        TracerKind.AUTO, "Tracer", "auto takes Warp on CUDA and Embree on the CPU", affects="nothing", advanced=True
    )
    rays: int = setting(64, "Rays", "Rays per surface sample; powers of two sample best", low=1, high=65535)
    adaptive_error: float | None = setting(
        None,
        "Adaptive error",
        "Error of vertex values at which rays end: a sample sends 4 to --rays, a power of two; without it, all of them",
        above=0.0,
        high=1.0,
        suggested=0.016,
    )
    samples_per_face: tuple[int, int] = setting(
        (4, 16), "Samples per face", "Fewest and most surface samples on a face", low=1, high=4096
    )
    sample_spacing: float = setting(
        0.5,
        "Sample spacing",
        "Between its minimum and maximum a face has one sample per square of this edge",
        unit="m",
        above=0.0,
        high=1e6,
    )
    distances: tuple[float, ...] = setting(
        (2.0, 300.0),
        "Distances",
        "Distances at which a blocker counts half; baked together from the same rays",
        unit="m",
        above=0.0,
        high=1e9,
    )
    kernel: Kernel = setting(
        Kernel.OBSCURANCE, "Kernel", "obscurance fades with distance; occlusion counts every hit within the maximum"
    )
    max_distance: float | None = setting(
        None,
        "Maximum distance",
        "Rays end here; without it, where the longest distance's tail falls under the bound",
        unit="m",
        above=0.0,
        high=1e9,
        suggested=100.0,
    )
    tail: float = setting(
        1 / 1024, "Tail bound", "Most AO that cutting the kernel's tail may change", above=0.0, high=0.1, advanced=True
    )
    mapping: MappingKind = setting(
        MappingKind.LEAST_SQUARES, "Mapping", "How samples become vertex values", affects="solve"
    )
    alpha: float = setting(
        0.03,
        "Smoothing",
        "Weight of the edge regulariser: 0.03 accurate, 0.1 smooth, 1 as Sloan et al.",
        low=0.0,
        high=1e6,
        affects="solve",
    )
    back_face_threshold: float = setting(
        0.25,
        "Back-face threshold",
        "A sample is invalid if a larger share of its hits are back faces",
        low=0.0,
        high=1.0,
        affects="solve",
    )
    weld_instances: bool = setting(
        False,
        "Weld across objects",
        "Smooth over coincident vertices of touching objects too",
        affects="solve",
        advanced=True,
    )
    crease_angle: float = setting(
        40.0,
        "Crease angle",
        "Edges sharper than this stay apart when normals are made or vertices welded",
        unit="°",
        low=0.0,
        high=180.0,
        affects="trace",
        advanced=True,
    )
    alpha_lookup: bool = setting(
        False,
        "Alpha at the hit",
        "Look alpha masks up in their texture at each hit instead of using their mean",
        advanced=True,
    )
    packets: bool = setting(
        False,
        "Ray packets",
        "On the CPU, follow rays sixteen at a time: up to a fifth faster, but where two faces meet at an edge it may "
        "hang on the rest of the scene which one a ray meets, a last bit apart",
        advanced=True,
    )
    decorator_radius: float | None = setting(
        None,
        "Decorator radius",
        "How far around itself a small decorator looks for surface; without it, 1.25 half diagonals of its box",
        unit="m",
        above=0.0,
        high=1e6,
        suggested=2.0,
        advanced=True,
    )
    volume_spacing: float = setting(
        1.0, "Tree volume spacing", "Edge of a cell of the volume around trees", unit="m", above=0.0, high=1e6
    )
    volume_directions: int = setting(
        1024,
        "Tree volume directions",
        "Rays from each voxel of the volume around trees; powers of two sample best",
        low=1,
        high=65535,
        advanced=True,
    )
    refine_local: bool = setting(
        False, "Refine local AO", "Fit each tree's local AO to all its instances instead of baking it alone"
    )
    fog_density: float = setting(
        0.35,
        "Fog density",
        "How fast shrubs dim what lies behind them, unless they say so themselves: 0.35 leaves half after two metres",
        unit="1/m",
        low=0.0,
        high=1000.0,
    )
    fit_fog: bool = setting(
        False, "Fit fog", "Give each shrub the density that dims like its real mesh does", advanced=True
    )
    ground: Ground | None = setting(None, "Ground plane", "AXIS[:SCALE[:OFFSET]]: a blocker under the scene")
    regions: str = setting(
        "scene", "Regions", "auto, none, or a JSON file of visibility regions; scene takes the side file's, if any"
    )
    region_directions: int = setting(
        1024,
        "Region directions",
        "Rays from each valid point of a region; powers of two sample best",
        low=1,
        high=65535,
        advanced=True,
    )
    region_cell: float = setting(
        0.25,
        "Region cell",
        "Edge of the cells in which automatic regions find free space",
        unit="m",
        above=0.0,
        high=1e6,
        advanced=True,
    )
    region_smallest: float = setting(
        1.0,
        "Smallest region",
        "Regions of less volume are absorbed by the neighbour that suits them best",
        unit="m³",
        low=0.0,
        high=1e12,
        affects="regions",
        advanced=True,
    )
    optimise_centre: bool = setting(
        False,
        "Optimise centres",
        "Search each region model's centre instead of trying two",
        affects="regions",
        advanced=True,
    )
    region_beta: float = setting(
        0.5,
        "Regularisation",
        "Weight of agreement between neighbouring region models: 0.5 gentle, 10 smooth, 0 none; bounds steps as well",
        low=0.0,
        high=1e9,
        affects="regions",
    )
    region_sweeps: int = setting(
        50,
        "Sweeps",
        "Most passes of the regularisation over all regions",
        low=0,
        high=100000,
        affects="regions",
        advanced=True,
    )
    region_tolerance: float = setting(
        1e-4,
        "Regularisation tolerance",
        "It ends when no model changes by more than this at a boundary",
        low=0.0,
        high=1.0,
        affects="regions",
        advanced=True,
    )
    seed: int = setting(1, "Seed", "Same scene, settings, seed and device give the same bits", low=0, high=2**32 - 1)
    quality: Quality = setting(Quality.FINAL, "Quality", "Preset for rays and samples; what is set explicitly wins")
    skip: tuple[str, ...] = setting((), "Skip", "Stages to leave out", advanced=True)

    SKIPPABLE: typing.ClassVar[tuple[str, ...]] = ("fog", "trees", "decorators", "lods", "regions")

    def __post_init__(self) -> None:
        for item in dataclasses.fields(self):
            check_bounds(item, getattr(self, item.name))
        if not self.distances:
            raise SettingsError("no distance given", where="--distances", remedy="give at least one, e.g. 2,300")
        if len(self.distances) > 8:
            raise SettingsError("more than 8 distances", where="--distances", remedy="bake them in two runs")
        fewest, most = self.samples_per_face
        if fewest > most:
            raise SettingsError(
                f"the minimum {fewest} is above the maximum {most}", where="--samples-per-face", remedy="swap them"
            )
        if self.kernel is Kernel.OCCLUSION and self.max_distance is None:
            raise SettingsError(
                "the occlusion kernel has no falloff of its own",
                where="--kernel",
                remedy="give --max-distance as well",
            )
        if self.adaptive_error is not None and (self.rays < 16 or self.rays & (self.rays - 1)):
            raise SettingsError(
                f"adaptive rays cannot be cut from {self.rays} a sample",
                where="--rays",
                remedy="use a power of two from 16 on",
            )
        for stage in self.skip:
            if stage not in self.SKIPPABLE:
                raise SettingsError(
                    f"no stage called {stage!r}", where="--skip", remedy=f"use some of {', '.join(self.SKIPPABLE)}"
                )

    @property
    def trace_distance(self) -> float:
        """Length of a ray in metres: what lies beyond changes no AO by more than `tail`."""
        natural = math.inf
        if self.kernel is Kernel.OBSCURANCE:
            natural = max(self.distances) * math.log2(1.0 / self.tail)
        return natural if self.max_distance is None else min(natural, self.max_distance)

    @property
    def distance_count(self) -> int:
        """Number of AO columns: one a distance; a single one for plain occlusion."""
        return 1 if self.kernel is Kernel.OCCLUSION else len(self.distances)

    @property
    def column_distances(self) -> tuple[float, ...]:
        """The distance that labels each AO column, in metres."""
        if self.kernel is Kernel.OCCLUSION:
            assert self.max_distance is not None
            return (self.max_distance,)
        return self.distances

    def replaced(self, **changes: Any) -> BakeSettings:
        """A copy with some fields changed, validated again."""
        return dataclasses.replace(self, **changes)

    def to_json(self) -> dict[str, Any]:
        """Plain values by long option name, as the manifest stores them."""
        return {option_name(item.name): plain(getattr(self, item.name)) for item in dataclasses.fields(self)}

    @staticmethod
    def from_options(options: Mapping[str, Any], *, where: str = "") -> BakeSettings:
        """Settings from plain values by long option name; the quality preset fills what is not said.

        Args:
            options: Strings as typed on a command line, or values as read from TOML or JSON.
            where: The file the options came from, for messages.

        Raises:
            SettingsError: unknown option (the nearest one is named), wrong type, or out of bounds.
        """
        fields_by_option = {option_name(item.name): item for item in dataclasses.fields(BakeSettings)}
        hints = typing.get_type_hints(BakeSettings)
        values: dict[str, Any] = {}
        for option, value in options.items():
            item = fields_by_option.get(option)
            if item is None:
                near = difflib.get_close_matches(option, fields_by_option, 1)
                raise SettingsError(
                    f"unknown option {option!r}",
                    where=where,
                    remedy=f"did you mean {near[0]!r}?" if near else f"known: {', '.join(sorted(fields_by_option))}",
                )
            values[item.name] = convert(value, hints[item.name], _named(option, where))
        quality = values.get("quality", Quality.FINAL)
        return BakeSettings(**{**QUALITY_PRESETS[quality], **values})


def _named(option: str, where: str) -> str:
    return f"{where}: {option}" if where else f"--{option}"
