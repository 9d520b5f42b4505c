"""The generated form, and the command line that does the same."""

from __future__ import annotations

import argparse
import dataclasses
import shlex
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PyQt6.QtWidgets import QCheckBox, QComboBox, QLineEdit
from pytestqt.qtbot import QtBot

from app.command import bake_command
from app.commands.settings_options import add_settings_options, explicit_options, joined_values
from app.setting_editors import ALPHA_LOOKS
from app.settings_form import SettingsForm, tooltip_of
from bake.errors import SettingsError
from bake.ground import Ground
from bake.settings import QUALITY_PRESETS, BakeSettings, Kernel, MappingKind, Quality, TracerKind

numbers = st.floats(0.001, 1e5, allow_nan=False)
valid_settings = st.builds(
    BakeSettings,
    device=st.sampled_from(["auto", "cpu", "cuda:1"]),
    tracer=st.sampled_from(TracerKind),
    rays=st.integers(1, 65535),
    samples_per_face=st.tuples(st.integers(1, 60), st.integers(60, 4096)),
    sample_spacing=numbers,
    distances=st.lists(numbers, min_size=1, max_size=8).map(tuple),
    kernel=st.sampled_from(Kernel),
    max_distance=numbers,
    tail=st.floats(1e-6, 0.1),
    mapping=st.sampled_from(MappingKind),
    alpha=st.floats(0.0, 1e6),
    back_face_threshold=st.floats(0.0, 1.0),
    weld_instances=st.booleans(),
    crease_angle=st.floats(0.0, 180.0),
    alpha_lookup=st.booleans(),
    ground=st.none() | st.builds(Ground, st.integers(0, 5), numbers, st.floats(-1, 1)),
    seed=st.integers(0, 2**32 - 1),
    quality=st.sampled_from(Quality),
    skip=st.sets(st.sampled_from(BakeSettings.SKIPPABLE)).map(
        lambda chosen: tuple(stage for stage in BakeSettings.SKIPPABLE if stage in chosen)
    ),
)
pytestmark = pytest.mark.gui
_LENIENT = settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))


@pytest.fixture
def form(qtbot: QtBot) -> SettingsForm:
    """A form with the default settings."""
    made = SettingsForm()
    qtbot.addWidget(made)
    return made


def test_form_starts_with_the_defaults(form: SettingsForm) -> None:
    """Nothing edited, nothing changed; every setting has an editor."""
    assert form.settings() == BakeSettings()
    for item in dataclasses.fields(BakeSettings):
        assert form.editor(item.name).toolTip() == tooltip_of(item)


@_LENIENT
@given(shown=valid_settings)
def test_settings_survive_the_form(qapp: object, shown: BakeSettings) -> None:
    """What is put into the form comes back to the last digit."""
    form = SettingsForm()
    form.set_settings(shown)
    assert form.validate() is None
    assert form.settings() == shown
    form.deleteLater()


@_LENIENT
@given(wanted=valid_settings, base=valid_settings | st.none())
def test_copied_command_bakes_with_the_same_settings(wanted: BakeSettings, base: BakeSettings | None) -> None:
    """The command line, read by the command line's own parser over the side file, gives the same settings."""
    words = shlex.split(bake_command(Path("a level.glb"), Path("out"), wanted, base))
    assert words[:6] == ["python", "main.py", "bake", "a level.glb", "-o", "out"]
    parser = argparse.ArgumentParser(allow_abbrev=False)
    add_settings_options(parser)
    explicit = explicit_options(parser.parse_args(joined_values(words[6:])))
    side_file: dict[str, Any] = {} if base is None else base.to_json()
    assert BakeSettings.from_options({**side_file, **explicit}) == wanted


def test_untouched_settings_need_no_options() -> None:
    """A scene baked as it stands has a short command."""
    command = bake_command(Path("a.glb"), Path("r"), BakeSettings(), BakeSettings())
    assert command == "python main.py bake a.glb -o r"


def test_quality_fills_rays_and_samples(form: SettingsForm) -> None:
    """Choosing a preset sets what it stands for; what is edited afterwards wins."""
    editor = form.editor("quality")
    combo = editor.findChild(QComboBox)
    assert combo is not None
    combo.setCurrentIndex(combo.findData(Quality.PREVIEW))
    assert form.settings().rays == QUALITY_PRESETS[Quality.PREVIEW]["rays"]
    assert form.settings().samples_per_face == QUALITY_PRESETS[Quality.PREVIEW]["samples_per_face"]
    form.editor("rays").set_value(33)
    assert form.settings().rays == 33


@pytest.mark.parametrize(("name", "alpha"), ALPHA_LOOKS)
def test_alpha_looks(form: SettingsForm, name: str, alpha: float) -> None:
    """A named look sets its weight, and a weight shows its name."""
    editor = form.editor("alpha")
    combo = editor.findChild(QComboBox)
    assert combo is not None
    combo.setCurrentIndex(combo.findText(name))
    combo.activated.emit(combo.currentIndex())
    assert form.settings().alpha == alpha
    editor.set_value(0.5)
    assert combo.currentText() == "custom"
    editor.set_value(alpha)
    assert combo.currentText() == name


@pytest.mark.parametrize(
    ("field", "text", "expected"),
    [
        ("distances", "2, far", "separate numbers by commas"),
        ("distances", "", "no distance given"),
        ("alpha", "-1", "below 0"),
        ("sample_spacing", "wide", "type a number"),
        ("tail", "1", "above 0.1"),
    ],
)
def test_wrong_text_is_explained_beside_its_field(
    form: SettingsForm, qtbot: QtBot, field: str, text: str, expected: str
) -> None:
    """What is wrong is said in words at the field at fault, and settings are refused until it is mended."""
    form.show()
    line = form.editor(field).findChild(QLineEdit)
    assert line is not None
    line.setText(text)
    line.textEdited.emit(text)
    message = form._messages[field]
    assert message.isVisible()
    assert expected in message.text()
    with pytest.raises(SettingsError):
        form.settings()
    form.editor(field).set_value(getattr(BakeSettings(), field))
    assert form.validate() is None
    assert not message.isVisible()


def test_contradictions_are_explained(form: SettingsForm) -> None:
    """Fields that contradict each other are reported at one of them."""
    form.editor("kernel").set_value(Kernel.OCCLUSION)
    error = form.validate()
    assert error is not None
    assert error.where == "--kernel"
    form.editor("max_distance").set_value(5.0)
    assert form.validate() is None


@pytest.mark.parametrize("name", ["adaptive_error", "max_distance", "decorator_radius"])
def test_optional_numbers_start_at_usable_values(form: SettingsForm, name: str) -> None:
    """Switching an optional number on gives settings that a bake takes, without typing anything."""
    assert getattr(form.settings(), name) is None
    switch = form.editor(name).findChild(QCheckBox)
    assert switch is not None
    switch.setChecked(True)
    item = next(item for item in dataclasses.fields(BakeSettings) if item.name == name)
    assert getattr(form.settings(), name) == item.metadata["suggested"]
