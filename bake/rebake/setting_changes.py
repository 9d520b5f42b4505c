"""What a change of settings asks for: nothing, other values from the same rays, other rays, or all of it."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from bake.setting_fields import option_name
from bake.settings import BakeSettings

SOLVE = frozenset({"mapping", "alpha", "back_face_threshold", "weld_instances"})
SAMPLES = frozenset({"rays", "samples_per_face", "sample_spacing"})
REGIONS = frozenset({"region_smallest", "optimise_centre", "region_beta", "region_sweeps", "region_tolerance"})
SPACE = frozenset({"regions", "region_directions", "region_cell"})
TREES = frozenset({"volume_spacing", "volume_directions", "refine_local"})
SMALL = frozenset({"decorator_radius"})
FOG = frozenset({"fog_density", "fit_fog"})
NOTHING = frozenset({"device", "tracer", "quality"})
"""The device and the tracer are what they were found to be, and the quality only fills other settings."""


@dataclass(frozen=True, slots=True)
class SettingsChange:
    """Names of the fields that differ, and what they ask for.

    Attributes:
        names: All of them, but for those of `NOTHING`.
        full: Options that ask for a whole bake, as the user knows them.
    """

    names: frozenset[str]
    full: tuple[str, ...]

    def any_of(self, *groups: frozenset[str]) -> bool:
        """Whether a field of one of these groups differs."""
        return any(self.names & group for group in groups)


def settings_change(old: BakeSettings, new: BakeSettings) -> SettingsChange:
    """What differs between two settings."""
    fields = dataclasses.fields(BakeSettings)
    names = {item.name for item in fields if getattr(old, item.name) != getattr(new, item.name)} - NOTHING
    local = SOLVE | SAMPLES | REGIONS | SPACE | TREES | SMALL | FOG
    full = tuple(option_name(item.name) for item in fields if item.name in names and item.name not in local)
    return SettingsChange(frozenset(names), full)
