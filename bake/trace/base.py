"""The interface that every tracer fulfils."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from types import TracebackType
from typing import Self

import numpy as np

from bake.change_types import WorldChange
from bake.decorator_types import FogBoxes
from bake.errors import SettingsError
from bake.settings import BakeSettings
from bake.trace.records import RayRecords
from bake.types import BoolArray, Float32Array, Int32Array, SampleSet, Tally, UInt16Array, UInt32Array, World


@dataclass(frozen=True, slots=True)
class Hits:
    """Closest hits of plain rays.

    Attributes:
        distance: Shape (n,), float32, metres; inf for a miss.
        face: Shape (n,), int32, index into `World.faces`; -1 for a miss.
        cosine: Shape (n,), float32: of direction and geometric normal; positive where the back is struck.
        weights: Shape (n, 2), float32: barycentric weights of corners 0 and 1.
    """

    distance: Float32Array
    face: Int32Array
    cosine: Float32Array
    weights: Float32Array


@dataclass(frozen=True, slots=True)
class SphereTally:
    """What the rays from points in space found in all directions.

    Attributes:
        sh: Shape (n, 9, k), float32: spherical harmonics of the open share ρ over the sphere, not convolved, in the
            order of `bake/spherical_harmonics.py`; in the open the first is √(4π) and the others 0.
        directions: Rays traced from each point.
        hits: Shape (n,), uint16: rays that met a face within the bake's longest distance.
        back_faces: Shape (n,), uint16: those that struck the back of a one-sided face, grazing and edge hits excepted.
    """

    sh: Float32Array
    directions: int
    hits: UInt16Array
    back_faces: UInt16Array

    def __len__(self) -> int:
        return len(self.sh)

    def valid(self, threshold: float) -> BoolArray:
        """Points whose back faces are at most `threshold` of their hits, shape (n,)."""
        return self.back_faces <= threshold * self.hits


class Tracer(ABC):
    """Traces one world with one set of settings; close it, or use it in a `with` statement.

    Besides the casting faces, that stop rays, a world may have fog boxes and trees, that dim them. A ray that ends at
    distance d counts for

        ρ(d) exp(-Σ σ L - Σ -ln(o + (1 - o) τ))

    over the boxes of density σ that it crosses on a length L within [0, d], and the tree triangles of openness o and
    transmission τ that it crosses there; where nothing stops it, ρ is 1 and d the bake's longest distance. A ray that
    starts inside a box counts from its origin. The exponent ends at 40.

    Attributes:
        name: "embree", "warp" or "brute".
        device: "cpu" or the CUDA device's name.
        batch_size: Samples a call of `accumulate` handles well: large enough to keep the device busy, small enough
            that Cancel answers at once.
        fog: The boxes that it was made with, in their own order; None if there are none.
        fog_boxes, tree_triangles: How many of them dim rays; of what there is none, nothing was built.
    """

    name: str
    device: str
    batch_size: int
    fog: FogBoxes | None = None
    fog_boxes: int = 0
    tree_triangles: int = 0

    def __init__(self, world: World, settings: BakeSettings) -> None:
        self.world = world
        self.settings = settings

    @abstractmethod
    def accumulate(self, samples: SampleSet, batch: slice, tally: Tally, *, rays: int | None = None) -> None:
        """Traces the rays of the samples in `batch` and writes their rows of `tally`.

        Every sample sends exactly `rays` rays, `settings.rays` if None; `tally.rays` says so afterwards. They are the
        block number `SampleSet.index` of that many points of its face's sequence.
        """

    @abstractmethod
    def nearest(self, origins: Float32Array, directions: Float32Array, t_max: float) -> Hits:
        """Closest hits within `t_max` metres of plain rays, shape (n, 3) each; directions have unit length.

        Origins are relative to `World.origin`. Partly open faces count as hits.
        """

    @abstractmethod
    def transmittance(self, origins: Float32Array, directions: Float32Array, distance: float) -> Float32Array:
        """What fog and trees let through along plain rays up to `distance` metres, shape (n,), whatever is opaque.

        Origins and directions have shape (n, 3) each, as for `nearest`.
        """

    @abstractmethod
    def gather_sphere(
        self, points: Float32Array, seeds: UInt32Array, directions: int, *, trees: bool = True
    ) -> SphereTally:
        """Open share in all directions around points in space, as quadratic spherical harmonics for every distance.

        A ray is followed and weighed like those of `accumulate`. Directions are the first points of one Owen-scrambled
        Sobol sequence a point, spread evenly over the sphere. Send about `points_at_once` points a call.

        Args:
            points: Shape (n, 3), metres relative to `World.origin`.
            seeds: Shape (n,), uint32: scrambles, one a point.
            directions: Rays from each point, 1 to 65,535.
            trees: Whether trees attenuate.

        Raises:
            SettingsError: `directions` is out of its bounds.
        """

    @abstractmethod
    def record(self, samples: SampleSet) -> RayRecords:
        """The rays of some samples one by one, exactly as `accumulate` sends them.

        Keep it to some thousand samples: 64 rays of one take 3 kB.
        """

    @abstractmethod
    def meets(
        self, samples: SampleSet, wanted: int, low: Float32Array, high: Float32Array, *, rays: int | None = None
    ) -> BoolArray:
        """Which samples have a ray that meets an object, shape (n,): those that would change without it.

        Args:
            samples: Shape (n,).
            wanted: Object whose casting faces a ray must strike, whether or not one stops it; -1 if crossing a box is
                enough, as for fog and trees.
            low, high: Shape (b, 3) each, float32, relative to `World.origin`: boxes around the object; rays that miss
                them all are not followed.
            rays: How many of each, as for `accumulate`.
        """

    @abstractmethod
    def trace_without(self, samples: SampleSet, wanted: int, fog: FogBoxes | None, *, rays: int | None = None) -> Tally:
        """Traces some samples as if one object did not cast: every ray goes on behind it, to the bit as it would.

        Args:
            samples: Shape (n,).
            wanted: The object whose faces do not cast, nor dim if it is a tree.
            fog: The boxes as they are without it; None if there are none.
            rays: How many of each, as for `accumulate`.
        """

    @abstractmethod
    def updated(self, world: World, change: WorldChange, fog: FogBoxes | None) -> Tracer:
        """A tracer of an edited world, which finds what one made anew would find, but for ties of coincident faces.

        What it can keep of this one it shares: Embree's BVH with the faces that are gone passed over and those that
        were added in a second one, until a fifth of them has changed. Both tracers may be used, and have to be closed,
        in any order.

        Args:
            world: The edited world; its origin is that of this tracer's.
            change: How it follows from this tracer's.
            fog: Its boxes; None if there are none.

        Raises:
            DeviceError: the tracer's library failed.
            OutOfMemoryError: the edited scene does not fit.
        """

    def points_at_once(self, directions: int) -> int:
        """Points that a call of `gather_sphere` handles well, as `batch_size` says for samples."""
        return max(1, self.batch_size * self.settings.rays // directions)

    @abstractmethod
    def close(self) -> None:
        """Frees what the tracer holds; it cannot be used afterwards."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def check_directions(directions: int) -> None:
    """Refuses a number of directions that cannot be counted.

    Raises:
        SettingsError: it is below 1 or above 65,535.
    """
    if not 1 <= directions <= np.iinfo(np.uint16).max:
        raise SettingsError(f"{directions} directions over the sphere", where="trace", remedy="use 1 to 65535")
