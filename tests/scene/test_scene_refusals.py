from __future__ import annotations

import json
import re
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from bake.errors import SceneError
from bake.scene import load_scene
from tests.scene.glb_files import QUAD, GltfFile, one_quad


def refusal(path: Path) -> str:
    """The message with which a file is refused; it must be one line that names the file's folder."""
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    message = str(caught.value)
    assert "\n" not in message
    assert path.name in message or path.parent.name in message
    assert caught.value.exit_code == 2
    return message


def test_missing_file(tmp_path: Path) -> None:
    """A file that is not there is named."""
    assert "missing" in refusal(tmp_path / "nowhere.glb")


def test_folder_instead_of_file(tmp_path: Path) -> None:
    """A folder is no scene."""
    (tmp_path / "folder.glb").mkdir()
    assert "cannot be read" in refusal(tmp_path / "folder.glb")


@pytest.mark.parametrize("name", ["level.fbx", "level", "level.usd", "level.USDZ"])
def test_other_formats(tmp_path: Path, name: str) -> None:
    """Other formats are refused with what to use instead."""
    (tmp_path / name).write_bytes(b"x")
    message = refusal(tmp_path / name)
    assert ("not supported yet" in message) == ("usd" in name.lower())


@pytest.mark.parametrize("size", [4, 11, 16, 30, 200, -4])
def test_truncated_glb(tmp_path: Path, size: int) -> None:
    """A GLB that ends early is called truncated, wherever it ends."""
    path = tmp_path / "level.glb"
    path.write_bytes(one_quad().glb()[:size])
    assert any(word in refusal(path) for word in ("truncated", "ends inside", "cut off"))


def edited(change: Callable[[dict], object]) -> GltfFile:
    """The quad with its document changed."""
    file = one_quad()
    change(file.document)
    return file


def overflowing(document: dict) -> None:
    """A chain of scalings beyond the range of floats."""
    document["nodes"][0]["scale"] = [1e300] * 3
    document["nodes"].append({"children": [0], "scale": [1e300] * 3})
    document["scenes"][0]["nodes"] = [1]


