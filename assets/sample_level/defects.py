"""The meshes of the dark corner, each wrong in exactly one way; metres from the middle of a plinth's top."""

from __future__ import annotations

import numpy as np

from assets.sample_level.cells import SOLID, Block, surfaces
from assets.sample_level.mesh import Part, Solid, joined, shaded, with_normals
from assets.sample_level.shapes import boulder, box, graded, icosphere, lattice, revolved, sheet

Parts = dict[str, tuple[Part, ...]]


def buried() -> Parts:
    """A post of tall single faces in a mound whose material is two-sided."""
    post = lattice(np.array([-0.15, 0.15]), np.array([-0.02, 1.0]), np.array([-0.15, 0.15]))
    mound = boulder(3, (0.55, 0.6, 0.55), 0.05, 801)
    return {"Post": (shaded(post, "Defect"),), "Mound": (shaded(mound, "DefectTwoSided", crease=80.0),)}


def below_plane_rays() -> Parts:
    """A slab whose upper normals lean towards a wall."""
    slab = shaded(box((-0.7, -0.01, -0.55), (0.7, 0.12, 0.7), 0.14), "Defect")
    lean = np.radians(80.0)
    normals = np.where(slab.normals[:, 1:2] > 0.9, [[0.0, np.cos(lean), -np.sin(lean)]], slab.normals)
    wall = box((-0.72, -0.01, -0.78), (0.72, 1.3, -0.53), 0.2, 0.1)
    return {
        "Slab": (Part(slab.positions, normals, slab.faces, "Defect"),),
        "Wall": (shaded(wall, "Defect"),),
    }


def flipped_normals() -> Parts:
    """A closed vase: the winding inwards, the normals outwards."""
    profile = [(0.0, 0.004), (0.2, 0.004), (0.22, 0.1), (0.28, 0.3), (0.3, 0.5), (0.26, 0.7), (0.16, 0.85)]
    profile += [(0.14, 0.95), (0.2, 1.05), (0.17, 1.07), (0.0, 1.07)]
    vase = shaded(revolved(profile, 24), "Defect", crease=50.0)
    return {"Vase": (Part(vase.positions, vase.normals, vase.faces[:, ::-1], "Defect"),)}


def coplanar_twin() -> Parts:
    """A banner whose faces are doubled with opposed winding on the same vertices, 4 cm before a board."""
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, 9), np.linspace(0.05, 1.2, 10), indexing="ij")
    front = sheet(np.stack([x, y, np.zeros_like(x)], axis=-1))
    both = Solid(front.positions, np.concatenate([front.faces, front.faces[:, ::-1]]))
    normals = np.broadcast_to([0.0, 0.0, 1.0], front.positions.shape)
    board = box((-0.6, -0.01, -0.2), (0.6, 1.3, -0.04), 0.2, 0.1)
    return {"Banner": (with_normals(both, normals, "Defect"),), "Board": (shaded(board, "Wood"),)}


def starved() -> Parts:
    """A spike that begins in a dark hollow, runs through a thick solid and shows only its tip."""
    blocks = [Block(SOLID, (-0.6, -0.01, -0.6), (0.6, 0.74, 0.6)), Block("Hollow", (-0.5, 0.03, -0.5), (0.5, 0.3, 0.5))]
    drum = joined(*surfaces(blocks, "Outside", 0.2, 0.1).values())
    spike = revolved([(0.0, 0.06), (0.45, 0.08), (0.47, 0.2), (0.4, 0.32), (0.0, 0.77)], 4)
    return {"Drum": (shaded(drum, "Stone"),), "Spike": (shaded(spike, "Defect", crease=170.0),)}


def sliver_overshoot() -> Parts:
    """A table top of two large panels with three needles between them, under a rail that shades little but these."""
    wide, deep, strip = 0.7, 0.6, 0.03
    a, b, c, d = (-wide, 0.0), (wide, 0.0), (wide, strip), (-wide, strip)
    flat = np.array([a, b, c, d, (0.0, strip), (-wide, -deep), (wide, -deep), (wide, deep), (-wide, deep)])
    positions = np.column_stack([flat[:, 0], np.full(len(flat), 0.12), flat[:, 1]])
    needles = [(0, 4, 1), (0, 3, 4), (4, 2, 1)]
    panels = [(5, 0, 1), (5, 1, 6), (3, 8, 7), (3, 7, 2)]
    faces = np.array(needles + panels)
    top = with_normals(Solid(positions, faces), np.broadcast_to([0.0, 1.0, 0.0], positions.shape), "Defect")
    body = box((-wide, -0.01, -deep), (wide, 0.105, deep), 0.4)
    rail = [box((-0.72, 0.16, -0.025), (0.72, 0.22, 0.055), 0.2, 0.08)]
    rail += [box((x, -0.01, -0.03), (x + 0.04, 0.21, 0.06), 0.2, 0.08) for x in (-0.75, 0.71)]
    return {"Table": (top,), "Body": (shaded(body, "Wood"),), "Rail": (shaded(joined(*rail), "Wood"),)}


def split_seam() -> Parts:
    """Two tiles side by side; a low canopy over the second one begins at the seam."""
    zs = graded(-0.6, 0.6, 0.15)
    first = lattice(np.array([-0.72, 0.0]), np.array([-0.01, 0.12]), zs)
    second = lattice(np.array([0.0, 0.72]), np.array([-0.01, 0.12]), zs)
    canopy = [box((0.0, 0.24, -0.7), (0.78, 0.5, 0.7), 0.2, 0.08), box((0.7, -0.01, -0.7), (0.78, 0.3, 0.7), 0.2, 0.1)]
    canopy += [box((0.02, -0.01, z), (0.77, 0.3, z + 0.08), 0.2, 0.1) for z in (-0.69, 0.61)]
    return {
        "TileA": (shaded(first, "Defect"),),
        "TileB": (shaded(second, "Defect"),),
        "Canopy": (shaded(joined(*canopy), "Stone"),),
    }


def enclosing_shell() -> Parts:
    """A bust in a closed shell that faces inwards."""
    head = icosphere(2)
    head = Solid(head.positions * (0.17, 0.22, 0.17) + np.array([0.0, 0.5, 0.0]), head.faces)
    outline = [(0.0, -0.01), (0.22, -0.01), (0.26, 0.1), (0.2, 0.25), (0.09, 0.32), (0.08, 0.4), (0.0, 0.42)]
    chest = revolved(outline, 20)
    bust = (shaded(joined(head, chest), "Linen", crease=50.0),)
    shell = icosphere(3)
    shell = Solid(shell.positions * (0.62, 0.75, 0.62) + np.array([0.0, 0.3, 0.0]), shell.faces[:, ::-1])
    return {"Bust": bust, "Shell": (shaded(shell, "Defect", crease=80.0),)}


def true_crevice() -> Parts:
    """Two sound, finely meshed blocks 5 cm apart."""
    depth, height = graded(-0.5, 0.5, 0.12, 0.05), graded(-0.01, 0.8, 0.12, 0.05)
    left = lattice(graded(-0.55, -0.025, 0.15, 0.05), height, depth)
    right = lattice(graded(0.025, 0.55, 0.15, 0.05), height, depth)
    return {"Blocks": (shaded(joined(left, right), "Stone"),)}
