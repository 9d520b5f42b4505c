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
from typing import Any, cast

from bake.errors import SettingsError
from bake.options import convert, plain


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
    """Presets for rays and samples; what is set explicitly wins."""

    PREVIEW = "preview"
    FINAL = "final"
    REFERENCE = "reference"


QUALITY_PRESETS: Mapping[Quality, Mapping[str, Any]] = {
    Quality.PREVIEW: {"rays": 16, "samples_per_face": (1, 4)},
    Quality.FINAL: {"rays": 64, "samples_per_face": (4, 16)},
    Quality.REFERENCE: {"rays": 256, "samples_per_face": (16, 64)},
}


@dataclass(frozen=True, slots=True)
class Ground:
    """A two-sided quad that blocks but receives nothing, against one side of the scene's bounding box.

    Attributes:
        axis: 0 to 5: +x, -x, +y, -y, +z, -z is the side that faces up, away from the ground
            (the quad lies on the opposite side of the box).
        scale: Its edges in units of the scene's extents.
        offset: Its distance from the box in units of the scene's extent along the axis.
    """

    axis: int = 2
    scale: float = 100.0
    offset: float = 0.03

    AXES: typing.ClassVar[tuple[str, ...]] = ("+x", "-x", "+y", "-y", "+z", "-z")

    @staticmethod
    def parse(text: str) -> Ground:
        """Reads `AXIS[:SCALE[:OFFSET]]`, the axis as 0-5 or as +x, -x, +y, -y, +z, -z."""
        parts = text.split(":")
        try:
            name = parts[0].strip().lower()
            axis = Ground.AXES.index(name) if name in Ground.AXES else int(name)
            scale = float(parts[1]) if len(parts) > 1 else 100.0
            offset = float(parts[2]) if len(parts) > 2 else 0.03
        except ValueError:
            axis, scale, offset = -1, 0.0, 0.0
        if len(parts) > 3 or not 0 <= axis <= 5 or not scale > 0 or not math.isfinite(scale + offset):
            raise SettingsError(
                f"{text!r} is no ground plane",
                where="--ground",
                remedy="write AXIS[:SCALE[:OFFSET]] with AXIS one of +x -x +y -y +z -z and a positive scale",
            )
        return Ground(axis, scale, offset)

    def __str__(self) -> str:
        return f"{self.AXES[self.axis]}:{_exact(self.scale)}:{_exact(self.offset)}"


