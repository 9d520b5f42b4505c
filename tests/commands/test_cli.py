"""The command line itself: which command, which options, and how errors end."""

from __future__ import annotations

import dataclasses
import logging
from pathlib import Path

import pytest
from conftest import Run, in_process

from app import cli
from app.commands import COMMANDS
from app.commands.settings_options import add_settings_options, explicit_options, joined_values
from bake.errors import OutOfMemoryError
from bake.settings import BakeSettings


def settings_of(words: list[str]) -> BakeSettings:
    """Settings as a command would make them of its words."""
    parser = cli._Parser(allow_abbrev=False)
    add_settings_options(parser)
    return BakeSettings.from_options(explicit_options(parser.parse_args(joined_values(words))))


def test_every_setting_has_an_option() -> None:
    """An option of every setting's long name is accepted, and its own value comes back."""
    words: list[str] = []
    for option, value in BakeSettings().to_json().items():
        if isinstance(value, bool):
            words.append(f"--{option}" if value else f"--no-{option}")
        elif isinstance(value, list):
            words.append(f"--{option}=" + (":" if option == "samples-per-face" else ",").join(map(str, value)))
        elif value is not None:
            words.append(f"--{option}={value}")
    assert len(words) >= len(dataclasses.fields(BakeSettings)) - 4  # four are not set by default
    assert settings_of(words) == BakeSettings()


def test_options_of_the_contract() -> None:
    """The options that scripts rely on mean what they say."""
    words = "--device cuda:1 --rays 128 --samples-per-face 2:8 --distances 1,50 --alpha 0.1 --mapping average"
    words += " --kernel occlusion --max-distance 12.5 --ground -y:50:0.1 --regions none --seed 7 --quality preview"
    words += " --tracer brute --skip fog,trees --weld-instances"
    settings = settings_of(words.split())
    assert (settings.device, settings.rays, settings.samples_per_face) == ("cuda:1", 128, (2, 8))
    assert (settings.distances, settings.alpha, settings.mapping) == ((1.0, 50.0), 0.1, "average")
    assert (settings.kernel, settings.max_distance, str(settings.ground)) == ("occlusion", 12.5, "-y:50:0.1")
    assert (settings.seed, settings.quality, settings.tracer) == (7, "preview", "brute")
    assert settings.skip == ("fog", "trees")
    assert settings.weld_instances


def test_what_is_not_said_is_left_to_the_preset() -> None:
    """Only explicit options are passed on, so that a preset or a side file can fill the rest."""
    parser = cli._Parser()
    add_settings_options(parser)
    assert explicit_options(parser.parse_args(["--quality", "preview"])) == {"quality": "preview"}
    assert settings_of(["--quality", "preview"]).rays == 16


@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_every_command(run: Run, command: str) -> None:
    """Each command explains itself on stdout."""
    code, out, err = run(command, "--help")
    assert (code, err) == (0, "")
    assert out.startswith(f"usage: main.py {command} ")


def test_help_lists_the_commands(run: Run) -> None:
    """The program's help names all commands, and the version is one line."""
    _, out, _ = run("--help")
    assert all(f"\n  {command}" in out for command in COMMANDS)
    assert run("--version")[1].startswith("Obscura ")


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        (["bake"], "the following arguments are required"),
        (["bake", "a.glb"], "-o/--output"),
        (["bake", "a.glb", "-o", "r", "--rayz", "3"], "did you mean --rays?"),
        (["bake", "a.glb", "-o", "r", "--rays"], "expected one argument"),
        (["bake", "a.glb", "b.glb", "-o", "r"], "unexpected argument b.glb"),
        (["bake", "a.glb", "-o", "r", "--ray", "3"], "unknown option --ray"),
        (["bake", "a.glb", "-o", "r", "--rays", "many"], "use a whole number"),
        (["bake", "a.glb", "-o", "r", "--mapping", "mean"], "least-squares or average"),
        (["bake", "a.glb", "-o", "r", "--samples-per-face", "1:2:3"], "MIN or MIN:MAX"),
        (["bake", "a.glb", "-o", "r", "--kernel", "occlusion"], "--max-distance"),
        (["export", "r"], "required"),
        (["report", "r"], "required"),
        (["baek"], "did you mean the command 'bake'?"),
        (["nowhere.glb"], "no such file"),
    ],
)
def test_wrong_usage_is_one_line(run: Run, words: list[str], hint: str) -> None:
    """Wrong usage ends with exit code 2 and one line that helps."""
    code, out, err = run(*words)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("obscura: ")
    assert hint in err


def test_an_unforeseen_error_is_one_line(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """A bug ends with exit code 1 and a hint; the traceback comes on request only."""

    def broken(_words: list[str]) -> int:
        raise ZeroDivisionError("by\nzero")

    monkeypatch.setattr(cli, "_run", broken)
    code, _, err = run("bake")
    assert (code, err.count("\n")) == (1, 1)
    assert "--verbose" in err
    assert "Traceback" in run("bake", "--verbose")[2]
    monkeypatch.setenv("OBSCURA_DEBUG", "1")
    assert "Traceback" in run("bake")[2]


@pytest.mark.parametrize(
    ("error", "code", "text"),
    [
        (KeyboardInterrupt(), 130, "cancelled"),
        (MemoryError(), 1, "memory"),
        (OutOfMemoryError("does not fit", where="trace"), 1, "trace: does not fit"),
        (BrokenPipeError(), 1, ""),
    ],
)
def test_other_ends(run: Run, monkeypatch: pytest.MonkeyPatch, error: BaseException, code: int, text: str) -> None:
    """Ctrl+C, lack of memory and a closed pipe each have their code."""

    def ended(_words: list[str]) -> int:
        raise error

    monkeypatch.setattr(cli, "_run", ended)
    got, out, err = run("bake")
    assert (got, out) == (code, "")
    assert text in err
    assert err.count("\n") <= 1


def test_verbose_logs_our_packages_only() -> None:
    """--verbose shows our own log and leaves that of libraries alone."""
    cli.set_up_log(verbose=True)
    assert logging.getLogger("bake").isEnabledFor(logging.DEBUG)
    assert not logging.getLogger("matplotlib").isEnabledFor(logging.INFO)
    cli.set_up_log(verbose=False)
    assert not logging.getLogger("bake").isEnabledFor(logging.INFO)


def test_main_py_in_its_own_process(tmp_path: Path) -> None:
    """The script itself passes codes and output on."""
    done = in_process("--version")
    assert (done.returncode, done.stderr) == (0, "")
    done = in_process("bake", tmp_path / "no.glb", "-o", tmp_path / "r")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == 1
