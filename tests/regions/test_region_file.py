"""Region files: what is read is what was written, and whatever is wrong is one line that names it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from block_levels import TWO_ROOMS, WALLED_OFF, block_scene, regions_of
from hypothesis import given, settings
from hypothesis import strategies as st

from bake.errors import InputError, SceneError, StorageError
from bake.region_types import GRID, RegionGraph
from bake.regions.graph import regions_asked_for
from bake.regions.region_document import bits_from_hex, bits_to_hex
from bake.regions.region_file import read_region_file, write_region_file
from bake.settings import BakeSettings
from bake.types import RegionBox

SAMPLE = Path(__file__).resolve().parents[2] / "assets/sample_level/regions.json"
BOX = {"name": "hall", "min": [0, 0, 0], "max": [4, 3, 5]}
LEFT = {"name": "left", "min": [-5.1, 0, -2], "max": [-0.1, 3, 2]}
RIGHT = {"name": "right", "min": [0.1, 0, -2], "max": [5.1, 3, 2]}


def written(folder: Path, document: Any) -> Path:
    """A region file with that content."""
    path = folder / "regions.json"
    path.write_text(document if isinstance(document, str) else json.dumps(document))
    return path


def test_the_sample_levels_own_file() -> None:
    """The file that comes with the sample level is read: 16 boxes, 20 links without measures."""
    read = read_region_file(SAMPLE)
    assert len(read.regions) == 16
    assert read.links is not None
    assert {(link.a, link.b, link.area, link.centre) for link in read.links} >= {("RoomA", "RoomB", None, None)}
    assert read.regions[2].name == "RoomC"
    assert read.regions[2].minimum == (-0.9, 0.2, -5.7)


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 6), with_bits=st.booleans())
def test_round_trip(tmp_path_factory: pytest.TempPathFactory, seed: int, count: int, with_bits: bool) -> None:
    """Writing and reading gives the same regions, seeds, links and bits, far from the origin too."""
    random = np.random.default_rng(seed)
    origin = random.uniform(-1e6, 1e6, 3)
    low = random.uniform(-50, 50, (count, 3))
    high = low + random.uniform(0.5, 20, (count, 3))
    pairs = np.array([(a, b) for a in range(count) for b in range(a + 1, count)], np.int32).reshape(-1, 2)
    area, centre = random.uniform(0.1, 9, len(pairs)), random.uniform(-50, 50, (len(pairs), 3))
    names = tuple(f"räum {i}" for i in range(count))
    graph = RegionGraph(names, low, high, 0.5 * (low + high), pairs, area, centre, "file")
    valid = random.random(count * GRID**3) < 0.5 if with_bits else None
    path = tmp_path_factory.mktemp("file") / "regions.json"
    write_region_file(path, graph, origin=origin, valid=valid)
    read = read_region_file(path)
    assert tuple(region.name for region in read.regions) == names
    np.testing.assert_allclose([region.minimum for region in read.regions], low + origin, rtol=1e-15)
    np.testing.assert_allclose([region.maximum for region in read.regions], high + origin, rtol=1e-15)
    np.testing.assert_allclose([region.seed for region in read.regions], graph.seed + origin, rtol=1e-15)
    assert read.links is not None
    assert [(link.a, link.b) for link in read.links] == [(names[a], names[b]) for a, b in pairs]
    np.testing.assert_allclose([link.area for link in read.links], area)
    if valid is None:
        assert all(region.valid is None for region in read.regions)
    else:
        np.testing.assert_array_equal(np.concatenate([region.valid for region in read.regions]), valid)


def test_bits_are_in_the_order_of_the_points() -> None:
    """The first point's bit is the first binary digit."""
    bits = np.zeros(GRID**3, bool)
    bits[0] = bits[9] = True
    assert bits_to_hex(bits) == "8040" + "0" * 124
    np.testing.assert_array_equal(bits_from_hex(bits_to_hex(bits)), bits)


