"""Wavefront MTL: only what concerns a ray, which is how transparent a material is."""

from __future__ import annotations

import codecs
from collections.abc import Sequence

import numpy as np

from bake.errors import SceneError
from bake.scene.alpha import TextureError, openness_of, read_alpha
from bake.scene.files import FileLedger
from bake.types import Finding, Material

# Options of a map statement, and how many words follow each at most.
MAP_OPTIONS = {
    b"-blendu": 1, b"-blendv": 1, b"-boost": 1, b"-mm": 2, b"-o": 3, b"-s": 3, b"-t": 3, b"-texres": 1,
    b"-clamp": 1, b"-bm": 1, b"-imfchan": 1, b"-type": 1,
}  # fmt: skip


def read_obj_materials(
    ledger: FileLedger, libraries: Sequence[str], names: Sequence[str]
) -> tuple[list[Material], list[Finding]]:
    """The materials called `names`, in that order; those that no library defines are opaque.

    `d` and `Tr` set how opaque a material is, `map_d` how opaque each texel is.
    """
    findings: list[Finding] = []
    defined: dict[str, dict[bytes, bytes]] = {}
    for library in dict.fromkeys(libraries):
        content = _library(ledger, library, findings)
        defined |= _statements(content)
    return [_material(name, defined.get(name, {}), ledger, findings) for name in names], findings


def _library(ledger: FileLedger, library: str, findings: list[Finding]) -> bytes:
    try:
        content = ledger.read_if_present(
            ledger.resolve_uri(library, what="the material file"), what="the material file"
        )
    except SceneError as problem:
        findings.append(Finding(ledger.scene.name, "missing-material-file", 1, f"{library}: {problem.what}."))
        return b""
    if content is None:
        detail = f"{library} is not there: its materials count as opaque."
        findings.append(Finding(ledger.scene.name, "missing-material-file", 1, detail, "info"))
    return content or b""


def _statements(content: bytes) -> dict[str, dict[bytes, bytes]]:
    materials: dict[str, dict[bytes, bytes]] = {}
    current: dict[bytes, bytes] = {}
    for line in content.removeprefix(codecs.BOM_UTF8).splitlines():
        parts = line.split(None, 1)
        if not parts:
            continue
        keyword, rest = parts[0].lower(), parts[1].strip() if len(parts) > 1 else b""
        if keyword == b"newmtl":
            current = materials.setdefault(" ".join(rest.decode("utf-8", "replace").split()), {})
        elif keyword in (b"d", b"tr", b"map_d"):
            current[keyword] = rest
    return materials


def _material(name: str, statements: dict[bytes, bytes], ledger: FileLedger, findings: list[Finding]) -> Material:
    opacity = _fraction(statements.get(b"d"), 1.0)
    if b"d" not in statements:
        opacity = 1.0 - _fraction(statements.get(b"tr"), 0.0)
    plain = Material(name or "default", openness=1.0 - opacity)
    if b"map_d" not in statements:
        return plain
    uri = _map_name(statements[b"map_d"])
    try:
        image = ledger.read(ledger.resolve_uri(uri, what="the texture"), what="the texture file")
        alpha = read_alpha(image, luminance=True)
    except (SceneError, TextureError) as problem:
        what = problem.what if isinstance(problem, SceneError) else str(problem)
        detail = f"Material {name} counts by its opacity alone, because of {uri}: {what}."
        findings.append(Finding(ledger.scene.name, "missing-texture", 1, detail))
        return plain
    if alpha is None:
        return plain
    # OBJ counts v upwards from the bottom row of the image.
    openness_map = openness_of(alpha[::-1] * np.float32(opacity), cutoff=None)
    mean = float(openness_map.mean(dtype=np.float64))
    return Material(name, openness=mean, openness_map=None if np.ptp(openness_map) == 0.0 else openness_map)


def _fraction(words: bytes | None, default: float) -> float:
    try:
        return float(np.clip(float((words or b"").split()[-1]), 0.0, 1.0))
    except (ValueError, IndexError):
        return default


def _map_name(rest: bytes) -> str:
    words = rest.split()
    while len(words) > 1 and words[0] in MAP_OPTIONS:
        most = MAP_OPTIONS[words.pop(0)]
        while most and len(words) > 1 and _is_option_value(words[0]):
            words.pop(0)
            most -= 1
    return b" ".join(words).decode("utf-8", "replace")


def _is_option_value(word: bytes) -> bool:
    if word in (b"on", b"off") or len(word) == 1:
        return True
    try:
        float(word)
    except ValueError:
        return False
    return True
