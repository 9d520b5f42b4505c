from __future__ import annotations

import functools
from pathlib import Path

import numpy as np
import pytest

from bake.errors import SceneError
from bake.scene import flatten, load_scene
from bake.settings import BakeSettings
from bake.types import Scene, World

SCENES = (Path(__file__).resolve().parents[2] / "../shared/scenes").resolve()
SUFFIXES = {".gltf", ".glb", ".obj", ".ply"}
MALFORMED = sorted(path for path in (SCENES / "assimp_malformed").rglob("*") if path.suffix in SUFFIXES)

pytestmark = [pytest.mark.shared, pytest.mark.skipif(not SCENES.exists(), reason="the real scenes are not here")]

# File, objects, triangles after instancing.
LEVELS = [
    ("stk_candela_city/stk_candela_city.glb", 830, 444_914),
    ("stk_mines/stk_mines.glb", 102, 88_349),
    ("cube2_pandora/pandora.obj", 206, 60_810),
    ("cube2_zdm2/zdm2.obj", 84, 70_754),
    ("cube2_zdm2/zdm2_godot.glb", 1, 58_772),
    ("dream_apartment/dream_apartment.glb", 1, 177_934),
    ("japanese_bridge_garden/japanese_bridge_garden.glb", 1, 21_883),
    ("vino_bike/vino_bike.glb", 1, 95_598),
    ("godot_living_room/living_room.glb", 2, 5_088),
    ("stk_black_forest/stk_black_forest.glb", 1711, 1_086_350),
]


@functools.lru_cache(maxsize=1)
def loaded(name: str) -> tuple[Scene, World]:
    """A level and its world; the last one is kept, since the largest takes seconds."""
    scene = load_scene(SCENES / name)
    return scene, flatten(scene, BakeSettings())


def check_world(world: World) -> None:
    """What must hold of every world, whatever it was read from."""
    assert np.isfinite(world.positions).all()
    assert np.isfinite(world.normals).all()
    assert world.faces.min() >= 0
    assert world.faces.max() < world.vertex_count
    assert len(set(world.object_paths)) == world.object_count
    assert world.first_face[-1] == world.face_count
    lengths = np.linalg.norm(world.normals, axis=1)
    assert (np.isclose(lengths, 1.0, atol=1e-4) | (lengths == 0.0)).all()
    assert ((world.face_openness >= 0.0) & (world.face_openness <= 1.0)).all()


@pytest.mark.parametrize(("name", "objects", "triangles"), LEVELS)
def test_levels(name: str, objects: int, triangles: int) -> None:
    """Each level loads with the expected number of objects and triangles, about its own centre."""
    scene, world = loaded(name)
    check_world(world)
    assert (world.object_count, world.face_count) == (objects, triangles)
    paths = set(world.object_paths) | {scene.path.name}
    assert {finding.object for finding in scene.findings} <= paths


def test_leaf_cards_let_light_through() -> None:
    """In the forest, pines are mostly open, each face by its own part of the texture."""
    _, world = loaded("stk_black_forest/stk_black_forest.glb")
    pines = np.array(["pine" in path.lower() for path in world.object_paths])[world.face_object]
    cards = world.face_openness[pines & (world.face_openness > 0)]
    assert len(cards) > 100_000
    assert 0.3 < cards.mean() < 0.9
    assert cards.std() > 0.05


def test_compressed_file_is_refused_with_advice() -> None:
    """The apartment as first published needs unpacking."""
    with pytest.raises(SceneError, match="EXT_meshopt_compression; unpack it"):
        load_scene(SCENES / "dream_apartment/dream_apartment_meshopt_original.glb")


@pytest.mark.parametrize("name", ["mcusd/McUsd.usda", "openchess_usd/chess_set.usda"])
def test_usd_is_not_read_yet(name: str) -> None:
    """USD is refused with a way out."""
    with pytest.raises(SceneError, match="not supported yet"):
        load_scene(SCENES / name)


@pytest.mark.parametrize("path", MALFORMED, ids=lambda path: str(path.relative_to(SCENES / "assimp_malformed")))
def test_malformed_files_load_or_are_refused(path: Path) -> None:
    """Every file that broke another loader is read, or refused in one line that names it."""
    try:
        check_world(flatten(load_scene(path), BakeSettings()))
    except SceneError as refusal:
        assert "\n" not in str(refusal)
        assert str(path.parent) in str(refusal)
