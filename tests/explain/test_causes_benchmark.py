from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bake.bench.bystanders import only_near
from bake.bench.cause_rounds import Site, bake_scene, make_round
from bake.bench.causes import judge_round, measure_causes
from bake.bench.defects_of_meshes import wrong_offset
from bake.bench.defects_of_placement import covered_slab, doubled_banner
from bake.bench.level_spots import level_round
from bake.bench.remedy_previews import mend_round, preview_table
from bake.explain.cause_names import CauseKind
from bake.settings import BakeSettings
from bake.types import Role
from tests.explain.dark_corner import dark_corner

SHARED = Path(__file__).resolve().parents[2] / "../shared/scenes"
SETTINGS = BakeSettings(rays=8, samples_per_face=(2, 4), device="cpu")


def test_previews_are_held_against_rebakes() -> None:
    """Each kind of remedy is previewed and baked once, and both agree to the last digits."""
    random = np.random.default_rng(3)
    scene = only_near(dark_corner(), np.array([[200.0, 0.0, 0.0]]), 1.0)
    places = np.array([[200.0 + 6.0 * number, 0.0, 0.0] for number in range(3)])
    injections = [wrong_offset(random), covered_slab(random), doubled_banner(random)]
    made = make_round(Site("far away", scene, 1.0, SETTINGS), injections, places, random)
    mended = list(mend_round(made, "far away"))
    assert {item.kind for item in mended} >= {"offset", "role = receiver", "two_sided = true"}
    assert len({item.kind for item in mended}) == len(mended)
    table = preview_table(mended, seeds={})
    assert table.passed
    assert table.rows[-1]["previews"] == len(mended)
    assert max(item.difference for item in mended) < 1e-5
    assert all(item.after > item.before + 0.05 for item in mended)
    assert not list(mend_round(made, "far away", {item.kind for item in mended}))


def test_bystanders_change_nothing_nearby() -> None:
    """What lies far from a place casts but is not baked; values near it stay, but for the scene's mean noise."""
    scene = dark_corner()
    whole = bake_scene(scene, SETTINGS)
    place = whole.world.positions[0] + whole.world.origin
    thinned = only_near(scene, place[None], 1.0)
    assert {item.role for item in thinned.objects} >= {Role.STATIC, Role.BLOCKER}
    part = bake_scene(thinned, SETTINGS)
    assert len(part.samples) < len(whole.samples)
    number = int(np.searchsorted(whole.world.first_vertex, 0, side="right")) - 1
    own = slice(int(whole.world.first_vertex[number]), int(whole.world.first_vertex[number + 1]))
    np.testing.assert_allclose(part.field.ao[own], whole.field.ao[own], atol=0.02)


def test_a_level_s_own_dark_spots_are_sound() -> None:
    """They are found at random, are as dark as their rays see, and few of them are called a defect."""
    made = level_round(Site("corner", dark_corner(), 1.0, SETTINGS), np.random.default_rng(4), 12)
    assert made is not None
    assert all(item.injection.cause is CauseKind.CREVICE for item in made.placed)
    outcomes = judge_round(made, "corner")
    assert outcomes
    assert sum(item.named.is_defect for item in outcomes) <= 0.25 * len(outcomes)


@pytest.mark.slow
@pytest.mark.shared
def test_causes_are_named_in_a_real_level() -> None:
    """The gates hold on a real level with some placements of every cause."""
    path = SHARED / "cube2_pandora/pandora.obj"
    if not path.is_file():
        pytest.skip("the real scenes are not there")
    tables = {table.name: table for table in measure_causes([path], {}, scales=[0.05], placements=8, seed=77)}
    assert tables["causes"].passed, tables["causes"].to_markdown()
    assert tables["previews"].passed, tables["previews"].to_markdown()
