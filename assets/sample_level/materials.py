"""The level's materials, as glTF writes them."""

from __future__ import annotations

from typing import Any


def _plain(red: float, green: float, blue: float, *, metal: float = 0.0, two_sided: bool = False) -> dict[str, Any]:
    material: dict[str, Any] = {
        "pbrMetallicRoughness": {
            "baseColorFactor": [red, green, blue, 1.0],
            "metallicFactor": metal,
            "roughnessFactor": 0.9,
        }
    }
    return material | {"doubleSided": True} if two_sided else material


def _leaves(image: str) -> dict[str, Any]:
    return {
        "pbrMetallicRoughness": {"baseColorTexture": {"index": image}, "metallicFactor": 0.0, "roughnessFactor": 0.9},
        "alphaMode": "MASK",
        "alphaCutoff": 0.5,
        "doubleSided": True,
    }


MATERIALS: dict[str, dict[str, Any]] = {
    "Grass": _plain(0.33, 0.42, 0.2),
    "Meadow": _plain(0.38, 0.44, 0.24),
    "Rock": _plain(0.48, 0.46, 0.44),
    "Stone": _plain(0.62, 0.6, 0.55),
    "Paving": _plain(0.55, 0.54, 0.52),
    "Brick": _plain(0.6, 0.38, 0.3),
    "Plaster": _plain(0.85, 0.83, 0.78),
    "Tiles": _plain(0.5, 0.24, 0.18),
    "Boards": _plain(0.52, 0.38, 0.25),
    "Wood": _plain(0.45, 0.31, 0.19),
    "DarkWood": _plain(0.3, 0.2, 0.13),
    "Iron": _plain(0.4, 0.4, 0.42, metal=1.0),
    "Fabric": _plain(0.35, 0.3, 0.45),
    "Linen": _plain(0.8, 0.78, 0.72),
    "Bark": _plain(0.35, 0.27, 0.2),
    "Glass": {
        "pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.9, 0.95, 0.15], "metallicFactor": 0.0},
        "alphaMode": "BLEND",
        "doubleSided": True,
    },
    "OakLeaves": _leaves("oak_leaves"),
    "PineNeedles": _leaves("pine_needles"),
    "ShrubLeaf": _plain(0.25, 0.38, 0.16, two_sided=True),
    "GrassBlade": _plain(0.36, 0.5, 0.2, two_sided=True),
    "Marker": _plain(0.9, 0.75, 0.2),
    "Defect": _plain(0.75, 0.75, 0.75),
    "DefectTwoSided": _plain(0.7, 0.7, 0.72, two_sided=True),
}