@pytest.mark.parametrize(
    ("document", "told"),
    [
        ("{", "no JSON"),
        ("[" * 100_000, "no JSON"),
        ("[]", "no JSON object"),
        ("{}", "neither regions nor seeds"),
        ({"regions": 3}, "regions is no list"),
        ({"regions": [], "rooms": []}, "unknown key 'rooms'"),
        ({"regions": [7]}, "regions[0]: it is no object"),
        ({"regions": [{**BOX, "colour": 1}]}, "unknown key 'colour'"),
        ({"regions": [{**BOX, "name": ""}]}, "it has no name"),
        ({"regions": [BOX, BOX]}, "regions[1] (hall): a second region has this name"),
        ({"regions": [{**BOX, "min": [0, 3, 0]}]}, "(hall): min is not below max"),
        ({"regions": [{**BOX, "min": [0, 9, 0]}]}, "min is not below max"),
        ({"regions": [{**BOX, "max": [4, 3]}]}, "max is [4, 3]"),
        ({"regions": [{**BOX, "max": None}]}, "max is missing"),
        ('{"regions": [{"name": "hall", "min": [0, 0, NaN], "max": [4, 3, 5]}]}', "min is [0, 0, nan]"),
        ('{"regions": [{"name": "hall", "min": [0, 0, 0], "max": [1e999, 3, 5]}]}', "max is [inf, 3, 5]"),
        ({"regions": [{**BOX, "max": [10**400, 3, 5]}]}, "max is [1000"),
        ({"regions": [{**BOX, "max": [1e12, 3, 5]}]}, "beyond 1e+09 m"),
        ({"regions": [{**BOX, "max": [True, 3, 5]}]}, "max is [True, 3, 5]"),
        ({"regions": [{**BOX, "seed": [9, 0, 0]}]}, "its seed lies outside its box"),
        ({"regions": [{**BOX, "valid": "ff"}]}, "valid is not 128 hexadecimal digits"),
        ({"regions": [{**BOX, "valid": "g" * 128}]}, "valid is not 128 hexadecimal digits"),
        ({"regions": [BOX], "links": [{"a": "hall", "b": "attic"}]}, "b is 'attic', which is no region"),
        ({"regions": [BOX], "links": [{"a": "hall", "b": "hall"}]}, "links a region with itself"),
        (
            {"regions": [LEFT, RIGHT], "links": [{"a": "left", "b": "right"}, {"a": "right", "b": "left"}]},
            "same regions",
        ),
        ({"regions": [LEFT, RIGHT], "links": [{"a": "left", "b": "right", "area": -1}]}, "area is -1"),
        ({"regions": [LEFT, RIGHT], "links": [{"a": "left", "b": "right", "centre": 0}]}, "centre is 0"),
        ({"regions": [BOX], "seeds": [[0, 0, 0]]}, "both regions and seeds"),
    ],
)
def test_refusals(tmp_path: Path, document: Any, told: str) -> None:
    """Whatever is wrong is refused in one line with the file's name."""
    path = written(tmp_path, document)
    with pytest.raises(SceneError) as refused:
        read_region_file(path)
    line = str(refused.value)
    assert told in line
    assert str(path) in line
    assert "\n" not in line


def test_missing_and_binary_files(tmp_path: Path) -> None:
    """A missing file, a folder, and bytes that are no text are refused."""
    for path in (tmp_path / "absent.json", tmp_path):
        with pytest.raises(SceneError, match="region file"):
            read_region_file(path)
    (tmp_path / "bytes.json").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SceneError, match="UTF-8"):
        read_region_file(tmp_path / "bytes.json")


def test_no_place_to_write(tmp_path: Path) -> None:
    """A folder that is not there is told of, and nothing is left behind."""
    graph = RegionGraph((), *(np.zeros((0, 3)),) * 3, np.zeros((0, 2), np.int32), np.zeros(0), np.zeros((0, 3)), "file")
    with pytest.raises(StorageError, match="cannot be written"):
        write_region_file(tmp_path / "absent" / "regions.json", graph, origin=np.zeros(3))


@settings(max_examples=150, deadline=None)
@given(
    document=st.recursive(
        st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
        lambda inner: (
            st.lists(inner, max_size=3)
            | st.dictionaries(
                st.sampled_from(["regions", "links", "seeds", "name", "min", "max", "a"]), inner, max_size=4
            )
        ),
        max_leaves=12,
    )
)
def test_any_json_is_read_or_refused(tmp_path_factory: pytest.TempPathFactory, document: Any) -> None:
    """No document makes the reader fail in any other way."""
    path = written(tmp_path_factory.mktemp("any"), document)
    try:
        read_region_file(path)
    except InputError as refused:
        assert "\n" not in str(refused)


def test_a_file_beside_the_scene(tmp_path: Path) -> None:
    """A relative path is taken from the scene's folder; links are found where the file has none."""
    written(tmp_path, {"regions": [LEFT, RIGHT]})
    space, _ = regions_of(block_scene(TWO_ROOMS, folder=str(tmp_path)), regions="regions.json")
    assert space.graph.names == ("left", "right")
    assert space.graph.link.tolist() == [[0, 1]]
    assert space.graph.origin == "file"