def _setting(
    default: Any,
    title: str,
    text: str,
    *,
    unit: str = "",
    low: float | None = None,
    high: float | None = None,
    above: float | None = None,
    advanced: bool = False,
    affects: str = "trace",
) -> Any:
    """A field with what validation and the generated forms need.

    `low` and `high` are inclusive bounds, `above` an exclusive one. `affects` names the earliest stage that must run
    again when the value changes: "trace", "solve" or "nothing".
    """
    return dataclasses.field(
        default=default,
        metadata={
            "title": title,
            "help": text,
            "unit": unit,
            "low": low,
            "high": high,
            "above": above,
            "advanced": advanced,
            "affects": affects,
        },
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class BakeSettings:
    """Everything that decides a bake's result, besides the scene.

    Raises:
        SettingsError: on construction, if a value is out of its bounds; it names the option and the bound.
    """

    device: str = _setting("auto", "Device", "auto, cpu, cuda or cuda:N", affects="nothing")
    tracer: TracerKind = _setting(
        TracerKind.AUTO, "Tracer", "auto takes Warp on CUDA and Embree on the CPU", affects="nothing", advanced=True
    )
    rays: int = _setting(64, "Rays", "Rays per surface sample; powers of two sample best", low=1, high=65535)
    samples_per_face: tuple[int, int] = _setting(
        (4, 16), "Samples per face", "Fewest and most surface samples on a face", low=1, high=4096
    )
    sample_spacing: float = _setting(
        0.5,
        "Sample spacing",
        "Between its minimum and maximum a face has one sample per square of this edge",
        unit="m",
        above=0.0,
        high=1e6,
    )
    distances: tuple[float, ...] = _setting(
        (2.0, 300.0),
        "Distances",
        "Distances at which a blocker counts half; baked together from the same rays",
        unit="m",
        above=0.0,
        high=1e9,
    )
    kernel: Kernel = _setting(
        Kernel.OBSCURANCE, "Kernel", "obscurance fades with distance; occlusion counts every hit within the maximum"
    )
    max_distance: float | None = _setting(
        None,
        "Maximum distance",
        "Rays end here; without it, where the longest distance's tail falls under the bound",
        unit="m",
        above=0.0,
        high=1e9,
    )
    tail: float = _setting(
        1 / 1024, "Tail bound", "Most AO that cutting the kernel's tail may change", above=0.0, high=0.1, advanced=True
    )
    mapping: MappingKind = _setting(
        MappingKind.LEAST_SQUARES, "Mapping", "How samples become vertex values", affects="solve"
    )
    alpha: float = _setting(
        0.03,
        "Smoothing",
        "Weight of the edge regulariser: 0.03 accurate, 0.1 smooth, 1 as Sloan et al.",
        low=0.0,
        high=1e6,
        affects="solve",
    )
    back_face_threshold: float = _setting(
        0.25,
        "Back-face threshold",
        "A sample is invalid if a larger share of its hits are back faces",
        low=0.0,
        high=1.0,
        affects="solve",
    )
    weld_instances: bool = _setting(
        False,
        "Weld across objects",
        "Smooth over coincident vertices of touching objects too",
        affects="solve",
        advanced=True,
    )
    crease_angle: float = _setting(
        40.0,
        "Crease angle",
        "Edges sharper than this stay apart when normals are made or vertices welded",
        unit="°",
        low=0.0,
        high=180.0,
        affects="trace",
        advanced=True,
    )
    alpha_lookup: bool = _setting(
        False,
        "Alpha at the hit",
        "Look alpha masks up in their texture at each hit instead of using their mean",
        advanced=True,
    )
    decorator_radius: float | None = _setting(
        None,
        "Decorator radius",
        "How far around itself a small decorator looks for surface; without it, 1.25 half diagonals of its box",
        unit="m",
        above=0.0,
        high=1e6,
        advanced=True,
    )
    volume_spacing: float = _setting(
        1.0, "Tree volume spacing", "Edge of a cell of the volume around trees", unit="m", above=0.0, high=1e6
    )
    volume_directions: int = _setting(
        1024,
        "Tree volume directions",
        "Rays from each voxel of the volume around trees; powers of two sample best",
        low=1,
        high=65535,
        advanced=True,
    )
    refine_local: bool = _setting(
        False, "Refine local AO", "Fit each tree's local AO to all its instances instead of baking it alone"
    )
    fog_density: float = _setting(
        0.35,
        "Fog density",
        "How fast shrubs dim what lies behind them, unless they say so themselves: 0.35 leaves half after two metres",
        unit="1/m",
        low=0.0,
        high=1000.0,
    )
    fit_fog: bool = _setting(
        False, "Fit fog", "Give each shrub the density that dims like its real mesh does", advanced=True
    )
    ground: Ground | None = _setting(None, "Ground plane", "AXIS[:SCALE[:OFFSET]]: a blocker under the scene")
    regions: str = _setting("none", "Regions", "auto, none or a JSON file of visibility regions")
    seed: int = _setting(1, "Seed", "Same scene, settings, seed and device give the same bits", low=0, high=2**32 - 1)
    quality: Quality = _setting(Quality.FINAL, "Quality", "Preset for rays and samples; what is set explicitly wins")
    skip: tuple[str, ...] = _setting((), "Skip", "Stages to leave out", advanced=True)

    SKIPPABLE: typing.ClassVar[tuple[str, ...]] = ("fog", "trees", "decorators", "lods", "regions")

    def __post_init__(self) -> None:
        for item in dataclasses.fields(self):
            _check_bounds(item, getattr(self, item.name))
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


def option_name(field_name: str) -> str:
    """The long option of a field, without dashes: `samples_per_face` is `samples-per-face`."""
    return field_name.replace("_", "-")


def _exact(number: float) -> str:
    """The shortest text that reads back as the same number."""
    short = f"{number:g}"
    return short if float(short) == number else repr(number)


def _named(option: str, where: str) -> str:
    return f"{where}: {option}" if where else f"--{option}"


def _check_bounds(item: dataclasses.Field[Any], value: Any) -> None:
    low, high, above = (item.metadata[key] for key in ("low", "high", "above"))
    if low is None and high is None and above is None:
        return
    numbers = cast("tuple[Any, ...]", value) if isinstance(value, tuple) else (value,)
    for number in numbers:
        if number is None:
            continue
        if not math.isfinite(number):
            problem = "is not finite"
        elif low is not None and number < low:
            problem = f"is below {low:g}"
        elif above is not None and not number > above:
            problem = f"is not above {above:g}"
        elif high is not None and number > high:
            problem = f"is above {high:g}"
        else:
            continue
        unit = f" {item.metadata['unit']}" if item.metadata["unit"] else ""
        bounds = f"{'above ' + format(above, 'g') if above is not None else f'{low:g}'} to {high:g}{unit}"
        raise SettingsError(f"{number!r} {problem}", where=f"--{option_name(item.name)}", remedy=f"use {bounds}")