ACCESSOR, VIEW, PRIMITIVE, NODE = (
    lambda d: d["accessors"][0],
    lambda d: d["bufferViews"][0],
    lambda d: d["meshes"][0]["primitives"][0],
    lambda d: d["nodes"][0],
)
CASES: dict[str, tuple[Callable[[dict], object], str]] = {
    "draco": (lambda d: d.update(extensionsRequired=["KHR_draco_mesh_compression"]), "without Draco"),
    "meshopt": (lambda d: d.update(extensionsRequired=["EXT_meshopt_compression"]), "unpack it first"),
    "unknown extension": (lambda d: d.update(extensionsRequired=["ACME_voxels"]), "ACME_voxels"),
    "old version": (lambda d: d["asset"].update(version="1.0"), "glTF 1.0"),
    "scene of wrong type": (lambda d: d.update(scene="hello"), "scene is 'hello'"),
    "scene out of range": (lambda d: d.update(scene=7), r"scenes\[7\]"),
    "node out of range": (lambda d: d["scenes"][0].update(nodes=[9]), r"nodes\[9\]"),
    "negative node": (lambda d: d["scenes"][0].update(nodes=[-1]), "-1"),
    "nodes no list": (lambda d: d.update(nodes={"a": 1}), "nodes is"),
    "node no object": (lambda d: d.update(nodes=[5]), r"nodes\[0\] is 5"),
    "name no text": (lambda d: NODE(d).update(name=5), "name is 5"),
    "mesh out of range": (lambda d: NODE(d).update(mesh=3), "refers to"),
    "mesh no number": (lambda d: NODE(d).update(mesh=True), "mesh is True"),
    "matrix too short": (lambda d: NODE(d).update(matrix=[1] * 15), "16 numbers"),
    "matrix of texts": (lambda d: NODE(d).update(matrix=["1"] * 16), "not a number"),
    "projective matrix": (lambda d: NODE(d).update(matrix=[1] * 16), "affine"),
    "zero rotation": (lambda d: NODE(d).update(rotation=[0, 0, 0, 0]), "quaternion"),
    "overflowing transform": (overflowing, "overflows"),
    "no primitives": (lambda d: d["meshes"][0].pop("primitives"), "primitives"),
    "unknown mode": (lambda d: PRIMITIVE(d).update(mode=7), "mode is 7"),
    "material out of range": (lambda d: PRIMITIVE(d).update(material=0), r"materials\[0\]"),
    "indices out of range": (lambda d: PRIMITIVE(d).update(indices=9), r"accessors\[9\]"),
    "float indices": (lambda d: PRIMITIVE(d).update(indices=0), "SCALAR"),
    "positions of wrong type": (lambda d: ACCESSOR(d).update(type="VEC2"), "VEC3"),
    "unknown component": (lambda d: ACCESSOR(d).update(componentType=5124), "componentType is 5124"),
    "absurd count": (lambda d: ACCESSOR(d).update(count=10**15), "needs"),
    "fractional count": (lambda d: ACCESSOR(d).update(count=2.5), "count is 2.5"),
    "absurd implied zeros": (lambda d: (ACCESSOR(d).pop("bufferView"), ACCESSOR(d).update(count=10**12)), "below"),
    "accessor beyond its view": (lambda d: ACCESSOR(d).update(byteOffset=4), "needs"),
    "view beyond its buffer": (lambda d: VIEW(d).update(byteLength=10**6), "needs bytes"),
    "view of no buffer": (lambda d: VIEW(d).update(buffer=1), r"buffers\[1\]"),
    "overlapping stride": (lambda d: VIEW(d).update(byteStride=4), "every 4 bytes"),
    "normals of other count": (lambda d: d["accessors"][1].update(count=3), "3 elements for 4"),
    "empty scene": (lambda d: d["scenes"][0].update(nodes=[]), "no triangles"),
    "alpha mode": (lambda d: d.update(materials=[{"alphaMode": "SOLID"}]), "alphaMode"),
    "colour factor": (
        lambda d: d.update(materials=[{"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1]}}]),
        "baseColorFactor",
    ),
    "instances without count": (
        lambda d: NODE(d).update(extensions={"EXT_mesh_gpu_instancing": {"attributes": {}}}),
        "attributes",
    ),
    "huge number": (lambda d: NODE(d).update(translation=[10**400, 0, 0]), "finite"),
    "far away": (lambda d: NODE(d).update(translation=[1e12, 0, 0]), "1e.12 m from the origin"),
}


@pytest.mark.parametrize("case", CASES)
def test_malformed_documents(tmp_path: Path, case: str) -> None:
    """Each fault ends as one line that says what is wrong."""
    change, expected = CASES[case]
    assert re.search(expected, refusal(edited(change).write(tmp_path)))


@pytest.mark.parametrize(
    "text",
    [b"", b"{", b"[]", b"null", b"\xff\xfe", b'{"a": NaN}', b"[" * 100_000, b'{"a": ' + b"9" * 5000 + b"}"],
)
def test_malformed_json(tmp_path: Path, text: bytes) -> None:
    """Text that is no JSON object is refused, however deep or long."""
    path = tmp_path / "level.gltf"
    path.write_bytes(text)
    refusal(path)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_positions_must_be_finite(tmp_path: Path, value: float) -> None:
    """NaN and infinite positions are refused by object and vertex."""
    positions = QUAD.copy()
    positions[2, 1] = value
    file = GltfFile()
    file.node("broken", mesh=file.mesh(file.primitive(positions)))
    message = refusal(file.write(tmp_path))
    assert "broken" in message
    assert "vertex 2" in message


def test_index_out_of_range_names_the_object(tmp_path: Path) -> None:
    """A face that refers to a missing vertex is refused by object."""
    file = GltfFile()
    file.node("parent", children=[file.node("broken", root=False, mesh=file.mesh(file.primitive(QUAD, [0, 1, 4])))])
    assert "parent/broken: primitive 0 refers to vertex 4 of 4" in refusal(file.write(tmp_path))


@pytest.mark.parametrize("uri", ["missing.bin", "../outside.bin", "/etc/hosts", "http://example.org/a.bin", "C:/a", ""])
def test_buffers_that_cannot_be_had(tmp_path: Path, uri: str) -> None:
    """Missing buffers, and any outside the scene's folder, are refused."""
    (tmp_path / "outside.bin").write_bytes(bytes(one_quad().binary))
    (tmp_path / "level").mkdir()
    refusal(one_quad().write_json(tmp_path / "level", uri))


@pytest.mark.parametrize("uri", ["data:application/octet-stream;base64", "data:;base64,A", "data:,abc"])
def test_damaged_data_uris(tmp_path: Path, uri: str) -> None:
    """An embedded buffer that is malformed or short is refused."""
    refusal(one_quad().write_json(tmp_path, uri))


def test_short_external_buffer(tmp_path: Path) -> None:
    """A buffer file shorter than announced is called truncated."""
    file = one_quad()
    (tmp_path / "data.bin").write_bytes(bytes(file.binary[:-1]))
    path = file.write_json(tmp_path, "data.bin")
    document = json.loads(path.read_text())
    document["buffers"][0]["byteLength"] = len(file.binary)
    path.write_text(json.dumps(document))
    assert "truncated" in refusal(path)


def test_sparse_indices_out_of_range(tmp_path: Path) -> None:
    """A sparse accessor may only replace elements that exist."""
    file = one_quad()
    file.document["accessors"][0]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": file.view(np.array([4], "<u2").tobytes()), "componentType": 5123},
        "values": {"bufferView": file.view(np.zeros(3, "<f4").tobytes())},
    }
    assert "replaces element 4 of 4" in refusal(file.write(tmp_path))


def test_glb_without_json(tmp_path: Path) -> None:
    """A GLB needs a JSON chunk."""
    path = tmp_path / "level.glb"
    path.write_bytes(struct.pack("<4sIIII", b"glTF", 2, 20, 0, 0x004E4942))
    assert "no JSON chunk" in refusal(path)


def test_glb_version_one(tmp_path: Path) -> None:
    """The older GLB container is refused by its version."""
    path = tmp_path / "level.glb"
    path.write_bytes(struct.pack("<4sII", b"glTF", 1, 12))
    assert "version 1" in refusal(path)
