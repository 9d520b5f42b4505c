"""What an explanation of one spot consists of: what the engine hands to the command line and the window.

Lengths are metres, positions are relative to `World.origin`, `k` counts the falloff distances. The identity behind it:

    1 - value = Σ_s weight_s (1 - AO_s) + bounds = Σ_objects share

where the sum runs over the samples, (1 - AO_s) is what the rays of a sample lose to each object, and `bounds` is how
far the bounds 0 and 1 of the solve hold the value away from what the samples alone ask for.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass, replace

from bake.arrays import BoolArray, Float32Array, Float64Array, Int32Array, Int64Array, UInt8Array
from bake.settings import MappingKind


@dataclass(frozen=True, slots=True)
class Spot:
    """A point of the surface: a weighted mean of the vertices of one face, or a single vertex.

    Attributes:
        position: Shape (3,), float64.
        normal: Shape (3,), float64, unit, on the side that the face shows.
        object: Index into `World.object_paths`.
        face: Index into `World.faces`; one of the vertex's faces if the spot is a vertex.
        vertices: Shape (1,) or (3,), int64, index into `World.positions`.
        weights: Same shape, float64: what each vertex's value counts for; they add up to 1.
    """

    position: Float64Array
    normal: Float64Array
    object: int
    face: int
    vertices: Int64Array
    weights: Float64Array

    @property
    def is_vertex(self) -> bool:
        """Whether the spot is one vertex."""
        return len(self.vertices) == 1


@dataclass(frozen=True, slots=True)
class WeighedSamples:
    """The samples that make up the value, the heaviest first.

    Attributes:
        index: Shape (n,), int64, index into the result's `SampleSet`.
        weight: Shape (n,), float64: change of the value per change of the sample's AO, the same for every distance;
            may be negative, adds up to 1.
        ao: Shape (n, k), float32: the samples' own AO.
        position: Shape (n, 3), float64.
        normal: Shape (n, 3), float64: unit shading normal about which the rays are sent.
        face: Shape (n,), int32.
        object: Shape (n,), int32: the object that the sample lies on.
        distance: Shape (n,), float64: from the spot, straight.
        own: Shape (n,), bool: on a face that touches the spot; what comes from others was carried here by the fit.
        traced: How many of them, from the first, were traced again.
    """

    index: Int64Array
    weight: Float64Array
    ao: Float32Array
    position: Float64Array
    normal: Float64Array
    face: Int32Array
    object: Int32Array
    distance: Float64Array
    own: BoolArray
    traced: int

    def __len__(self) -> int:
        return len(self.index)


@dataclass(frozen=True, slots=True)
class Crossings:
    """Where rays pass fog and leaves.

    Attributes:
        ray: Shape (c,), int64: flat number of the ray, (row of the sample) × (rays a sample) + ray.
        object: Shape (c,), int32: the shrub or tree.
        depth: Shape (c,), float32: optical depth; the ray keeps exp(-depth).
    """

    ray: Int64Array
    object: Int32Array
    depth: Float32Array


@dataclass(frozen=True, slots=True)
class TracedRays:
    """The rays of the traced samples, exactly as the bake sent them: t samples of r rays each.

    Where rays were adaptive, r is the most of a sample; the rays of one that sent fewer stand there again and again, so
    that means over r are those of what was sent.

    Attributes:
        sample: Shape (t,), int64, index into the result's `SampleSet`: the first t of `WeighedSamples.index`.
        origin: Shape (t, 3), float32.
        direction: Shape (t, r, 3), float32, unit.
        distance: Shape (t, r), float32: to what stopped the ray; the bake's longest distance if nothing did.
        face: Shape (t, r), int32: the face that stopped it; -1 if none did.
        object: Shape (t, r), int32: the face's object; -1 if none.
        first_face: Shape (t, r), int32: the first face met, which may be partly open and was passed; -1 if none.
        back: Shape (t, r), bool: the first face met showed its back, which counts against the sample.
        mirrored: Shape (t, r), bool: the direction lay below the face and was mirrored in its plane.
        rho: Shape (t, r, k), float32: ρ(distance), 1 if nothing stopped the ray.
        passes: Shape (t, r), float32: share that fog and trees let through; the ray counts for rho × passes.
        crossings: Which fog and trees.
        sent: Shape (t,), int64: rays that each sample sent.
    """

    sample: Int64Array
    origin: Float32Array
    direction: Float32Array
    distance: Float32Array
    face: Int32Array
    object: Int32Array
    first_face: Int32Array
    back: BoolArray
    mirrored: BoolArray
    rho: Float32Array
    passes: Float32Array
    crossings: Crossings
    sent: Int64Array

    @property
    def open_share(self) -> Float32Array:
        """What each ray counts for, shape (t, r, k); its mean over the rays is the sample's AO."""
        return self.rho * self.passes[:, :, None]

    def first(self, samples: int) -> TracedRays:
        """The rays of the first samples only."""
        rays = self.face.shape[1]
        keep = self.crossings.ray < samples * rays
        crossed = Crossings(self.crossings.ray[keep], self.crossings.object[keep], self.crossings.depth[keep])
        return TracedRays(
            sample=self.sample[:samples],
            origin=self.origin[:samples],
            direction=self.direction[:samples],
            distance=self.distance[:samples],
            face=self.face[:samples],
            object=self.object[:samples],
            first_face=self.first_face[:samples],
            back=self.back[:samples],
            mirrored=self.mirrored[:samples],
            rho=self.rho[:samples],
            passes=self.passes[:samples],
            crossings=crossed,
            sent=self.sent[:samples],
        )


