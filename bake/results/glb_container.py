"""glTF 2.0 documents as containers: where their bytes lie, and how they become one GLB (specification, section 4.4).

Nothing is interpreted that need not be: the JSON stays as it is, and buffers are copied from where they lie.
"""

from __future__ import annotations

import base64
import binascii
import json
import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO, cast
from urllib.parse import unquote, unquote_to_bytes

from bake.errors import ResultError, StorageError

_CHUNK_JSON, _CHUNK_BIN = 0x4E4F534A, 0x004E4942
_COPY_BYTES = 1 << 22
_ALIGNMENT = 4


@dataclass(frozen=True, slots=True)
class Segment:
    """Bytes of a binary chunk: in memory, or `length` bytes of `path` from `offset` on."""

    length: int
    content: bytes = b""
    path: Path | None = None
    offset: int = 0

    def pieces(self) -> Iterator[bytes]:
        """The bytes, a few megabytes at a time.

        Raises:
            ResultError: the file has become shorter.
        """
        if self.path is None:
            yield self.content
            return
        with self.path.open("rb") as file:
            file.seek(self.offset)
            left = self.length
            while left:
                piece = file.read(min(left, _COPY_BYTES))
                if not piece:
                    raise ResultError("was cut short while it was copied", where=str(self.path), remedy="try again")
                left -= len(piece)
                yield piece


@dataclass(slots=True)
class GltfContainer:
    """A document on its way to becoming a GLB: its JSON, and what its one buffer will hold.

    Attributes:
        document: The JSON, to be added to.
        segments: The binary chunk so far.
        length: Bytes of the segments.
        trailing: Further chunks of a GLB, kept behind the binary chunk as they are.
        left_out: URIs of images that could not be taken along.
    """

    document: dict[str, Any]
    segments: list[Segment] = field(default_factory=list[Segment])
    length: int = 0
    trailing: bytes = b""
    left_out: list[str] = field(default_factory=list[str])

    def append(self, segment: Segment) -> int:
        """Adds bytes at the next aligned place and returns their offset."""
        padding = -self.length % _ALIGNMENT
        if padding:
            self.segments.append(Segment(padding, bytes(padding)))
        offset = self.length + padding
        self.segments.append(segment)
        self.length = offset + segment.length
        return offset

    def add(self, kind: str, item: dict[str, Any]) -> int:
        """Appends to one of the document's arrays, such as `accessors`; returns the index."""
        items = self.document.setdefault(kind, [])
        items.append(item)
        return len(items) - 1

    def write(self, file: BinaryIO) -> None:
        """Writes the GLB.

        Raises:
            StorageError: it would be larger than the format allows.
        """
        if self.length:
            buffers: list[dict[str, Any]] = self.document.get("buffers") or [{}]
            buffers[0]["byteLength"] = self.length
            self.document["buffers"] = buffers
        text = json.dumps(self.document, ensure_ascii=False, separators=(",", ":")).encode()
        text += b" " * (-len(text) % _ALIGNMENT)
        padding = bytes(-self.length % _ALIGNMENT)
        binary = 8 + self.length + len(padding) if self.length else 0
        total = 12 + 8 + len(text) + binary + len(self.trailing)
        if total > 0xFFFFFFFF:
            raise StorageError("the GLB would exceed 4 GB", remedy="export to .npz or .ply")
        file.write(struct.pack("<4sII", b"glTF", 2, total))
        file.write(struct.pack("<II", len(text), _CHUNK_JSON) + text)
        if self.length:
            file.write(struct.pack("<II", self.length + len(padding), _CHUNK_BIN))
            for piece in _all_pieces(self.segments):
                file.write(piece)
            file.write(padding)
        file.write(self.trailing)


def _all_pieces(segments: Iterable[Segment]) -> Iterator[bytes]:
    for segment in segments:
        yield from segment.pieces()


