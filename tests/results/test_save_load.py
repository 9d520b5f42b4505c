"""What is stored comes back, bit by bit, and nothing of the user's is overwritten."""

from __future__ import annotations

import dataclasses
import json
import typing
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from synthetic_results import build_result, same_results

from bake.decorator_types import Decorators, FogBoxes, SmallScalars, TreeFits, TreeVolume
from bake.errors import ResultError, StorageError
from bake.results import check_destination, is_current, load_result, save_result
from bake.results.arrays import SPECS
from bake.results.parts import StoredModels
from bake.settings import BakeSettings
from bake.types import BakeResult, SampleSet, Tally, VertexField, World


@pytest.mark.parametrize("textures", [False, True])
def test_round_trip(tmp_path: Path, textures: bool) -> None:
    """Every field of a result survives saving and loading."""
    result = build_result(textures=textures)
    save_result(result, tmp_path / "deep" / "yard")
    assert same_results(load_result(tmp_path / "deep" / "yard"), result)
    names = {path.name for path in (tmp_path / "deep" / "yard").iterdir()}
    assert "manifest.json" in names
    assert all(name.endswith(".npy") for name in names - {"manifest.json"})


def test_every_array_is_stored() -> None:
    """An array field added to the shared types must get its place in the store."""
    stored = {spec.name for spec in SPECS}
    owners = {"world": World, "samples": SampleSet, "tally": Tally, "field": VertexField}
    decorators = {"fog": FogBoxes, "volume": TreeVolume, "models": StoredModels, "fits": TreeFits}
    scalars = {"shrub_scalars": SmallScalars, "small_scalars": SmallScalars}
    assert {item.name for item in dataclasses.fields(Decorators)} == {*decorators, *scalars}
    for owner, kind in {**owners, **decorators, **scalars}.items():
        for name, hint in typing.get_type_hints(kind).items():
            parts = typing.get_args(hint) if type(None) in typing.get_args(hint) else (hint,)
            if any(typing.get_origin(part) is typing.get_origin(NDArray[np.float64]) for part in parts):
                assert f"{owner}.{name}" in stored


def test_loaded_arrays_are_mapped(tmp_path: Path, result: BakeResult) -> None:
    """Loading reads no array into memory and hands out nothing writable."""
    save_result(result, tmp_path)
    positions = load_result(tmp_path).world.positions
    assert isinstance(positions.base, np.memmap)
    assert not positions.flags.writeable


def test_empty_result(tmp_path: Path) -> None:
    """A world without objects is stored like any other."""
    result = build_result(objects=0)
    save_result(result, tmp_path)
    assert same_results(load_result(tmp_path), result)


def test_replacing_keeps_mapped_arrays_valid(tmp_path: Path, result: BakeResult) -> None:
    """An open result stays readable while another takes its place, and the old files go."""
    save_result(result, tmp_path)
    old = load_result(tmp_path)
    other = build_result(seed=2, objects=5)
    save_result(other, tmp_path)
    assert same_results(old, result)
    assert same_results(load_result(tmp_path), other)
    assert len(list(tmp_path.glob("world_positions-*.npy"))) == 1


def test_saving_a_loaded_result_over_itself(tmp_path: Path, result: BakeResult) -> None:
    """A result may be changed in part and stored where it came from."""
    save_result(result, tmp_path)
    before = {path.name: path.stat().st_ino for path in tmp_path.glob("*.npy")}
    changed = dataclasses.replace(load_result(tmp_path), rays_skipped=99)
    save_result(changed, tmp_path)
    assert same_results(load_result(tmp_path), changed)
    assert {path.name: path.stat().st_ino for path in tmp_path.glob("*.npy")} == before


def test_strange_names_survive(tmp_path: Path, result: BakeResult) -> None:
    """Object paths may hold any text, and a report may lack a number."""
    world = dataclasses.replace(result.world, object_paths=('a"b\n', "日本/灯籠", "\u2028"))
    report = dataclasses.replace(result.field.report, residual=float("nan"))
    strange = dataclasses.replace(result, world=world, field=dataclasses.replace(result.field, report=report))
    save_result(strange, tmp_path)
    loaded = load_result(tmp_path)
    assert loaded.world.object_paths == world.object_paths
    assert np.isnan(loaded.field.report.residual)