class ShareKind(enum.StrEnum):
    """What a share of the darkness belongs to."""

    OBJECT = "object"
    BOUNDS = "bounds"  # what holding values between 0 and 1 changes, here or nearby; often negative
    UNTRACED = "untraced"  # samples too light to be traced again; their AO is known, their occluders are not
    RESIDUAL = "residual"  # rounding, the solver's tolerance, and rays that another device saw differently


@dataclass(frozen=True, slots=True)
class Share:
    """How much of 1 - value one occluder takes.

    Attributes:
        kind: What it belongs to.
        object: Index into `World.object_paths`; -1 if it belongs to no object.
        name: The object's path, or a name in brackets.
        share: Shape (k,), float64; all shares add up to 1 - value. Negative where negative weights prevail.
        own: Shape (k,), float64: the part that samples on the spot's own faces saw.
        is_self: The object is the one that the spot lies on.
        rays: Traced rays that it stops or dims.
        nearest: Distance of the nearest of them, metres; inf if there is none. Fog and trees count from the origin.
    """

    kind: ShareKind
    object: int
    name: str
    share: Float64Array
    own: Float64Array
    is_self: bool
    rays: int
    nearest: float

    @property
    def carried(self) -> Float64Array:
        """The part that the fit brought here from other faces, shape (k,)."""
        return self.share - self.own


@dataclass(frozen=True, slots=True)
class Carried:
    """What the fit brought to the spot from samples that lie elsewhere: on one object, and between two distances.

    Attributes:
        object: The object that the samples lie on.
        nearest, farthest: Distances from the spot between which they lie, metres.
        weight: Sum of their weights.
        share: Shape (k,), float64: their part of 1 - value.
        samples: How many.
    """

    object: int
    nearest: float
    farthest: float
    weight: float
    share: Float64Array
    samples: int


@dataclass(frozen=True, slots=True)
class Held:
    """A vertex that the bounds hold at 0 or 1, and what that does to the spot.

    Attributes:
        vertex: Index into `World.positions`.
        bound: Shape (k,), float64: 0 or 1; NaN at distances where it is not held.
        effect: Shape (k,), float64: what the spot's value gains by it; above 0 at the lower bound.
    """

    vertex: int
    bound: Float64Array
    effect: Float64Array


@dataclass(frozen=True, slots=True)
class Explanation:
    """Why a spot has the value that it has.

    Attributes:
        spot: Where.
        distances: The distance of each column, metres.
        value: Shape (k,), float64: the baked value, in [0, 1].
        mapping: How samples became vertex values.
        filled: No valid sample lies around the spot: its value was filled from its neighbours.
        samples: What it is made of.
        rays: How the heaviest samples see their surroundings.
        shares: Who takes away how much, the largest at the longest distance first; they add up to 1 - value.
        carried: What the fit brought from other faces, by object and distance.
        held: Vertices that the bounds hold and that matter here, the strongest first.
        unbounded: Shape (k,), float64: Σ weight × AO, what the samples alone ask for; may leave 0 to 1.
        weight_sum: Sum of the weights, which is 1 as constants are reproduced.
        cut_off: Bound on the error of `unbounded` by leaving out samples of next to no weight.
        retrace_error: Largest difference between a traced sample's AO now and as stored.
        seconds: What it took.
    """

    spot: Spot
    distances: tuple[float, ...]
    value: Float64Array
    mapping: MappingKind
    filled: bool
    samples: WeighedSamples
    rays: TracedRays
    shares: tuple[Share, ...]
    carried: tuple[Carried, ...]
    held: tuple[Held, ...]
    unbounded: Float64Array
    weight_sum: float
    cut_off: float
    retrace_error: float
    seconds: float

    @property
    def darkness(self) -> Float64Array:
        """1 - value, shape (k,)."""
        return 1.0 - self.value

    @property
    def own_weight(self) -> float:
        """Weight of the samples on the spot's own faces."""
        return float(self.samples.weight[self.samples.own].sum())

    @property
    def occluders(self) -> tuple[Share, ...]:
        """The shares that belong to objects."""
        return tuple(share for share in self.shares if share.kind is ShareKind.OBJECT)

    def with_rays_of(self, samples: int) -> Explanation:
        """The same with the rays of the heaviest samples alone: enough to draw, and light to send."""
        return replace(self, rays=self.rays.first(samples))


@dataclass(frozen=True, slots=True)
class SpotWithout:
    """The spot's value if one object did not cast.

    Attributes:
        object: Index into `World.object_paths`; it goes on receiving.
        before, after: Shape (k,), float64, in [0, 1].
        samples: Samples that were traced again because a ray of theirs met the object.
        became_valid, became_invalid: Samples whose back-face share crossed the threshold.
        is_estimate: The object is seen from all over the scene, which changes how much its noise is trusted everywhere:
            the value may be off by some thousandths until `Explainer.without_object` has seen the whole surface.
        seconds: What it took.
    """

    object: int
    before: Float64Array
    after: Float64Array
    samples: int
    became_valid: int
    became_invalid: int
    is_estimate: bool
    seconds: float


@dataclass(frozen=True, slots=True)
class SurfaceWithout:
    """The whole surface if one object did not cast.

    Attributes:
        object: Index into `World.object_paths`; it goes on receiving.
        ao: Shape (n, k), float32: as `VertexField.ao`; values that are no fit of samples (LODs) stay as they were.
        state: Shape (n,), uint8, a `VertexState`.
        samples: Samples that were traced again because a ray of theirs met the object.
        became_valid, became_invalid: Samples whose back-face share crossed the threshold.
        rays: Rays traced.
        seconds: What it took.
    """

    object: int
    ao: Float32Array
    state: UInt8Array
    samples: int
    became_valid: int
    became_invalid: int
    rays: int
    seconds: float
