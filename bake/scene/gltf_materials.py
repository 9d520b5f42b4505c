"""glTF materials → what they do to a ray: two-sided or not, and how much light their alpha lets through."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bake.errors import SceneError
from bake.scene.alpha import TextureError, openness_of, read_alpha
from bake.scene.gltf_buffers import GltfBuffers, decode_data_uri
from bake.scene.gltf_document import GltfDocument
from bake.scene.json_cursor import JsonCursor
from bake.types import Finding, Float32Array, Float64Array, Material

REPEAT, CLAMP = 10497, 33071


@dataclass(frozen=True, slots=True)
class GltfMaterial:
    """A material and where its alpha texture wants its coordinates from.

    Attributes:
        material: What it does to a ray.
        uv_set: TEXCOORD set of its alpha texture, -1 if it needs none.
        uv_transform: Shape (2, 3), float64: KHR_texture_transform, applied as M · (u, v, 1).
        wraps: Whether the texture repeats in both directions.
    """

    material: Material
    uv_set: int = -1
    uv_transform: Float64Array | None = None
    wraps: bool = True

    @property
    def without_map(self) -> GltfMaterial:
        """The same material for geometry without texture coordinates: its mean openness everywhere."""
        return GltfMaterial(replace(self.material, openness_map=None))


class MaterialReader:
    """Reads materials of one document; each image is decoded once."""

    def __init__(self, document: GltfDocument, buffers: GltfBuffers) -> None:
        self._document = document
        self._buffers = buffers
        self._alphas: dict[int, Float32Array | None] = {}
        self.findings: list[Finding] = []

    def read(self) -> list[GltfMaterial]:
        """All materials, and last the one that primitives without a material get.

        Raises:
            SceneError: a malformed material.
        """
        materials = [self._material(item) for item in self._document.root.get("materials", []).items()]
        return [*materials, GltfMaterial(Material("default"))]

    def _material(self, source: JsonCursor) -> GltfMaterial:
        name = source.get("name", "").text() or source.place
        two_sided = source.get("doubleSided", False).flag()
        mode = source.get("alphaMode", "OPAQUE").text()
        if mode not in ("OPAQUE", "MASK", "BLEND"):
            raise source.get("alphaMode").wrong("OPAQUE, MASK or BLEND")
        plain = GltfMaterial(Material(name, two_sided))
        if mode == "OPAQUE":
            return plain
        cutoff = source.get("alphaCutoff", 0.5).number() if mode == "MASK" else None
        factor, texture = self._base_color(source)
        alpha = None if texture is None else self._alpha(texture, name)
        if texture is None or alpha is None:
            openness = float(openness_of(np.full((1, 1), factor, np.float32), cutoff=cutoff)[0, 0])
            return GltfMaterial(replace(plain.material, openness=openness))
        openness_map = openness_of(alpha * np.float32(factor), cutoff=cutoff)
        mean = float(openness_map.mean(dtype=np.float64))
        if np.ptp(openness_map) == 0.0:
            return GltfMaterial(replace(plain.material, openness=mean))
        uv_set, uv_transform = _uv_source(texture)
        return GltfMaterial(
            replace(plain.material, openness=mean, openness_map=openness_map),
            uv_set,
            uv_transform,
            self._wraps(texture),
        )

    def _base_color(self, source: JsonCursor) -> tuple[float, JsonCursor | None]:
        """The alpha factor and the texture reference of a metallic-roughness or specular-glossiness material."""
        colour, factor_key, texture_key = source.get("pbrMetallicRoughness", {}), "baseColorFactor", "baseColorTexture"
        glossiness = source.get("extensions", {}).get("KHR_materials_pbrSpecularGlossiness")
        if glossiness.value is not None and not source.has("pbrMetallicRoughness"):
            colour, factor_key, texture_key = glossiness, "diffuseFactor", "diffuseTexture"
        factor = colour.get(factor_key, [1.0, 1.0, 1.0, 1.0]).numbers(4)[3]
        return float(np.clip(factor, 0.0, 1.0)), colour.get(texture_key) if colour.has(texture_key) else None

    def _alpha(self, reference: JsonCursor, material: str) -> Float32Array | None:
        """The alpha channel behind a texture reference; None without one or if it cannot be had."""
        texture = self._document.root.get("textures", []).element(reference.get("index"))
        source = texture.get("source")
        for extension in ("EXT_texture_webp", "KHR_texture_basisu", "MSFT_texture_dds"):
            if source.value is None:
                source = texture.get("extensions", {}).get(extension, {}).get("source")
        if source.value is None:
            self._report(material, "its texture names no image")
            return None
        image = self._document.root.get("images", []).element(source)
        number = source.integer()
        if number not in self._alphas:
            try:
                self._alphas[number] = read_alpha(self._image_bytes(image))
            except (TextureError, SceneError) as problem:
                self._alphas[number] = None
                what = problem.what if isinstance(problem, SceneError) else str(problem)
                self._report(material, f"{image.get('name', image.place).value}: {what}")
        return self._alphas[number]

    def _image_bytes(self, image: JsonCursor) -> bytes:
        if image.has("bufferView"):
            return bytes(self._buffers.view(image.get("bufferView"))[0])
        uri = image.get("uri").text()
        if uri.startswith("data:"):
            return decode_data_uri(uri, image)
        ledger = self._document.ledger
        return ledger.read(ledger.resolve_uri(uri, what="the texture"), what="the texture file")

    def _wraps(self, reference: JsonCursor) -> bool:
        texture = self._document.root.get("textures", []).element(reference.get("index"))
        if not texture.has("sampler"):
            return True
        sampler = self._document.root.get("samplers", []).element(texture.get("sampler"))
        return all(sampler.get(key, REPEAT).value == REPEAT for key in ("wrapS", "wrapT"))

    def _report(self, material: str, what: str) -> None:
        self.findings.append(
            Finding(
                self._document.ledger.scene.name,
                "missing-texture",
                1,
                f"Material {material} counts by its alpha factor alone, because {what}.",
            )
        )


def _uv_source(reference: JsonCursor) -> tuple[int, Float64Array | None]:
    """The TEXCOORD set of a texture reference and its KHR_texture_transform."""
    uv_set = reference.get("texCoord", 0).integer(low=0, high=255)
    extension = reference.get("extensions", {}).get("KHR_texture_transform")
    if extension.value is None:
        return uv_set, None
    uv_set = extension.get("texCoord", uv_set).integer(low=0, high=255)
    offset = extension.get("offset", [0.0, 0.0]).numbers(2)
    scale = extension.get("scale", [1.0, 1.0]).numbers(2)
    angle = extension.get("rotation", 0.0).number()
    cosine, sine = np.cos(angle), np.sin(angle)
    # Rotation is counter-clockwise as seen with v pointing down: the extension's matrix T · R · S.
    rotation = np.array([[cosine, sine], [-sine, cosine]])
    return uv_set, np.column_stack((rotation * scale, offset))
