from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from bake.bench.cause_rounds import Round, Site, make_round
from bake.bench.cause_tables import Outcome, confusion
from bake.bench.causes import judge_round
from bake.bench.injected_defects import MAKERS, make_injection
from bake.bench.injection import cured
from bake.bench.special_rounds import unit_round
from bake.explain.cause_names import CauseKind
from bake.settings import BakeSettings
from bake.types import Material, Mesh, Scene, SceneObject

SETTINGS = BakeSettings(rays=16, samples_per_face=(2, 6), device="cpu")


def plain() -> Scene:
    """A flat ground of 40 × 40 m."""
    line = np.linspace(-20.0, 20.0, 41)
    x, z = np.meshgrid(line, line)
    corner = np.arange(41 * 40).reshape(40, 41)[:, :-1].ravel()
    faces = [[corner, corner + 41, corner + 1], [corner + 1, corner + 41, corner + 42]]
    positions = np.stack([x, np.zeros_like(x), z], axis=-1).reshape(-1, 3)
    normals = np.tile(np.float32([0, 1, 0]), (len(positions), 1))
    triangles = np.concatenate([np.stack(half, axis=1) for half in faces]).astype(np.int32)
    mesh = Mesh("ground", positions, normals, triangles, np.zeros(len(triangles), np.int32))
    ground = SceneObject("Ground", 0, np.eye(4))
    return Scene(Path("plain.glb"), (mesh,), (Material("m"),), (ground,), up_axis=1)


def places(count: int) -> np.ndarray:
    """Places 5 m apart."""
    grid = np.array([[x, 0.0, z] for x in np.arange(-15.0, 16.0, 5.0) for z in np.arange(-15.0, 16.0, 5.0)])
    return grid[:count]


@pytest.fixture(scope="module")
def made() -> Round:
    """Every maker once or twice, on the plain."""
    random = np.random.default_rng(11)
    injections = [make(random) for makers in MAKERS.values() for make in makers]
    injections += [make_injection(kind, random) for kind in CauseKind]
    return make_round(Site("plain", plain(), 1.0, SETTINGS), injections, places(len(injections)), random)


@pytest.fixture(scope="module")
def outcomes(made: Round) -> list[Outcome]:
    """What is said of them."""
    return judge_round(made, "plain")


def test_injections_show_themselves(made: Round) -> None:
    """Most are as dark as they are meant to be, and every cause is among them."""
    shown = Counter(item.injection.cause for number, item in enumerate(made.placed) if made.manifest(number))
    assert shown.total() > 0.65 * len(made.placed)
    assert set(shown) == set(CauseKind)


def test_injected_causes_are_named(outcomes: list[Outcome]) -> None:
    """Nine of ten are named rightly, and no sound spot is called a defect."""
    wrong = [item for item in outcomes if item.named is not item.cause]
    assert len(wrong) <= 0.1 * len(outcomes), [(str(item.cause), item.variant, str(item.named)) for item in wrong]
    assert not [item for item in wrong if item.cause is CauseKind.CREVICE]


def test_a_wrong_unit_is_named() -> None:
    """The same level at a hundredth of its size is dark at the same distances, and that is what is said."""
    site = Site("plain", plain(), 1.0, SETTINGS)
    made = unit_round(site, places(3), np.random.default_rng(2), 3)
    assert made is not None
    named = [item.named for item in judge_round(made, "plain")]
    assert named
    assert set(named) == {CauseKind.UNIT}


def test_cures_change_only_what_they_name(made: Round) -> None:
    """Every cure is about objects that exist, and the sound scene differs in nothing else."""
    sound = cured(made.scene, made.placed)
    changed = {a.path for a, b in zip(made.scene.objects, sound.objects, strict=True) if a != b}
    wanted = {f"{item.folder}/{name}" for item in made.placed for name in item.injection.cure}
    assert changed == wanted


def test_the_matrix_counts_everything(outcomes: list[Outcome]) -> None:
    """One row a cause, all placements in it, and the gate in the last row."""
    table = confusion(outcomes, "causes", gated=True, seeds={})
    assert sum(row["placements"] for row in table.rows[:-1]) == len(outcomes) == table.rows[-1]["placements"]
    assert table.rows[-1]["passed"] is True
    assert "crevices called a defect %" in table.to_markdown()
