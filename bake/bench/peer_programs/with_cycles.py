"""Blender's Cycles: AO baked into a colour attribute, on the CPU, with EFFORT samples.

The last argument says which: "point", one colour a vertex of a smooth-shaded mesh, the mean of its corners' samples;
"smooth", one at each corner of each face of such a mesh; or "sharp", the same with edges above 30° marked sharp first.
"""

from __future__ import annotations

import sys
import time

import numpy as np


def main() -> int:
    """Bakes; the exit code is 3 where the library is missing."""
    try:
        import bpy
    except ImportError:
        return 3

    mesh_file, output, max_distance, effort = sys.argv[1], sys.argv[2], float(sys.argv[3]), int(sys.argv[4])
    at_corners = sys.argv[5] != "point"
    bpy.ops.wm.read_factory_settings(use_empty=True)
    begin = time.perf_counter()
    with np.load(mesh_file) as stored:
        positions, faces = stored["positions"], stored["faces"]
    mesh = bpy.data.meshes.new("level")
    mesh.vertices.add(len(positions))
    mesh.vertices.foreach_set("co", positions.astype(np.float32).ravel())
    mesh.loops.add(faces.size)
    mesh.loops.foreach_set("vertex_index", faces.astype(np.int32).ravel())
    mesh.polygons.add(len(faces))
    mesh.polygons.foreach_set("loop_start", np.arange(0, faces.size, 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    mesh.polygons.foreach_set("use_smooth", np.ones(len(faces), np.bool_))
    if sys.argv[5] == "sharp":
        mesh.set_sharp_from_angle(angle=np.radians(30.0))
    attribute = mesh.color_attributes.new("ao", "FLOAT_COLOR", "CORNER" if at_corners else "POINT")
    mesh.color_attributes.active_color = attribute
    level = bpy.data.objects.new("level", mesh)
    scene = bpy.context.scene
    scene.collection.objects.link(level)
    bpy.context.view_layer.objects.active = level
    level.select_set(True)
    mesh.materials.append(bpy.data.materials.new("plain"))
    scene.world = bpy.data.worlds.new("world")
    scene.world.light_settings.distance = max_distance
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = effort
    scene.cycles.use_adaptive_sampling = False
    bpy.ops.object.bake(type="AO", target="VERTEX_COLORS")
    colours = np.empty(4 * (faces.size if at_corners else len(positions)), np.float32)
    mesh.color_attributes["ao"].data.foreach_get("color", colours)
    np.save(output, colours.reshape((-1, 3, 4) if at_corners else (-1, 4))[..., 0])
    print(time.perf_counter() - begin)
    return 0


if __name__ == "__main__":
    sys.exit(main())