def test_the_manifest_is_the_contract(tmp_path: Path, result: BakeResult) -> None:
    """The manifest says what other tools rely on, in strict JSON."""
    save_result(result, tmp_path)
    manifest = json.loads((tmp_path / "manifest.json").read_text(), parse_constant=lambda text: pytest.fail(text))
    assert manifest["schema"] == 4
    assert manifest["scene"] == {"path": "/levels/yard.glb", "files": {"yard.glb": "ab" * 32}}
    assert manifest["settings"]["distances"] == [2.0, 300.0]
    assert (manifest["seed"], manifest["device"], manifest["tracer"]) == (1, "cpu", "embree")
    assert {stage["status"] for stage in manifest["stages"]} == {"ran", "skipped"}
    assert all({"why", "seconds", "rays", "mrays_per_s", "peak_memory_mb"} <= set(s) for s in manifest["stages"])
    for stored in manifest["arrays"].values():
        assert (tmp_path / stored["file"]).is_file()
        assert len(stored["sha256"]) == 64


@pytest.mark.parametrize("content", [b"", b"{}", b'{"format": "web app"}', b"[1, 2]", b"\xff\xfe"])
def test_a_foreign_manifest_is_left_alone(tmp_path: Path, result: BakeResult, content: bytes) -> None:
    """A folder with somebody else's manifest.json is neither read nor overwritten."""
    (tmp_path / "manifest.json").write_bytes(content)
    with pytest.raises(ResultError, match=str(tmp_path)):
        load_result(tmp_path)
    with pytest.raises(ResultError, match="left alone"):
        save_result(result, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["manifest.json"]
    assert (tmp_path / "manifest.json").read_bytes() == content


def test_a_folder_that_is_no_result(tmp_path: Path, result: BakeResult) -> None:
    """A folder with other files, a file, and a folder of loose arrays are refused untouched."""
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos" / "cat.jpg").write_bytes(b"meow")
    (tmp_path / "file").write_bytes(b"text")
    (tmp_path / "loose").mkdir()
    (tmp_path / "loose" / "world_faces-0123456789abcdef.npy").write_bytes(b"mine")
    for name in ("photos", "file", "loose"):
        with pytest.raises(ResultError, match=r"is no result|not a result folder"):
            check_destination(tmp_path / name)
        with pytest.raises(ResultError):
            save_result(result, tmp_path / name)
        with pytest.raises(ResultError):
            load_result(tmp_path / name)
    assert (tmp_path / "photos" / "cat.jpg").read_bytes() == b"meow"
    assert (tmp_path / "loose" / "world_faces-0123456789abcdef.npy").read_bytes() == b"mine"


def test_other_files_beside_a_result_stay(tmp_path: Path, result: BakeResult) -> None:
    """Replacing a result leaves a report that the user put into its folder."""
    save_result(result, tmp_path)
    (tmp_path / "report.html").write_text("<p>")
    save_result(build_result(seed=9), tmp_path)
    assert (tmp_path / "report.html").read_text() == "<p>"


def test_checking_a_destination_creates_nothing(tmp_path: Path) -> None:
    """Before the bake a new destination is only probed."""
    check_destination(tmp_path / "a" / "b")
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "file").write_text("")
    with pytest.raises(StorageError, match=r"file/b"):
        check_destination(tmp_path / "file" / "b")


def test_another_schema_version_is_named(tmp_path: Path, result: BakeResult) -> None:
    """A result of a later program is not guessed at."""
    save_result(result, tmp_path)
    path = tmp_path / "manifest.json"
    path.write_text(path.read_text().replace('"schema": 4', '"schema": 99'))
    with pytest.raises(ResultError, match="schema version 99"):
        load_result(tmp_path)


def test_current_only_while_nothing_changed(tmp_path: Path, result: BakeResult) -> None:
    """Changed files, settings, device, versions or damage each make a result stale."""
    save_result(result, tmp_path)
    now = {
        "files": result.files,
        "settings": result.settings,
        "device": "cpu",
        "tracer": "embree",
        "versions": result.versions,
    }

    def current(**changes: object) -> bool:
        return is_current(tmp_path, **{**now, **changes})  # type: ignore[arg-type]

    assert current()
    assert current(settings=result.settings.replaced(device="cpu"))
    assert not current(settings=result.settings.replaced(alpha=0.5))
    assert not current(settings=result.settings.replaced(seed=2))
    assert not current(files={"yard.glb": "cd" * 32})
    assert not current(files={**result.files, "yard.obscura.toml": "00"})
    assert not current(device="NVIDIA X")
    assert not current(tracer="warp")
    assert not current(versions={"numpy": "0"})
    assert not is_current(tmp_path / "none", **now)  # type: ignore[arg-type]
    next(tmp_path.glob("field_ao-*.npy")).unlink()
    assert not current()


def test_settings_survive_exactly(tmp_path: Path, result: BakeResult) -> None:
    """Settings come back equal, or a bake would never look unchanged."""
    settings = BakeSettings.from_options(
        {"ground": "-z:12.3456789:0.1", "alpha": 1 / 3, "skip": "fog,trees", "max-distance": 77.7, "rays": 3}
    )
    save_result(dataclasses.replace(result, settings=settings), tmp_path)
    assert load_result(tmp_path).settings == settings
