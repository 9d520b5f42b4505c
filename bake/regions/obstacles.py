"""Which faces stop what moves: all that cast, but for leaves, cut-outs and what is invisible."""

from __future__ import annotations

import numpy as np

from bake.types import BoolArray, Scene, World

CUT_OUT = 0.25
"""Share of holes in its part of an alpha texture from which a face stops nothing: leaves, grass, nets."""

INVISIBLE = 0.98
"""Share of light that passes from which a face without holes stops nothing; glass does."""


def stopping_faces(scene: Scene, world: World) -> BoolArray:
    """Faces that things in motion cannot pass, shape (m,).

    The world has the scene's faces in scene order; what was added behind them, such as a ground plane, stops.
    """
    holes = np.array([material.openness_map is not None for material in scene.materials], np.bool_)
    cut_out = np.zeros(world.face_count, np.bool_)
    materials = [scene.meshes[item.mesh].face_material for item in scene.objects]
    material = np.concatenate(materials) if materials else np.zeros(0, np.int32)
    count = min(len(material), world.face_count)
    cut_out[:count] = holes[material[:count]]
    return world.face_casts & ~(cut_out & (world.face_openness >= CUT_OUT)) & (world.face_openness < INVISIBLE)
