from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from bake.errors import SceneError, SettingsError, StorageError
from bake.explain.cause_types import Remedy
from bake.explain.causes import name_causes
from bake.explain.explainer import Explainer
from bake.explain.patch import cut_out, rings_around
from bake.explain.preview import Previewer
from bake.explain.remedies import apply_remedy, plan_remedy, remedied, remedied_settings, undo
from bake.pipeline import BakeRequest, run_bake
from bake.scene import load_scene
from bake.types import BakeResult, Role, Scene
from tests.explain.dark_corner import SETTINGS, baked, dark_corner, planted_spots
from tests.scene.glb_files import one_quad

CURABLE = [spot for spot in planted_spots() if spot["remedy"]["kind"] != "none"]
TEXT = "# ask Kim\n[bake]\nalpha = 0.05  # softer\n\n[[object]]\nmatch = 'quad'\noffset = 0.01\n"


@pytest.fixture(scope="module")
def scene() -> Scene:
    """The dark corner."""
    return dark_corner()


@pytest.fixture(scope="module")
def explainer(scene: Scene) -> Iterator[Explainer]:
    """Of its bake."""
    with Explainer(baked(scene)) as made:
        yield made


@pytest.mark.parametrize(
    "spot",
    [
        pytest.param(spot, id=spot["label"], marks=() if spot["label"][0] in "1478" else pytest.mark.slow)
        for spot in CURABLE
    ],
)
def test_the_preview_equals_the_rebake(explainer: Explainer, scene: Scene, spot: dict) -> None:
    """The first remedy's preview is the value that a whole bake of the changed scene gives, there and around."""
    result = explainer.result
    explanation = explainer.explain_point(np.array(spot["position"]) - result.world.origin)
    remedy = name_causes(explainer, explanation)[0].remedies[0]
    preview = Previewer(explainer, scene).preview(explanation.spot, remedy)
    again = baked(remedied(scene, remedy), remedied_settings(SETTINGS, remedy))
    now = explanation.spot.weights @ again.field.ao[explanation.spot.vertices]
    np.testing.assert_allclose(preview.after, now, atol=1e-3)
    np.testing.assert_allclose(preview.ao, again.field.ao[preview.vertices], atol=5e-3)
    np.testing.assert_allclose(preview.before, explanation.value, atol=1e-6)
    assert preview.after[0] > preview.before[0] + 0.08
    assert preview.samples < 0.7 * len(again.samples)


def test_options_are_previewed_too(explainer: Explainer, scene: Scene) -> None:
    """A remedy that sets the distances gives the columns of the new ones."""
    remedy = Remedy("setting", "Bake with other distances.", options={"distances": [0.5, 2.0]})
    spot = explainer.explain_point(np.array(CURABLE[0]["position"]) - explainer.result.world.origin).spot
    preview = Previewer(explainer, scene).preview(spot, remedy)
    again = baked(scene, remedied_settings(SETTINGS, remedy))
    assert preview.distances == (0.5, 2.0)
    assert np.isnan(preview.before[0])
    np.testing.assert_allclose(preview.after, spot.weights @ again.field.ao[spot.vertices], atol=1e-3)


def test_an_object_that_no_longer_receives_has_no_value(explainer: Explainer, scene: Scene) -> None:
    """Its value after the remedy is NaN."""
    spot = explainer.explain_point(np.array(CURABLE[0]["position"]) - explainer.result.world.origin).spot
    path = explainer.result.world.object_paths[spot.object]
    preview = Previewer(explainer, scene).preview(spot, Remedy("role", "", {path: {"role": "ignore"}}))
    assert np.isnan(preview.after).all()


def test_what_cannot_be_written_is_not_previewed(explainer: Explainer, scene: Scene, tmp_path: Path) -> None:
    """Advice for the model is refused in one line."""
    advice = Remedy("model", "Cut the faces.")
    spot = explainer.explain_point(np.zeros(3)).spot
    with pytest.raises(SceneError, match="cannot be previewed"):
        Previewer(explainer, scene).preview(spot, advice)
    with pytest.raises(SceneError, match="no side file"):
        apply_remedy(tmp_path / "level.glb", advice)
    with pytest.raises(SceneError, match="no such object"):
        remedied(scene, Remedy("role", "", {"Nowhere": {"role": "ignore"}}))
    with pytest.raises(SceneError, match="unknown key"):
        remedied(scene, Remedy("role", "", {scene.objects[0].path: {"rolle": "ignore"}}))
    with pytest.raises(SettingsError, match="distances"):
        remedied_settings(SETTINGS, Remedy("setting", "", options={"distances": [-1.0]}))


