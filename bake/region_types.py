"""What the bake makes of the space in which objects move: visibility regions and their models.

Lengths are metres relative to `World.origin`; `k` counts the falloff distances, 1 is open. A model's spherical
harmonics are already convolved with the clamped cosine and divided by π: evaluated at a normal they give AO.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass

from bake.arrays import Float32Array, Float64Array, Int32Array, UInt8Array

GRID = 8  # points along each edge of a region (Sloan et al. 2013, section 2.3)
PARAMETERS = 7  # mean, then the derivatives toward +x, -x, +y, -y, +z, -z


class PointState(enum.IntEnum):
    """What became of a grid point of a region; the stored code of `RegionPoints.state`."""

    VALID = 0
    UNREACHABLE = 1  # its bit is not set: inside geometry, or cut off from the region's seed
    BACK_FACES = 2  # traced, but it sees too many back faces


class CentreKind(enum.IntEnum):
    """Which centre a model was given; the stored code of `RegionModels.centre_kind`."""

    BOX = 0  # the region's own centre
    MASS = 1  # the centre of mass of its valid points
    OPTIMISED = 2


@dataclass(frozen=True, slots=True)
class RegionGraph:
    """Axis-aligned boxes, which may overlap, and which of them touch.

    Attributes:
        names: r unique names.
        minimum, maximum: Shape (r, 3), float64.
        seed: Shape (r, 3), float64: a point in the region's free space, from which its validity is flooded.
        link: Shape (l, 2), int32, regions a < b, no pair twice.
        link_area: Shape (l,), float64, m²: w_ab, how much boundary they share.
        link_centre: Shape (l, 3), float64: b_ab, the middle of that boundary.
        origin: "file", "scene" or "automatic".
    """

    names: tuple[str, ...]
    minimum: Float64Array
    maximum: Float64Array
    seed: Float64Array
    link: Int32Array
    link_area: Float64Array
    link_centre: Float64Array
    origin: str

    def __len__(self) -> int:
        return len(self.names)


@dataclass(frozen=True, slots=True)
class RegionPoints:
    """The grid points of all regions, sorted by region, GRID³ each in the order x slowest, z fastest.

    Attributes:
        position: Shape (r · GRID³, 3), float32.
        state: Shape (r · GRID³,), uint8, a `PointState`.
        back_face_share: Shape (r · GRID³,), float32, in [0, 1]; 0 where nothing was traced.
        traced: Shape (t,), int32: the points that were traced, ascending.
        sh: Shape (t, 9, k), float32: convolved spherical harmonics of each traced point.
        windowed: Shape (t,), uint8: 1 where bands were lowered against ringing.
    """

    position: Float32Array
    state: UInt8Array
    back_face_share: Float32Array
    traced: Int32Array
    sh: Float32Array
    windowed: UInt8Array


@dataclass(frozen=True, slots=True)
class RegionModels:
    """One model a region: M(p) = v_mean + Σ_i (p - c)_i v_{2i + s_i} (Sloan et al. 2013, equation 4).

    Attributes:
        centre: Shape (r, 3), float64.
        coefficients: Shape (r, 7, 9, k), float32: parameters in the order of PARAMETERS, derivatives in 1/m and signed
            as d/dx_i on both sides (s_i is 0 where (p - c)_i >= 0).
        terms: Shape (r,), uint8: bit j is set where the points determined parameter j.
        centre_kind: Shape (r,), uint8, a `CentreKind`.
        rmse: Shape (r, k), float32: error at the valid points over six axis normals; NaN without points.
    """

    centre: Float64Array
    coefficients: Float32Array
    terms: UInt8Array
    centre_kind: UInt8Array
    rmse: Float32Array

    def __len__(self) -> int:
        return len(self.centre)


@dataclass(frozen=True, slots=True)
class Regions:
    """All of it, as it is stored.

    Attributes:
        graph: All regions and links. A region that was absorbed keeps its box: only its model is another's.
        points: Their grid points.
        fitted: Each region's model as fitted to its own points; an absorbed region has its owner's.
        regularised: The models that an engine uses.
        mismatch_before, mismatch_after: Shape (l, k), float32: |M_a(b) - M_b(b)| at each link, AO cut off at 0 and 1,
            the largest over six axis normals, of `fitted` and `regularised`.
        absorbed: Names of the regions that were absorbed and of those that took them up, in order.
        absorbed_error: Shape (absorbed, k), float32: RMSE that the absorption cost at the absorbed region's points.
        owner: Shape (r,), int32: the region whose model each one uses; its own number unless it was absorbed.
    """

    graph: RegionGraph
    points: RegionPoints
    fitted: RegionModels
    regularised: RegionModels
    mismatch_before: Float32Array
    mismatch_after: Float32Array
    absorbed: tuple[tuple[str, str], ...]
    absorbed_error: Float32Array
    owner: Int32Array
