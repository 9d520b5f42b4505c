"""Settings: one validated type that round-trips through every form it is written in."""

from __future__ import annotations

import dataclasses
import math
import pickle

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bake.errors import Cancelled, ObscuraError, SceneError, SettingsError
from bake.ground import Ground
from bake.setting_fields import option_name
from bake.settings import BakeSettings, Kernel, Quality

REFUSED = {
    "rays 0": {"rays": 0},
    "rays not whole": {"rays": 1.5},
    "rays a word": {"rays": "many"},
    "no distance": {"distances": ""},
    "negative distance": {"distances": "-2"},
    "infinite distance": {"distances": "inf"},
    "nan alpha": {"alpha": "nan"},
    "minimum above maximum": {"samples-per-face": "9:3"},
    "unknown option": {"ray": 4},
    "occlusion without an end": {"kernel": "occlusion"},
    "unknown kernel": {"kernel": "magic"},
    "bad ground": {"ground": "up"},
    "threshold above 1": {"back-face-threshold": 1.5},
    "unknown stage": {"skip": ["solve"]},
    "boolean as number": {"rays": True},
}


@pytest.mark.parametrize("options", REFUSED.values(), ids=REFUSED.keys())
def test_bad_settings_are_refused_in_one_line(options: dict[str, object]) -> None:
    """Each bad setting is named in one line that says what to use instead."""
    with pytest.raises(SettingsError) as refused:
        BakeSettings.from_options(options)
    assert "\n" not in str(refused.value)
    assert next(iter(options)) in str(refused.value)
    assert refused.value.remedy
    assert refused.value.exit_code == 2


def test_unknown_option_names_the_nearest() -> None:
    """A slip of the finger is met with the option that was meant."""
    with pytest.raises(SettingsError, match="did you mean 'distances'"):
        BakeSettings.from_options({"distance": "2"})


def test_every_field_can_make_a_form() -> None:
    """Each field has a title, a help text and a stage that it affects."""
    for field in dataclasses.fields(BakeSettings):
        assert field.metadata["title"], field.name
        assert field.metadata["help"], field.name
        assert field.metadata["affects"] in ("trace", "solve", "regions", "nothing"), field.name
        assert option_name(field.name) == field.name.replace("_", "-")


@given(
    rays=st.integers(1, 65535),
    distances=st.lists(st.floats(1e-3, 1e6), min_size=1, max_size=8),
    alpha=st.floats(0, 1e6),
    axis=st.integers(0, 5),
    seed=st.integers(0, 2**32 - 1),
)
def test_settings_survive_the_manifest(rays: int, distances: list[float], alpha: float, axis: int, seed: int) -> None:
    """What is written to JSON is read back equal."""
    settings = BakeSettings(
        rays=rays, distances=tuple(distances), alpha=alpha, ground=Ground(axis, 10.0, 0.5), seed=seed
    )
    assert BakeSettings.from_options(settings.to_json()) == settings


def test_presets_fill_only_what_is_not_said() -> None:
    """An explicit number of rays wins over the preset's; the samples still come from it."""
    settings = BakeSettings.from_options({"quality": "preview", "rays": 128})
    assert settings.quality is Quality.PREVIEW
    assert (settings.rays, settings.samples_per_face) == (128, (1, 4))


def test_trace_distance_follows_the_longest_kernel() -> None:
    """Rays end where the longest falloff's tail falls under the bound, or at the maximum distance."""
    short = BakeSettings(distances=(2.0,), tail=1 / 512)
    assert short.trace_distance == pytest.approx(18.0)
    assert BakeSettings(distances=(2.0, 300.0), tail=1 / 512).trace_distance == pytest.approx(2700.0)
    assert short.replaced(max_distance=5.0).trace_distance == 5.0
    occlusion = BakeSettings(kernel=Kernel.OCCLUSION, max_distance=7.0)
    assert occlusion.trace_distance == 7.0
    assert occlusion.distance_count == 1
    assert math.isfinite(short.trace_distance)


def test_errors_travel_between_processes() -> None:
    """An error keeps its parts when the engine process sends it to the window."""
    for error in (SceneError("no faces", where="a.obj", remedy="export them"), Cancelled(), ObscuraError("x")):
        copy = pickle.loads(pickle.dumps(error))
        assert (type(copy), str(copy), copy.exit_code) == (type(error), str(error), error.exit_code)
    assert str(SceneError("no faces", where="a.obj", remedy="export them")) == "a.obj: no faces; export them"