def bake_file(scene: Path, folder: Path) -> BakeResult:
    """A bake of a scene file."""
    work = run_bake(BakeRequest(scene, folder, {"rays": 8, "device": "cpu"}))
    while True:
        try:
            next(work)
        except StopIteration as done:
            return done.value.result


def test_apply_and_undo(tmp_path: Path) -> None:
    """The side file says the remedy and keeps every other line; undo puts the former bytes back."""
    scene_path = one_quad().write(tmp_path)
    side_file = tmp_path / "level.obscura.toml"
    side_file.write_text(TEXT)
    remedy = Remedy("offset", "", {"quad": {"offset": 0.0, "weld": True}}, {"alpha": 0.2})
    planned = plan_remedy(scene_path, remedy)
    assert side_file.read_text() == TEXT
    edit = apply_remedy(scene_path, remedy)
    assert edit == planned
    keys = load_scene(scene_path).objects[0].keys
    assert (keys.offset, keys.weld) == (0.0, True)
    assert "# ask Kim" in side_file.read_text()
    assert "# softer" in side_file.read_text()
    undo(edit)
    assert side_file.read_text() == TEXT
    with pytest.raises(StorageError, match="changed"):
        undo(edit)


def test_applied_to_the_file_it_is_what_was_previewed(tmp_path: Path) -> None:
    """The scene is read for the preview, and the bake of the changed files gives the same value."""
    scene_path = one_quad().write(tmp_path)
    result = bake_file(scene_path, tmp_path / "result")
    remedy = Remedy("role", "", {result.world.object_paths[0]: {"samples": 20, "alpha": 0.5}})
    with Explainer(result) as explainer:
        spot = explainer.explain_vertex(0).spot
        preview = Previewer(explainer).preview(spot, remedy)
        edit = apply_remedy(scene_path, remedy)
        again = bake_file(scene_path, tmp_path / "again")
        np.testing.assert_allclose(preview.after, again.field.ao[spot.vertices[0]], atol=1e-3)
        assert again.world.object_keys[0].samples == 20
        with pytest.raises(SceneError, match="has changed"):
            Previewer(explainer).preview(spot, remedy)
        undo(edit)
        assert not (tmp_path / "level.glb.obscura.toml").exists()
        Previewer(explainer).preview(spot, remedy)


def test_remedies_change_only_what_they_say(scene: Scene) -> None:
    """Other keys and other objects stay."""
    path = scene.objects[3].path
    first = remedied(scene, Remedy("offset", "", {path: {"offset": 0.5}}))
    both = remedied(first, Remedy("role", "", {path: {"role": "blocker"}}))
    assert both.objects[3].keys.offset == 0.5
    assert both.objects[3].role is Role.BLOCKER
    assert both.objects[:3] == scene.objects[:3]


def test_remedies_are_plain_json() -> None:
    """What `explain --json` prints can be printed."""
    remedy = Remedy("weld", "Weld.", {"a": {"weld": True}, "b": {"weld": True}}, {"distances": [1.0]})
    assert json.loads(json.dumps(remedy.to_json()))["objects"]["b"] == {"weld": True}


def test_a_cut_keeps_seeds_and_places(explainer: Explainer) -> None:
    """The samples of a part are those of the whole, on the same triangles, with the same scrambles."""
    result = explainer.result
    faces = rings_around(result.world, np.array([100]), 3) > 0
    part, own, rows, vertices = cut_out(result.world, result.samples, faces)
    np.testing.assert_array_equal(
        part.positions[part.faces[own.face]], result.world.positions[result.world.faces[result.samples.face[rows]]]
    )
    np.testing.assert_array_equal(own.face_seed[own.face], result.samples.face_seed[result.samples.face[rows]])
    np.testing.assert_array_equal(part.positions, result.world.positions[vertices])
    assert part.object_paths == result.world.object_paths
    assert part.first_face[-1] == len(part.faces)
