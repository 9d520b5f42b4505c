"""The benchmark of speed: that its scenes have the size they say, and its tables what was measured."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.commands.speed_plot import plot_speed
from app.commands.speed_tables import TABLES, speed_tables
from bake.bench import overhead, ray_order, scaling, scaling_card, scaling_device, tail_clip, trace_runs
from bake.bench.scaling_glb import Placed, write_scene
from bake.bench.scaling_parity import measure_parity
from bake.bench.scaling_scenes import write_field, write_instances
from bake.bench.synthetic import cube, field_with_props
from bake.devices import Device
from bake.errors import InputError
from bake.pipeline import settings_for
from bake.scene import flatten, load_scene
from bake.settings import BakeSettings
from bake.types import Role

CPU = Device("cpu", "CPU")
ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("triangles", [10_000, 31_623, 100_000])
def test_fields_have_the_wanted_size(tmp_path: Path, triangles: int) -> None:
    """Within three percent."""
    scene = load_scene(write_field(tmp_path / "field.glb", triangles))
    assert sum(len(mesh.faces) for mesh in scene.meshes) == pytest.approx(triangles, rel=0.03)


def test_copies_share_one_mesh(tmp_path: Path) -> None:
    """Every ball is an object, and all have the same mesh, which is stored once."""
    scene = load_scene(write_instances(tmp_path / "copies.glb", 30))
    assert len(scene.objects) == 31
    assert len({item.mesh for item in scene.objects[1:]}) == 1
    assert len(scene.meshes) == 2


def test_a_written_scene_reads_as_it_was_meant(tmp_path: Path) -> None:
    """Places are turned from z up to y up, a turn about z becomes one about y, and roles and keys arrive."""
    placed = [
        Placed("plain", "cube", (1.0, 2.0, 3.0), np.pi / 2.0),
        Placed("lod/plain", "cube", declared={"role": "lod", "of": "plain", "samples": 7}),
    ]
    scene = load_scene(write_scene(tmp_path / "scene.glb", {"cube": cube()}, placed))
    plain, lod = scene.objects
    np.testing.assert_allclose(plain.transform[:3, 3], [1.0, 3.0, -2.0], atol=1e-6)
    np.testing.assert_allclose(plain.transform[:3, :3] @ [1.0, 0.0, 0.0], [0.0, 0.0, -1.0], atol=1e-6)
    assert (lod.role, lod.keys.of, lod.keys.samples) == (Role.LOD, "plain", 7)


def test_exponents_are_those_of_the_power_law() -> None:
    """Seconds that grow as n^1.5 and n^0.9 give 1.5, which fails, and 0.9; what is too quick to time is left out."""
    rows = [
        {"triangles": n, "trace s": 1e-4 * n**0.9, "solve s": 1e-5 * n**1.5, "load s": 1e-9 * n}
        for n in (10**4, 10**5, 10**6)
    ]
    found = {row["stage"]: row for row in scaling.exponent_rows(rows, "triangles", 1.2)}
    assert set(found) == {"trace", "solve"}
    assert found["trace"]["exponent"] == pytest.approx(0.9)
    assert found["solve"]["last step"] == pytest.approx(1.5)
    assert (found["trace"]["passed"], found["solve"]["passed"]) == (True, False)


def test_scales_end_at_the_largest() -> None:
    """Half powers of ten, and the size that was asked for last."""
    assert scaling.scales(1_000_000) == (10_000, 31_623, 100_000, 316_228, 1_000_000)
    assert scaling.scales(10_000) == (10_000,)
    assert scaling.scales(50_000)[-2:] == (31_623, 50_000)


def test_a_bake_is_told_by_stage(tmp_path: Path) -> None:
    """Counts are the scene's, every stage has a time, and none takes longer than the whole."""
    scene = write_instances(tmp_path / "copies.glb", 5)
    row = scaling.bake_by_stage(scene, {"rays": 2, "samples-per-face": "1:1", "device": "cpu"})
    assert (row["triangles"], row["objects"], row["samples"]) == (768, 6, 768)
    assert row["Mrays"] == pytest.approx(2 * 768e-6)
    assert all(0.0 <= row[stage] <= row[scaling.TOTAL] for stage in (*scaling.STAGES, scaling.STORE))
    assert row[scaling.STORE] > 0.0


def test_the_plot_is_drawn(tmp_path: Path) -> None:
    """A picture under 150 kB; nothing of a single size."""
    row = {**dict.fromkeys((*scaling.STAGES, scaling.STORE, scaling.TOTAL), 0.5), "tracer": "embree", "Mrays": 1.0}
    rows = [{**row, "triangles": n, "samples": 4 * n} for n in (10**4, 10**5)]
    plot_speed(tmp_path / "speed.png", rows)
    assert 0 < (tmp_path / "speed.png").stat().st_size < 150_000
    plot_speed(tmp_path / "one.png", rows[:1])
    assert not (tmp_path / "one.png").exists()


def test_every_choice_of_bvh_traces(tmp_path: Path) -> None:
    """Constructors and leaves each give a row, one of them the fastest; limits are positive (all on the CPU)."""
    settings = settings_for(tmp_path / "field.glb", {"rays": 2, "tracer": "warp", "device": "cpu"})
    world = flatten(
        load_scene(write_scene(tmp_path / "field.glb", {"f": field_with_props(8, 2)}, [Placed("f", "f")])), settings
    )
    rows = scaling_card.measure_choices(world, settings, CPU, samples=300)
    assert {(row["constructor"], row["leaf"]) for row in rows} == {
        (constructor, leaf) for constructor in ("sah", "median") for leaf in scaling_card.LEAVES
    }
    assert sum("fastest" in row for row in rows) == 1
    limits = scaling_card.measure_limits(CPU, copied=1 << 16, threads=8)
    assert all(value > 0.0 for value in limits.values())


