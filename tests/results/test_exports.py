"""Every export format gives the stored numbers back, and never paints what was not baked black."""

from __future__ import annotations

import dataclasses
import struct
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_results import build_result

from bake.errors import InputError, StorageError
from bake.results.export import EXPORT_SUFFIXES, export
from bake.results.export_obj import linear_to_srgb
from bake.results.exported_ao import column_of, object_means
from bake.types import BakeResult, Role


@st.composite
def small_results(draw: st.DrawFn) -> BakeResult:
    """Random worlds with one to five distances, NaN values and objects that received nothing."""
    count = draw(st.integers(1, 5))
    result = build_result(
        seed=draw(st.integers(0, 1000)),
        objects=draw(st.integers(0, 4)),
        vertices_per_object=draw(st.integers(3, 9)),
        distances=tuple(float(i + 1) for i in range(count)),
        scene_path=Path("/levels/yard.obj"),
    )
    ao, state = result.field.ao.copy(), result.field.state.copy()
    holes = draw(st.lists(st.integers(0, max(len(ao) - 1, 0)), max_size=4)) if len(ao) else []
    ao[holes], state[holes] = np.nan, 3
    return dataclasses.replace(result, field=dataclasses.replace(result.field, ao=ao, state=state))


def expected_ao(result: BakeResult) -> np.ndarray:
    """What every format must hold."""
    return np.nan_to_num(result.field.ao, nan=1.0)


def read_ply(path: Path) -> tuple[np.ndarray, np.ndarray, bytes]:
    """Vertices, faces and header of our PLY, by its own header."""
    content = path.read_bytes()
    header, _, body = content.partition(b"end_header\n")
    kinds = {"double": "<f8", "float": "<f4", "uchar": "u1", "int": "<i4"}
    counts: dict[str, int] = {}
    fields: dict[str, list[tuple[str, ...]]] = {}
    for line in header.decode().splitlines():
        words = line.split()
        if words[0] == "element":
            element = words[1]
            counts[element], fields[element] = int(words[2]), []
        elif words[:2] == ["property", "list"]:
            fields[element] += [("corners", "u1"), ("indices", kinds[words[3]], (3,))]  # type: ignore[list-item]
        elif words[0] == "property":
            fields[element].append((words[2], kinds[words[1]]))
    vertices = np.frombuffer(body, np.dtype(fields["vertex"]), counts["vertex"])
    faces = np.frombuffer(body, np.dtype(fields["face"]), counts["face"], vertices.nbytes)
    assert vertices.nbytes + faces.nbytes == len(body)
    return vertices, faces, header


@settings(max_examples=25, deadline=None)
@given(small_results())
def test_every_format_round_trips(result: BakeResult) -> None:
    """Positions, faces and AO of any small world survive in each format."""
    world, ao = result.world, expected_ao(result)
    positions = world.positions + world.origin
    last = ao.shape[1] - 1
    with tempfile.TemporaryDirectory() as folder:
        paths = {suffix: Path(folder) / f"yard{suffix}" for suffix in EXPORT_SUFFIXES}
        for path in paths.values():
            assert export(result, path) == ()
        with np.load(paths[".npz"], allow_pickle=False) as archive:
            np.testing.assert_array_equal(archive["positions"], positions)
            np.testing.assert_array_equal(archive["ao"], ao)
        vertices, faces, _ = read_ply(paths[".ply"])
        np.testing.assert_array_equal(np.column_stack([vertices[axis] for axis in "xyz"]), positions)
        np.testing.assert_array_equal(np.column_stack([vertices[f"ao_{i}"] for i in range(last + 1)]), ao)
        np.testing.assert_array_equal(vertices["ao"], ao[:, last])
        np.testing.assert_array_equal(faces["indices"], world.faces)
        np.testing.assert_array_equal(faces["object"], world.face_object)
        lines = paths[".obj"].read_text().splitlines()
        rows = np.array([line.split()[1:] for line in lines if line.startswith("v ")], float).reshape(-1, 6)
        np.testing.assert_allclose(rows[:, :3], positions, rtol=1e-8)
        np.testing.assert_allclose(rows[:, 3], linear_to_srgb(ao[:, last].astype(float)), atol=1e-6)
        corners = np.array([line.split()[1:] for line in lines if line.startswith("f ")], int).reshape(-1, 3)
        np.testing.assert_array_equal(corners - 1, world.faces)
        content = paths[".vao"].read_bytes()
        assert struct.unpack_from("<2Q", content) == (world.object_count, world.vertex_count)
        np.testing.assert_array_equal(np.frombuffer(content[-4 * len(ao) :] if len(ao) else b"", "<f4"), ao[:, last])


def test_npz_contract(tmp_path: Path, result: BakeResult) -> None:
    """Names, types and shapes are those that other tools rely on."""
    export(result, tmp_path / "yard.npz")
    world, samples = result.world, result.samples
    n, m, s, k = world.vertex_count, world.face_count, len(samples), 2
    with np.load(tmp_path / "yard.npz", allow_pickle=False) as archive:
        shapes = {name: (archive[name].dtype.str, archive[name].shape) for name in archive.files}
        assert shapes.pop("object_names")[1] == (3,)
        assert tuple(archive["object_names"]) == world.object_paths
        assert shapes == {
            "positions": ("<f8", (n, 3)),
            "faces": ("<i4", (m, 3)),
            "ao": ("<f4", (n, k)),
            "distances": ("<f8", (k,)),
            "vertex_state": ("|u1", (n,)),
            "object": ("<i4", (m,)),
            "samples_face": ("<i4", (s,)),
            "samples_bary": ("<f4", (s, 3)),
            "samples_ao": ("<f4", (s, k)),
            "samples_backface": ("<f4", (s,)),
        }
        np.testing.assert_allclose(archive["samples_bary"].sum(axis=1), 1.0)
        np.testing.assert_array_equal(archive["samples_backface"], result.tally.back_face_share())
        np.testing.assert_array_equal(archive["vertex_state"], result.field.state)