def test_file_wins(tmp_path: Path) -> None:
    """Stated bits, seeds, areas and centres are taken as they are; an empty list of links means none."""
    bits = np.arange(GRID**3) % 3 == 0
    left = {**LEFT, "valid": bits_to_hex(bits), "seed": [-1.0, 1.0, 0.0]}
    link = {"a": "right", "b": "left", "area": 2.5, "centre": [0.0, 1.0, 0.5]}
    written(tmp_path, {"regions": [left, RIGHT], "links": [link]})
    space, world = regions_of(block_scene(TWO_ROOMS, folder=str(tmp_path)), regions="regions.json")
    np.testing.assert_array_equal(space.valid[: GRID**3], bits)
    assert space.valid[GRID**3 :].all()
    np.testing.assert_allclose(space.graph.seed[0] + world.origin, [-1.0, 1.0, 0.0])
    np.testing.assert_allclose(space.graph.link_area, [2.5])
    np.testing.assert_allclose(space.graph.link_centre[0] + world.origin, [0.0, 1.0, 0.5])
    written(tmp_path, {"regions": [LEFT, RIGHT], "links": []})
    space, _ = regions_of(block_scene(TWO_ROOMS, folder=str(tmp_path)), regions="regions.json")
    assert len(space.graph.link) == 0


def test_default_is_what_the_scene_says() -> None:
    """Without the option the side file's boxes hold; an explicit none overrules them."""
    boxes = (
        RegionBox("left", (-5.1, 0.0, -2.0), (-0.1, 3.0, 2.0)),
        RegionBox("right", (0.1, 0.0, -2.0), (5.1, 3.0, 2.0)),
    )
    space, _ = regions_of(block_scene(TWO_ROOMS, regions=boxes))
    assert space.graph.origin == "scene"
    assert space.graph.names == ("left", "right")
    assert regions_asked_for(block_scene(TWO_ROOMS, regions=boxes), BakeSettings(regions="none")) == ""
    assert regions_asked_for(block_scene(TWO_ROOMS), BakeSettings()) == ""


def test_regions_outside_the_scene(tmp_path: Path) -> None:
    """One far region is set aside with its links; where all are far, the bake is refused."""
    far = {"name": "far", "min": [500, 0, 0], "max": [501, 1, 1]}
    written(
        tmp_path, {"regions": [LEFT, far, RIGHT], "links": [{"a": "left", "b": "far"}, {"a": "left", "b": "right"}]}
    )
    scene = block_scene(TWO_ROOMS, folder=str(tmp_path))
    space, _ = regions_of(scene, regions="regions.json")
    assert space.graph.names == ("left", "right")
    assert space.graph.link.tolist() == [[0, 1]]
    assert [(item.what, item.severity) for item in space.findings] == [("region-outside-scene", "set-aside")]
    written(tmp_path, {"regions": [far]})
    with pytest.raises(SceneError, match="far outside the scene"):
        regions_of(scene, regions="regions.json")


def test_a_closed_link_is_told_of(tmp_path: Path) -> None:
    """A link through a wall without measures of its own is left out, and a finding says so."""
    written(tmp_path, {"regions": [LEFT, RIGHT], "links": [{"a": "left", "b": "right"}]})
    space, _ = regions_of(block_scene(WALLED_OFF, folder=str(tmp_path)), regions="regions.json")
    assert len(space.graph.link) == 0
    assert [item.what for item in space.findings] == ["closed-link"]


def test_too_thin_a_region(tmp_path: Path) -> None:
    """A region whose points could not be told apart is refused."""
    written(tmp_path, {"regions": [{**LEFT, "max": [-5.0999999, 3, 2]}]})
    with pytest.raises(SceneError, match=r"'left' is .* m thin"):
        regions_of(block_scene(TWO_ROOMS, folder=str(tmp_path)), regions="regions.json")


def test_a_million_metres_away(tmp_path: Path) -> None:
    """A level a million metres from the origin has the same valid points and the same link as at the origin."""
    near, here = regions_of(block_scene(TWO_ROOMS, regions=_boxes(0.0)))
    far, world = regions_of(block_scene(TWO_ROOMS, regions=_boxes(1e6), at=1e6))
    np.testing.assert_array_equal(far.valid, near.valid)
    np.testing.assert_allclose(far.graph.link_area, near.graph.link_area)
    np.testing.assert_allclose(
        far.graph.link_centre + world.origin, near.graph.link_centre + here.origin + 1e6, atol=1e-3
    )


def _boxes(at: float) -> tuple[RegionBox, ...]:
    return tuple(
        RegionBox(box["name"], *(tuple(value + at for value in box[key]) for key in ("min", "max")))
        for box in (LEFT, RIGHT)
    )


def test_seeds_ask_for_automatic_regions(tmp_path: Path) -> None:
    """A file with seeds alone gives automatic regions, only where the seeds lead."""
    written(tmp_path, {"seeds": [[-3, 1, 0]]})
    space, world = regions_of(block_scene(WALLED_OFF, folder=str(tmp_path)), regions="regions.json")
    assert space.graph.origin == "automatic"
    assert (space.graph.maximum[:, 0] + world.origin[0] < 0.3).all()
    both, _ = regions_of(block_scene(WALLED_OFF, folder=str(tmp_path)), regions="auto")
    assert len(both.graph) > len(space.graph)
