"""Scene files in, flat world out.

`load_scene` reads glTF, OBJ and PLY with roles and side file (`load_unchecked` and `looked_over` are its two halves);
`flatten` makes the `World` that everything after it works on, and `samplable_faces` tells which faces have enough
surface; `hash_files` tells cheaply whether a scene has changed, and `read_bake_options` what its side file asks for.
"""

from bake.scene.files import hash_files
from bake.scene.flatten import flatten
from bake.scene.load import load_scene, load_unchecked, looked_over
from bake.scene.side_file import read_bake_options
from bake.scene.surface import samplable_faces

__all__ = [
    "flatten",
    "hash_files",
    "load_scene",
    "load_unchecked",
    "looked_over",
    "read_bake_options",
    "samplable_faces",
]
