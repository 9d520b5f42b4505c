"""Two trees, two shrubs and a clump of grass: the meshes."""

from __future__ import annotations

import numpy as np

from assets.sample_level.mesh import Part, Points, Solid, face_normals, joined, merged, shaded, with_normals
from assets.sample_level.randomness import Random
from assets.sample_level.shapes import tube

_CARD_UVS = np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]])


def _unit(vectors: Points) -> Points:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)


def _cards(centres: Points, across: Points, along: Points, heart: Points, material: str) -> Part:
    """Textured quads.

    Args:
        centres, across, along: Shape (n, 3): middle and half edges of each quad.
        heart: Shape (3,): middle of the crown; normals lean away from it, as foliage is usually shaded.
        material: Name.
    """
    n = len(centres)
    corners = np.stack([-across - along, across - along, across + along, -across + along], axis=1)
    positions = centres[:, None] + corners
    flat = _unit(np.cross(across, along))
    outward = _unit(centres - heart)
    turned_in = np.einsum("ij,ij->i", flat, outward) < 0
    positions[turned_in] = positions[turned_in][:, [1, 0, 3, 2]]  # the front looks outwards
    flat[turned_in] *= -1
    normals = np.repeat(_unit(0.6 * flat + outward), 4, axis=0)
    quads = np.arange(4 * n).reshape(-1, 4)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return with_normals(Solid(positions.reshape(-1, 3), faces), normals, material, np.tile(_CARD_UVS, (n, 1)))


def oak() -> tuple[Part, ...]:
    """About 8 m high: a bent trunk, boughs, and leaf cards around their ends."""
    random = Random(601)
    t = np.linspace(0.0, 1.0, 8)[:, None]
    trunk = np.concatenate([0.25 * np.sin(2.6 * t), -0.4 + 4.9 * t, 0.2 * np.sin(2.1 * t + 0.5) - 0.1], axis=1)
    bark = [tube(trunk, 0.34 - 0.2 * t[:, 0] + 0.16 * np.exp(-9.0 * t[:, 0]), 9)]
    tips = [trunk[-1] + (0.0, 0.9, 0.0)]
    for i in range(8):
        start = trunk[3 + i % 5]
        heading, rise, length = i * 2.4, random.number(0.4, 0.95), random.number(1.7, 2.6)
        s = np.linspace(0.0, 1.0, 5)[:, None]
        out = np.array([np.cos(heading), 0.0, np.sin(heading)])
        path = start + length * (s * out + rise * s**1.4 * np.array([0.0, 1.0, 0.0]))
        bark.append(tube(path, 0.11 - 0.085 * s[:, 0], 5))
        tips.append(path[-1])
    heart = np.array([0.1, 5.2, 0.0])
    count = 30
    centres = np.concatenate([tip + _in_ball(random, count) * (1.25, 0.95, 1.25) for tip in tips])
    across = _unit(random.uniform(-1, 1, len(centres), 3))
    along = _unit(np.cross(across, random.uniform(-1, 1, len(centres), 3)))
    size = random.uniform(0.38, 0.55, len(centres), 1)
    leaves = _cards(centres, across * size, along * size, heart, "OakLeaves")
    return merged(shaded(joined(*bark), "Bark", crease=80.0), leaves)


def _in_ball(random: Random, count: int) -> Points:
    direction = _unit(random.uniform(-1, 1, count, 3))
    return direction * random.uniform(0.0, 1.0, count, 1) ** (1 / 3)


