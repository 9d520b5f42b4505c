"""Small glTF files written by hand, so that every feature and every fault can be tested alone."""

from __future__ import annotations

import io
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}

TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
QUAD = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
QUAD_FACES = np.array([[0, 1, 2], [0, 2, 3]], np.uint16)
QUAD_UVS = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float32)
CUBE_FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
     [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]], np.uint16
)  # fmt: skip


class GltfFile:
    """A glTF document under construction; change `document` freely before writing."""

    def __init__(self) -> None:
        self.binary = bytearray()
        self.document: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": []}],
            **{key: [] for key in ("nodes", "meshes", "accessors", "bufferViews", "materials")},
        }

    def view(self, content: bytes, **more: Any) -> int:
        """Appends bytes as a buffer view."""
        self.binary += b"\0" * (-len(self.binary) % 4)
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(content), **more}
        self.binary += content
        self.document["bufferViews"].append(view)
        return len(self.document["bufferViews"]) - 1

    def accessor(self, values: Any, dtype: str = "f4", **more: Any) -> int:
        """Appends an array, shape (n,) or (n, columns), as an accessor."""
        array = np.ascontiguousarray(values, "<" + dtype)
        accessor = {
            "bufferView": self.view(array.tobytes()),
            "componentType": COMPONENTS[dtype],
            "count": len(array),
            "type": KINDS[1 if array.ndim == 1 else array.shape[1]],
            **more,
        }
        self.document["accessors"].append(accessor)
        return len(self.document["accessors"]) - 1

    def primitive(
        self,
        positions: Any = TRIANGLE,
        faces: Any = None,
        *,
        normals: Any = None,
        uvs: Any = None,
        **more: Any,
    ) -> dict[str, Any]:
        """A primitive with accessors of its own."""
        attributes = {"POSITION": self.accessor(positions)}
        if normals is not None:
            attributes["NORMAL"] = self.accessor(normals)
        if uvs is not None:
            attributes["TEXCOORD_0"] = self.accessor(uvs)
        indices = {} if faces is None else {"indices": self.accessor(np.ravel(faces), "u2")}
        return {"attributes": attributes, **indices, **more}

    def mesh(self, *primitives: dict[str, Any], **more: Any) -> int:
        """Appends a mesh."""
        self.document["meshes"].append({"primitives": list(primitives), **more})
        return len(self.document["meshes"]) - 1

    def node(self, name: str | None = None, *, root: bool = True, **more: Any) -> int:
        """Appends a node, by default as a root of the scene."""
        self.document["nodes"].append(({} if name is None else {"name": name}) | more)
        index = len(self.document["nodes"]) - 1
        if root:
            self.document["scenes"][0]["nodes"].append(index)
        return index

    def texture(self, alpha: np.ndarray) -> int:
        """Appends an RGBA texture with the given alpha channel, values 0 to 255."""
        image = self.view(rgba_png(alpha))
        self.document.setdefault("images", []).append({"bufferView": image, "mimeType": "image/png"})
        self.document.setdefault("textures", []).append({"source": len(self.document["images"]) - 1})
        return len(self.document["textures"]) - 1

    def material(self, **more: Any) -> int:
        """Appends a material."""
        self.document["materials"].append(more)
        return len(self.document["materials"]) - 1

    def glb(self) -> bytes:
        """The whole as one GLB."""
        document = self.document | {"buffers": [{"byteLength": len(self.binary)}]}
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        binary = bytes(self.binary) + b"\0" * (-len(self.binary) % 4)
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks

    def write(self, folder: Path, name: str = "level.glb") -> Path:
        """Writes the GLB into `folder`."""
        path = folder / name
        path.write_bytes(self.glb())
        return path

    def write_json(self, folder: Path, uri: str, name: str = "level.gltf") -> Path:
        """Writes the JSON alone, with a buffer that refers to `uri`."""
        document = self.document | {"buffers": [{"byteLength": len(self.binary), "uri": uri}]}
        path = folder / name
        path.write_text(json.dumps(document), encoding="utf-8")
        return path


def rgba_png(alpha: np.ndarray) -> bytes:
    """A white PNG with an alpha channel, shape (h, w), values 0 to 255."""
    from PIL import Image

    pixels = np.full((*alpha.shape, 4), 255, np.uint8)
    pixels[..., 3] = alpha
    stream = io.BytesIO()
    Image.fromarray(pixels, "RGBA").save(stream, "PNG")
    return stream.getvalue()


def one_quad(**node: Any) -> GltfFile:
    """A file with one object `quad`: a unit square in the xy plane."""
    file = GltfFile()
    normals = np.tile([0.0, 0.0, 1.0], (4, 1))
    file.node("quad", mesh=file.mesh(file.primitive(QUAD, QUAD_FACES, normals=normals)), **node)
    return file


def one_cube(**node: Any) -> GltfFile:
    """A file with one object `cube`: a closed unit cube without normals."""
    file = GltfFile()
    file.node("cube", mesh=file.mesh(file.primitive(CUBE, CUBE_FACES)), **node)
    return file