def read_container(path: Path) -> GltfContainer:
    """Opens a `.glb` or `.gltf` file whose bytes have just been compared with those that were baked.

    A GLB's binary chunk becomes the beginning of the new one byte for byte; external buffers and images are taken in
    behind it, so that the copy stands alone wherever it is written.

    Raises:
        ResultError: the file cannot be taken apart.
    """
    try:
        with path.open("rb") as file:
            magic = file.read(12)
            if magic[:4] != b"glTF":
                container, binary = GltfContainer(json.loads(magic + file.read())), None
            else:
                container, binary = _read_glb(path, file, struct.unpack("<4sII", magic)[2])
        _gather_buffers(container, path.parent, binary)
        _gather_images(container, path.parent)
    except (OSError, ValueError, KeyError, TypeError, struct.error, binascii.Error, AttributeError) as error:
        raise ResultError(
            f"cannot be taken apart ({error})", where=str(path), remedy="export to .npz or .ply"
        ) from error
    return container


def _read_glb(path: Path, file: BinaryIO, end: int) -> tuple[GltfContainer, Segment | None]:
    document: dict[str, Any] | None = None
    binary: Segment | None = None
    trailing = b""
    while file.tell() + 8 <= end:
        header = file.read(8)
        length, kind = struct.unpack("<II", header)
        if kind == _CHUNK_JSON and document is None:
            document = json.loads(file.read(length).decode("utf-8-sig").rstrip("\0"))
        elif kind == _CHUNK_BIN and binary is None:
            binary = Segment(length, path=path, offset=file.tell())
            file.seek(length, 1)
        else:
            trailing += header + file.read(length)
    if document is None:
        raise ValueError("no JSON chunk")
    return GltfContainer(document, trailing=trailing), binary


def _gather_buffers(container: GltfContainer, folder: Path, binary: Segment | None) -> None:
    """Makes all buffers one; only views of buffers other than the first get another offset."""
    buffers = cast(list[dict[str, Any]], container.document.get("buffers", []))
    starts: list[int] = []
    for index, buffer in enumerate(buffers):
        uri = buffer.get("uri")
        if uri is not None:
            starts.append(container.append(_fetched(uri, folder)))
        elif index == 0 and binary is not None:
            starts.append(container.append(binary))
        else:
            raise ValueError(f"buffer {index} has no data")
    for view in cast(list[dict[str, Any]], container.document.get("bufferViews", [])):
        if view["buffer"] != 0:
            view["byteOffset"] = view.get("byteOffset", 0) + starts[view["buffer"]]
            view["buffer"] = 0
    if buffers:
        container.document["buffers"] = [{key: value for key, value in buffers[0].items() if key != "uri"}]


def _gather_images(container: GltfContainer, folder: Path) -> None:
    for image in cast(list[dict[str, Any]], container.document.get("images", [])):
        uri = image.get("uri")
        if uri is None or uri.startswith("data:"):
            continue
        try:
            segment = _fetched(uri, folder)
        except (OSError, ValueError):
            container.left_out.append(uri)
            continue
        kind = "image/png" if b"".join(segment.pieces()).startswith(b"\x89PNG") else "image/jpeg"
        view = {"buffer": 0, "byteOffset": container.append(segment), "byteLength": segment.length}
        del image["uri"]
        image.setdefault("mimeType", kind)
        image["bufferView"] = container.add("bufferViews", view)


def _fetched(uri: str, folder: Path) -> Segment:
    if uri.startswith("data:"):
        header, _, body = uri.partition(",")
        raw = unquote_to_bytes(body)
        content = base64.b64decode(raw) if header.endswith(";base64") else raw
        return Segment(len(content), content)
    path = folder / unquote(uri).replace("\\", "/")
    if not path.resolve().is_relative_to(folder.resolve()):
        raise ValueError(f"{uri[:80]!r} lies outside the scene's folder")
    return Segment(path.stat().st_size, path=path)