def pine() -> tuple[Part, ...]:
    """About 10 m high: a straight trunk and whorls of drooping boughs, each a bent and a crossing card."""
    random = Random(602)
    t = np.linspace(0.0, 1.0, 9)[:, None]
    trunk = np.concatenate([0.06 * np.sin(5 * t), -0.4 + 10.2 * t, 0.05 * np.cos(4 * t)], axis=1)
    bark = shaded(tube(trunk, 0.24 * (1.0 - t[:, 0]) + 0.015 + 0.1 * np.exp(-14 * t[:, 0]), 8), "Bark", crease=80.0)
    centres, across, along = [], [], []
    for whorl in range(13):
        height = 1.6 + 0.62 * whorl
        reach = 2.5 * (1.0 - (height - 1.0) / 9.6) + 0.15
        boughs = 7 if whorl < 8 else 5
        for bough in range(boughs):
            angle = 2 * np.pi * (bough + 0.37 * whorl) / boughs + random.number(-0.15, 0.15)
            out = np.array([np.cos(angle), random.number(-0.35, -0.1), np.sin(angle)])
            side = np.array([-np.sin(angle), 0.0, np.cos(angle)])
            lift = _unit(np.cross(side, out))
            middle = np.array([0.0, height, 0.0]) + out * reach * 0.5
            centres += [middle, middle]
            across += [side * reach * 0.3, (side * 0.35 + lift) * reach * 0.2]
            along += [out * reach * 0.52, out * reach * 0.5]
    needles = _cards(np.array(centres), np.array(across), np.array(along), np.array([0.0, 3.5, 0.0]), "PineNeedles")
    return merged(bark, needles)


def shrub(kind: int) -> tuple[Part, ...]:
    """About 1.2 m high: stems and small real leaves, thin rhombs seen from both sides."""
    random = Random(610 + kind)
    count, spread, height = ((84, 0.55, 1.15), (64, 0.75, 0.8))[kind]
    centres = _in_ball(random, count) * (spread, 0.45 * height, spread) + (0.0, 0.55 * height, 0.0)
    along = _unit(random.uniform(-1, 1, count, 3) + np.array([0.0, 0.5, 0.0])) * random.uniform(0.1, 0.17, count, 1)
    across = _unit(np.cross(along, random.uniform(-1, 1, count, 3))) * random.uniform(0.045, 0.08, count, 1)
    corners = np.stack([-along, across, along, -across], axis=1) + centres[:, None]
    quads = np.arange(4 * count).reshape(-1, 4)
    leaves = Solid(corners.reshape(-1, 3), np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]))
    stems = []
    for i in range(5):
        s = np.linspace(0.0, 1.0, 3)[:, None]
        lean = np.array([np.cos(2.5 * i), 0.0, np.sin(2.5 * i)]) * spread * 0.6
        stems.append(tube(s * lean + s * (0.0, 0.8 * height, 0.0) - (0.0, 0.05, 0.0), 0.02 - 0.014 * s[:, 0], 3))
    return merged(_flat(leaves, "ShrubLeaf"), shaded(joined(*stems), "Bark", crease=80.0))


def grass() -> tuple[Part, ...]:
    """A clump of nine bent blades, 0.4 m high."""
    random = Random(620)
    positions, faces = [], []
    for i in range(9):
        angle = random.number(0, 2 * np.pi)
        root = np.array([0.11 * np.cos(2.4 * i) * (i / 9) ** 0.5, -0.03, 0.11 * np.sin(2.4 * i) * (i / 9) ** 0.5])
        lean = np.array([np.cos(angle), 0.0, np.sin(angle)]) * random.number(0.06, 0.2)
        side = np.array([-np.sin(angle), 0.0, np.cos(angle)]) * 0.016
        top = random.number(0.25, 0.42)
        middle = root + 0.35 * lean + (0.0, 0.55 * top, 0.0)
        first = 5 * i
        positions += [root - side, root + side, middle + 0.8 * side, middle - 0.8 * side, root + lean + (0.0, top, 0.0)]
        faces += [(first, first + 2, first + 1), (first, first + 3, first + 2), (first + 3, first + 4, first + 2)]
    return (shaded(Solid(np.array(positions), np.array(faces)), "GrassBlade", crease=80.0),)


def _flat(solid: Solid, material: str) -> Part:
    """Each face with vertices of its own, as many as it has corners, and its own normal."""
    normals = _unit(face_normals(solid))
    corners = solid.positions[solid.faces].reshape(-1, 3)
    keys = np.concatenate([solid.faces.reshape(-1, 1), np.repeat(np.round(normals, 5), 3, axis=0)], axis=1)
    _, index, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return Part(corners[index], np.repeat(normals, 3, axis=0)[index], inverse.reshape(-1, 3), material)