def test_without_cuda_the_card_says_why() -> None:
    """One row with the reason, which is no failure."""
    measured = scaling_card.measure_card({"device": "cpu"})
    assert "no CUDA device" in measured.rows[0]["skipped"]
    assert measured.passed


def test_overhead_divides_by_the_bare_tracer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The ratio is of the two rates in its row; Warp's bare query traces the same rays; without Embree it says so."""
    pytest.importorskip("embreex", reason="Embree is not installed")
    monkeypatch.setattr(overhead, "_FIELDS", {"field": 8})
    monkeypatch.setattr(overhead, "_CHUNKS", 2)
    monkeypatch.setattr(overhead, "_CHUNK_RAYS", 512)
    options = {"rays": 2, "samples-per-face": "1:1", "device": "cpu"}
    (row,) = overhead.measure_overhead([], options).rows
    assert row["ratio"] == pytest.approx(row["Mrays/s end to end"] / row["Mrays/s bare tracer"])
    scene = write_instances(tmp_path / "copies.glb", 3)
    result = scaling_device.run_to_end(scene, tmp_path / "result", options).result
    assert overhead.bare_rays_per_s_warp(result, CPU) > 0.0
    monkeypatch.setattr(overhead, "has_embree", lambda: False)
    assert "Embree" in overhead.measure_overhead([], options).rows[0]["skipped"]


def test_parity_holds_on_the_cpu() -> None:
    """Both kernels, by the tracer that the benchmark would time."""
    measured = measure_parity({"device": "cpu"})
    assert [row["kernel"] for row in measured.rows] == ["obscurance", "occlusion"]
    assert measured.passed


def test_tables_and_sizes_are_checked_first(tmp_path: Path) -> None:
    """A table or a size that there is not is refused in a line before anything is measured."""
    with pytest.raises(InputError, match="no table 'sped'"):
        speed_tables([], {}, tables="sped", largest=10_000, plots=None)
    with pytest.raises(InputError, match="--largest"):
        speed_tables([], {}, tables="scale", largest=10, plots=None)
    assert "card" in TABLES


def test_measurements_hold_machine_versions_and_seeds() -> None:
    """What a JSON line must hold to be repeated."""
    (measured,) = speed_tables([], {"device": "cpu"}, tables="card", largest=10_000, plots=None)
    assert {"bench", "machine", "versions", "seeds", "rows"} <= set(measured.to_json())


@pytest.mark.parametrize("tracer", ["auto", "embree"])
def test_without_embree_warp_traces(tracer: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where Embree is missing the benchmark takes Warp, unless it was told what to take."""
    monkeypatch.setattr(scaling_device, "has_embree", lambda: False)
    options, device = scaling_device.runnable({"device": "cpu", "tracer": tracer})
    assert options["tracer"] == ("warp" if tracer == "auto" else "embree")
    assert device.alias == "cpu"
    assert BakeSettings.from_options(options).tracer.value == options["tracer"]


_ONLY_THREE = """
import importlib.abc, json, sys
class Missing(importlib.abc.MetaPathFinder):
    names = {"PyQt6", "pyvista", "pyvistaqt", "vtkmodules", "embreex", "matplotlib", "PIL", "trimesh"}
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in self.names:
            raise ModuleNotFoundError(name, name=name)
sys.meta_path.insert(0, Missing())
from app.cli import main
sys.exit(main(sys.argv[1:]))
"""


def test_it_runs_with_numpy_scipy_and_warp_alone() -> None:
    """On a machine with nothing else the command imports and prints its table."""
    words = ["bench", "speed", "--tables", "card", "--device", "cpu", "--json"]
    done = subprocess.run([sys.executable, "-c", _ONLY_THREE, *words], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    told: dict[str, Any] = json.loads(done.stdout)
    assert told["bench"] == "card"


def test_every_order_finds_the_same_bits(tmp_path: Path) -> None:
    """A row for each order and grouping, and the bare tracer's; the Morton order is a permutation."""
    pytest.importorskip("embreex", reason="Embree is not installed")
    settings = settings_for(tmp_path / "copies.glb", {"rays": 8, "device": "cpu", "samples-per-face": "1:1"})
    subject = trace_runs.Subject.of(write_instances(tmp_path / "copies.glb", 5), settings, runs=3, length=70)
    assert [run.stop - run.start for run in subject.runs] == [70, 70, 70]
    assert sorted(ray_order.morton_order(subject, settings).tolist()) == list(range(210))
    rows = ray_order.order_rows(subject, settings)
    assert len(rows) == 10
    assert all(row["passed"] for row in rows[:-1])
    assert rows[0]["ratio"] == 1.0


def test_tails_change_no_more_than_they_say(tmp_path: Path) -> None:
    """A longer tail means longer rays and less change, always under the bound; a mean is below the greatest."""
    settings = settings_for(tmp_path / "copies.glb", {"rays": 16, "device": "cpu", "tracer": "warp"})
    subject = trace_runs.Subject.of(write_instances(tmp_path / "copies.glb", 40), settings, runs=2, length=150)
    rows = tail_clip.tail_rows(subject, settings)
    assert [row["rays end at m"] for row in rows[:4]] == [16.0, 18.0, 20.0, 24.0]
    assert all(row["passed"] and row["mean change"] <= row["greatest change"] for row in rows)
    assert rows[0]["greatest change"] >= rows[3]["greatest change"]