def test_npz_is_the_same_every_time(tmp_path: Path, result: BakeResult) -> None:
    """Two exports of one result are equal byte for byte."""
    for name in ("a.npz", "b.npz"):
        export(result, tmp_path / name)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_ply_in_trimesh(tmp_path: Path, result: BakeResult) -> None:
    """An independent reader finds the mesh."""
    import trimesh

    export(result, tmp_path / "yard.ply")
    mesh = trimesh.load_mesh(tmp_path / "yard.ply", process=False)
    np.testing.assert_allclose(mesh.vertices, result.world.positions + result.world.origin)
    np.testing.assert_array_equal(mesh.faces, result.world.faces)


def test_obj_in_trimesh(tmp_path: Path, result: BakeResult) -> None:
    """An independent reader finds grey vertex colours, sRGB-encoded."""
    import trimesh

    export(result, tmp_path / "yard.obj", distance=2.0)
    mesh = trimesh.load_mesh(tmp_path / "yard.obj", process=False, maintain_order=True, split_object=False)
    parts = list(mesh.geometry.values()) if isinstance(mesh, trimesh.Scene) else [mesh]
    colors = np.concatenate([part.visual.vertex_colors for part in parts])
    assert (colors[:, 0] == colors[:, 1]).all()
    expected = np.round(255 * linear_to_srgb(expected_ao(result)[:, 0].astype(float)))
    used = np.unique(result.world.faces)
    assert set(expected[used]) <= {float(value) + d for value in np.unique(colors[:, 0]) for d in (-1, 0, 1)}


def test_ply_names_objects_and_distances(tmp_path: Path, result: BakeResult) -> None:
    """The header says which column is which distance and which number is which object."""
    export(result, tmp_path / "yard.ply")
    header = read_ply(tmp_path / "yard.ply")[2].decode()
    assert "comment ao_1 distance 300.0 m" in header
    assert "comment object 2 Yard/Fässer/barrel#2" in header


def test_vao_layout(tmp_path: Path, result: BakeResult) -> None:
    """Byte for byte the layout of the sample's file, for the distance asked for."""
    export(result, tmp_path / "yard.vao", distance=2.0)
    expected = struct.pack("<2Q", 3, 15) + b"".join(struct.pack("<3Q", i, 5 * i, 5) for i in range(3))
    assert (tmp_path / "yard.vao").read_bytes() == expected + expected_ao(result)[:, 0].astype("<f4").tobytes()


def test_state_of_objects_that_receive_nothing(tmp_path: Path, result: BakeResult) -> None:
    """A blocker's vertices are exported open, with the state of a vertex without a value."""
    state = result.field.state.copy()
    state[:5] = 3
    ao = result.field.ao.copy()
    ao[:5] = np.nan
    world = dataclasses.replace(result.world, object_roles=(Role.BLOCKER, Role.STATIC, Role.STATIC))
    blocked = dataclasses.replace(result, world=world, field=dataclasses.replace(result.field, ao=ao, state=state))
    export(blocked, tmp_path / "yard.npz")
    with np.load(tmp_path / "yard.npz") as archive:
        assert set(archive["vertex_state"][:5]) == {2}
        assert (archive["ao"][:5] == 1).all()


def test_object_means(result: BakeResult) -> None:
    """A constant field has that mean on every object, and one without values has none."""
    ao = np.full_like(result.field.ao, 0.25)
    ao[:5] = np.nan
    means = object_means(dataclasses.replace(result, field=dataclasses.replace(result.field, ao=ao)))
    np.testing.assert_allclose(means[1:], 0.25)
    assert np.isnan(means[0]).all()


def test_the_chosen_distance(result: BakeResult) -> None:
    """The longest by default, and an unknown one names those there are."""
    assert column_of(result, None) == 1
    assert column_of(result, 2) == 0
    with pytest.raises(InputError, match="use one of 2, 300"):
        column_of(result, 5.0)


@pytest.mark.parametrize("name", ["yard.fbx", "yard", "yard.glb.bak"])
def test_an_unknown_suffix_is_refused(tmp_path: Path, result: BakeResult, name: str) -> None:
    """A format that is not written is refused with those that are."""
    with pytest.raises(InputError, match=r"\.npz \.ply \.glb \.obj \.vao"):
        export(result, tmp_path / name)


@pytest.mark.parametrize("suffix", EXPORT_SUFFIXES)
def test_a_failed_export_leaves_the_old_file(
    tmp_path: Path, result: BakeResult, suffix: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A disk that fills up, a missing folder and a folder in the way: one error, nothing changed."""
    result = dataclasses.replace(result, scene_path=Path("/levels/yard.obj"))
    path = tmp_path / f"yard{suffix}"
    path.write_bytes(b"old")
    (tmp_path / f"folder{suffix}").mkdir()
    with pytest.raises(StorageError, match="is a folder"):
        export(result, tmp_path / f"folder{suffix}")
    with pytest.raises(StorageError, match="does not exist"):
        export(result, tmp_path / "missing" / path.name)

    def full(_file: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("bake.results.storage.sync", full)
    with pytest.raises(StorageError, match="no space left"):
        export(result, path)
    assert path.read_bytes() == b"old"
    assert {item.name for item in tmp_path.iterdir()} == {path.name, f"folder{suffix}"}
