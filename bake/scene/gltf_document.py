"""The outer layer of glTF 2.0: the GLB container, the JSON text, and what the file says it needs."""

from __future__ import annotations

import json
import re
import struct
from dataclasses import dataclass
from typing import NoReturn

from bake.errors import SceneError
from bake.scene.files import FileLedger
from bake.scene.json_cursor import JsonCursor

GLB_MAGIC = b"glTF"
CHUNK_JSON = 0x4E4F534A
CHUNK_BIN = 0x004E4942

# Extensions that store geometry in a form of their own, and how to get rid of them.
COMPRESSION_ADVICE = {
    "KHR_draco_mesh_compression": "export it without Draco compression",
    "EXT_meshopt_compression": "unpack it first, e.g. with `gltfpack -noq` or a re-export without meshopt compression",
    "KHR_meshopt_compression": "unpack it first, e.g. with a re-export without meshopt compression",
}
# Required extensions that change nothing about where surfaces are, or that are read here.
HARMLESS = re.compile(
    r"KHR_mesh_quantization|EXT_mesh_gpu_instancing|KHR_texture_transform|KHR_techniques?_webgl|MSFT_lod"
    r"|[A-Z]+_(materials|texture|image|lights|light|animation|xmp|audio|environment|node_visibility|node_selectability"
    r"|node_hoverability|interactivity)(_.*)?"
)


@dataclass(frozen=True, slots=True)
class GltfDocument:
    """A glTF file taken apart.

    Attributes:
        root: Cursor on the JSON document.
        binary: The GLB's binary chunk; None without one.
        ledger: Reads the files that the document refers to.
    """

    root: JsonCursor
    binary: memoryview | None
    ledger: FileLedger

    def wrong(self, what: str, *, remedy: str = "") -> SceneError:
        """An error about this file."""
        return SceneError(what, where=str(self.ledger.scene), remedy=remedy)


def read_document(ledger: FileLedger) -> GltfDocument:
    """Reads the scene file of `ledger` as `.glb` or `.gltf`, whichever its content is.

    Raises:
        SceneError: missing, truncated or malformed file, glTF 1.0, or a required extension that is not read.
    """
    content = ledger.read(ledger.scene.name, what="the scene file")
    file = str(ledger.scene)
    text, binary = _split_glb(content, file) if content[:4] == GLB_MAGIC else (memoryview(content), None)
    document = GltfDocument(JsonCursor(_parse_json(bytes(text), file), file), binary, ledger)
    document.root.object()
    _check_version(document)
    _check_extensions(document)
    return document


def _split_glb(content: bytes, file: str) -> tuple[memoryview, memoryview | None]:
    """The JSON chunk and the binary chunk of a GLB (glTF 2.0 specification, section 4.4)."""
    if len(content) < 12:
        raise SceneError("the GLB ends inside its header", where=file, remedy="copy or export it again")
    version, length = struct.unpack_from("<II", content, 4)
    if version != 2:
        raise SceneError(f"the GLB has version {version}", where=file, remedy="export it as glTF 2.0")
    if length > len(content):
        raise SceneError(
            f"the GLB is truncated: {len(content)} of {length} bytes are there",
            where=file,
            remedy="copy or export it again",
        )
    whole, text, binary, position = memoryview(content)[:length], None, None, 12
    while position + 8 <= length:
        size, kind = struct.unpack_from("<II", content, position)
        chunk = whole[position + 8 : position + 8 + size]
        if len(chunk) < size:
            raise SceneError(
                f"a GLB chunk of {size} bytes is cut off after {len(chunk)}",
                where=file,
                remedy="copy or export it again",
            )
        if kind == CHUNK_JSON and text is None:
            text = chunk
        elif kind == CHUNK_BIN and binary is None:
            binary = chunk
        position += 8 + size
    if text is None:
        raise SceneError("the GLB has no JSON chunk", where=file, remedy="copy or export it again")
    return text, binary


def _parse_json(text: bytes, file: str) -> object:
    def refuse(constant: str) -> NoReturn:
        raise ValueError(f"{constant} is no JSON number")

    try:
        return json.loads(text.decode("utf-8-sig").rstrip("\0"), parse_constant=refuse)
    except RecursionError:
        raise SceneError("the JSON is nested too deeply", where=file, remedy="export the scene again") from None
    except ValueError as problem:
        reason = "it is no UTF-8 text" if isinstance(problem, UnicodeDecodeError) else str(problem)
        raise SceneError(f"the JSON is malformed: {reason}", where=file, remedy="export the scene again") from None


def _check_version(document: GltfDocument) -> None:
    asset = document.root.get("asset", {})
    version = asset.get("version", "2.0")
    if isinstance(version.value, str) and not version.value.startswith("2"):
        raise document.wrong(f"this is glTF {version.value[:20]}", remedy="export it as glTF 2.0")


def _check_extensions(document: GltfDocument) -> None:
    for item in document.root.get("extensionsRequired", []).items():
        name = item.text()
        if name in COMPRESSION_ADVICE:
            raise document.wrong(f"the file is compressed with {name}", remedy=COMPRESSION_ADVICE[name])
        if HARMLESS.fullmatch(name) is None:
            raise document.wrong(
                f"the file requires the extension {name[:60]}, which is not read", remedy="export it without"
            )
