"""What the bake makes of objects that are too many or too fine for values at their vertices.

Lengths are metres relative to `World.origin`; `k` counts the falloff distances, 1 is open.
"""

from __future__ import annotations

from dataclasses import dataclass

from bake.arrays import BoolArray, Float32Array, Float64Array, Int32Array, UInt8Array


@dataclass(frozen=True, slots=True)
class FogBoxes:
    """Shrubs as boxes of fog (Sloan et al. 2013, section 2.1).

    Attributes:
        object: Shape (b,), int32, index into `World.object_paths`.
        minimum, maximum: Shape (b, 3), float32.
        given_density: Shape (b,), float32, 1/m: what the object or the settings ask for.
        density: Shape (b,), float32, 1/m: what is traced, lowered where boxes overlap.
    """

    object: Int32Array
    minimum: Float32Array
    maximum: Float32Array
    given_density: Float32Array
    density: Float32Array

    def __len__(self) -> int:
        return len(self.object)


@dataclass(frozen=True, slots=True)
class TreeVolume:
    """Spherical obscurance on a sparse two-level grid over all tree boxes (Sloan et al. 2013, section 2.2).

    A brick is 8 × 8 × 8 cells; `top` says where a brick's voxels begin. Voxels are grid corners, shared by the bricks
    that touch them, so that every point inside a tree's box finds all its eight corners.

    Attributes:
        origin: Shape (3,), float64: position of the grid corner (0, 0, 0).
        spacing: Edge of a cell.
        top: Shape (bx, by, bz), int32: number of the brick, -1 where there is none.
        brick_voxels: Shape (bricks, 9, 9, 9), int32: voxel of each corner of a brick's cells, -1 where none is needed.
        voxel: Shape (v, 3), int32: grid coordinates.
        sh: Shape (v, 9, k), float32: quadratic spherical harmonics of ρ over the sphere, not convolved.
        valid: Shape (v,), uint8: 1 as traced, 0 filled from valid neighbours because it saw too many back faces.
    """

    origin: Float64Array
    spacing: float
    top: Int32Array
    brick_voxels: Int32Array
    voxel: Int32Array
    sh: Float32Array
    valid: UInt8Array

    @property
    def memory_bytes(self) -> int:
        """Memory of what an engine would keep."""
        return self.top.nbytes + self.brick_voxels.nbytes + self.sh.nbytes


@dataclass(frozen=True, slots=True)
class TreeModel:
    """Local AO of one tree mesh, baked alone.

    Attributes:
        mesh: Index into `Scene.meshes`.
        local_ao: Shape (n, k), float32, in [0, 1], one a vertex of the mesh.
    """

    mesh: int
    local_ao: Float32Array


@dataclass(frozen=True, slots=True)
class TreeFits:
    """Global AO of each tree: G(x) = y0 + y1 x + y2 y + y3 z about the tree's centre.

    The AO at a vertex at x with local AO L is L G(x - centre) (Sloan et al. 2013, equation 3).

    Attributes:
        object: Shape (t,), int32, index into `World.object_paths`.
        model: Shape (t,), int32, index into the models.
        centre: Shape (t, 3), float64, world metres relative to `World.origin`.
        coefficients: Shape (t, 4, k), float32.
        rmse_global, rmse_product: Shape (t, k), float32: error of the best linear function alone, and of the model,
            against the gold signal as traced directly on the tree.
        terms: Shape (t, k), uint8: how many of the four terms the tree's shape determined.
        rmse_volume: Shape (t, k), float32: error of the volume that the model was fitted to.
    """

    object: Int32Array
    model: Int32Array
    centre: Float64Array
    coefficients: Float32Array
    rmse_global: Float32Array
    rmse_product: Float32Array
    terms: UInt8Array
    rmse_volume: Float32Array


@dataclass(frozen=True, slots=True)
class SmallScalars:
    """One value for each small decorator: the baked AO of the surface around it.

    Attributes:
        object: Shape (d,), int32, index into `World.object_paths`.
        ao: Shape (d, k), float32, in [0, 1].
        found: Shape (d,), bool: whether its sphere met a baked surface; if not, its value is 1.
    """

    object: Int32Array
    ao: Float32Array
    found: BoolArray


@dataclass(frozen=True, slots=True)
class Decorators:
    """All of it; None where the scene has none.

    Attributes:
        fog: Shrubs as occluders.
        volume, models, fits: Large decorators: trees.
        shrub_scalars, small_scalars: Small ones: one scalar each.
    """

    fog: FogBoxes | None = None
    volume: TreeVolume | None = None
    models: tuple[TreeModel, ...] = ()
    fits: TreeFits | None = None
    shrub_scalars: SmallScalars | None = None
    small_scalars: SmallScalars | None = None


READ_ENOUGH = 8
"""A sphere of `ReadingSpheres` is wide enough when one in this many of its rays meets surface that counts."""

READ_DOUBLINGS = 12
"""Most radii that are tried for a sphere, each twice the one before."""

READ_LAYERS = 16
"""Most surfaces that one ray passes on its way to a sphere's centre."""

READ_LEAST_WEIGHT = 1e-6
"""Weight, in radii, of a hit on a sphere's very boundary: it still is a hit."""


@dataclass(frozen=True, slots=True)
class ReadingSpheres:
    """Spheres in which baked AO is to be read off the surface (Sloan et al. 2013, section 2.2.1).

    Attributes:
        centre: Shape (n, 3), float64.
        least, most: Shape (n,), float64, metres, above 0: a sphere begins with the least radius and doubles it until
            one ray in `READ_ENOUGH` meets surface that counts, up to the most.
        row: Shape (n,), int32: row of the reader's table that says which objects count; -1: all do.
        own_face: Shape (n,), int32: surface that faces away from this face does not count; -1: either side does.
    """

    centre: Float64Array
    least: Float64Array
    most: Float64Array
    row: Int32Array
    own_face: Int32Array

    def __len__(self) -> int:
        return len(self.centre)


@dataclass(frozen=True, slots=True)
class Readings:
    """What the spheres found.

    Attributes:
        ao: Shape (n, k), float64, in [0, 1]; 1 where nothing was found.
        hits: Shape (n,), int32: rays that met surface that counts, within the widest sphere in which any did.
        rays: Rays traced in all, those that went on behind a surface included.
    """

    ao: Float64Array
    hits: Int32Array
    rays: int
