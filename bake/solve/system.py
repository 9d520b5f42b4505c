"""The linear system of the least squares mapping: data, regulariser and prior in one matrix for all distances.

    (M + α R + diag(p)) x = b + p x̄

with p = r m where a vertex has samples (`bake.solve.prior`). A starved vertex has no row in M: it is tied to its
neighbours by a graph Laplacian on its faces' own area, which fills it harmonically, by α R where a butterfly reaches
it, and by a last small weight to the filled average, so that the matrix is positive definite whatever the mesh. All
these weigh a millionth of the data: the fill follows its surroundings and does not move them. To the solver, which
scales the diagonal to one, that costs nothing.

x is linear in the samples as long as no bound is active and r is held fixed: the system keeps what an adjoint needs.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from bake.solve.average import weighted_average
from bake.solve.mass import FaceMoments, at_corners, mass_entries, right_hand_side, spread_pairs
from bake.solve.prior import SceneScatter, Trust, estimate_trust
from bake.solve.regulariser import EdgeTerms, bounded_share, edge_terms
from bake.solve.surface import Surface
from bake.types import BoolArray, Float64Array, Int64Array

STARVED = 1e-6
"""Weight of the Laplacian that fills starved vertices, in units of their faces' area."""

ANCHOR = 0.03
"""Weight that ties a starved vertex to the filled average, in units of its Laplacian."""

FILL_PULL = 0.1
"""Share of its Laplacian that bounds an edge's pull at a starved vertex, which has no samples to bound it."""

NARROWEST = 1e-4
"""What is narrower than this share of its longest side fills as if it were that wide: nothing but the face decides, so
that no other object has a say in it."""

POINT = 1e-6
"""Share of its object's mean face that a face of no length at all fills with."""

LARGE = 100_000
"""Faces from which on two halves of the assembly are worth doing side by side."""


@dataclass(frozen=True, slots=True)
class System:
    """One matrix for all distances.

    Attributes:
        matrix: Shape (u, u), symmetric positive definite, m².
        rhs: Shape (u, k), float64, m²; a sample's value enters with (1 + r) dA φ.
        average: Shape (u, k), float64, in [0, 1]: the filled weighted average, the prior's centre and the first guess.
        strength: Shape (u,), float64: r; 0 at starved unknowns.
    """

    matrix: csr_array
    rhs: Float64Array
    average: Float64Array
    strength: Float64Array


@dataclass(frozen=True, slots=True)
class Equations:
    """All of the system but alpha: made once for each set of values and validity.

    Attributes:
        mass: Shape (u,), float64, m²: lumped mass.
        data: Shape (u, k), float64, m²: b.
        average: Shape (u, k), float64, in [0, 1]: the filled weighted average.
        starved: Shape (u,), bool: unknowns without a valid sample.
        bounded: Shape (w,), bool: butterflies whose regulariser was bounded.
        surface: What they belong to.
        trust: How far the samples are to be trusted.
        diagonal, edges: Shape (u,) and (e,), m²: entries that do not depend on alpha: data and fill.
        anchor: Shape (u,), m²: what ties starved unknowns to the average.
        common: The regulariser for an alpha of 1, without faces of objects that have their own.
        own: The regulariser of those, at their own alpha; None if there are none.
        own_alpha: Shape (u,): their alpha at their unknowns, NaN elsewhere.
    """

    mass: Float64Array
    data: Float64Array
    average: Float64Array
    starved: BoolArray
    bounded: BoolArray
    surface: Surface
    trust: Trust
    diagonal: Float64Array
    edges: Float64Array
    anchor: Float64Array
    common: EdgeTerms
    own: EdgeTerms | None
    own_alpha: Float64Array | None

    @property
    def limited(self) -> int:
        """Butterflies whose regulariser was bounded."""
        return int(np.count_nonzero(self.bounded))

    def strength(self, alpha: float) -> Float64Array:
        """r, shape (u,), for the alpha of objects that have none of their own."""
        alpha_here = np.full(len(self.mass), alpha)
        if self.own_alpha is not None:
            alpha_here = np.where(np.isnan(self.own_alpha), alpha, self.own_alpha)
        return np.where(self.starved, 0.0, self.trust.strength(alpha_here))

    def pull(self, alpha: float) -> Float64Array:
        """The weight that ties each unknown to its average, shape (u,), m²."""
        return self.strength(alpha) * self.mass + self.anchor

    def main_diagonal(self, alpha: float) -> Float64Array:
        """The matrix's diagonal, shape (u,), m²."""
        diagonal = self.diagonal + self.pull(alpha) + alpha * self.common.diagonal
        return diagonal if self.own is None else diagonal + self.own.diagonal

    def right_hand_side(self, alpha: float) -> Float64Array:
        """Shape (u, k), m²."""
        return self.data + self.pull(alpha)[:, None] * self.average

    def entries(self, alpha: float, places: Int64Array) -> Float64Array:
        """The matrix's entries at some places of the surface's pattern, any shape."""
        edges, wings = self.edges + alpha * self.common.edges, alpha * self.common.wings
        if self.own is not None:
            edges += self.own.edges
            wings += self.own.wings
        values = np.concatenate([edges, wings, self.main_diagonal(alpha)])
        source = self.surface.order[places]
        source[source >= len(edges) + len(wings)] -= len(edges) + len(wings)  # the second of the two triangles
        return values[source]

    def system(self, alpha: float) -> System:
        """The system for the alpha of objects that have none of their own."""
        strength = self.strength(alpha)
        pull = strength * self.mass + self.anchor
        diagonal = self.diagonal + pull + alpha * self.common.diagonal
        edges = self.edges + alpha * self.common.edges
        wings = alpha * self.common.wings
        if self.own is not None:
            diagonal += self.own.diagonal
            edges += self.own.edges
            wings += self.own.wings
        matrix = self.surface.matrix(diagonal, edges, wings)
        return System(matrix, self.data + pull[:, None] * self.average, self.average, strength)


def build_equations(
    surface: Surface,
    moments: FaceMoments,
    own_alpha: Float64Array,
    scene: SceneScatter | None = None,
) -> Equations:
    """Assembles what does not depend on alpha.

    Args:
        surface: The welded surface.
        moments: Sums of the valid samples.
        own_alpha: Shape (m,), float64: alpha of faces whose object has its own, NaN elsewhere. A butterfly between
            two objects takes the larger.
        scene: The mean scatter of the whole scene, where `surface` is a part of it.
    """
    with ThreadPoolExecutor(1, "trust") as side:
        # large surfaces only: a thread costs more than it brings elsewhere, and blocks are done side by side
        alone = len(surface.corners) < LARGE
        trusting = None if alone else side.submit(estimate_trust, surface, moments, scene)
        mass = at_corners(surface, moments.mass)
        data = right_hand_side(surface, moments)
        average, starved = weighted_average(surface, mass, data)
        diagonal, edges = mass_entries(surface, moments)
        fill_diagonal, fill_edges, fill_scale = _fill(surface, starved)
        share = bounded_share(surface, np.where(starved, FILL_PULL * fill_scale, mass))
        of_all = edge_terms(surface, share) if np.isnan(own_alpha).all() else None
        trust = estimate_trust(surface, moments, scene) if trusting is None else trusting.result()

    own: EdgeTerms | None = None
    own_here: Float64Array | None = None
    common = share
    if not np.isnan(own_alpha).all():
        of_wing = np.fmax(*own_alpha[surface.butterflies.faces].T)
        common = np.where(np.isnan(of_wing), share, 0.0)
        own = edge_terms(surface, np.where(np.isnan(of_wing), 0.0, of_wing * share))
        own_here = np.full(surface.unknown_count, np.nan)
        np.fmax.at(own_here, surface.corners.ravel(), np.repeat(own_alpha, 3))
    return Equations(
        mass=mass,
        data=data,
        average=average,
        starved=starved,
        bounded=share < 1.0,
        surface=surface,
        trust=trust,
        diagonal=diagonal + fill_diagonal,
        edges=edges + fill_edges,
        anchor=np.where(starved, ANCHOR * fill_scale, 0.0),
        common=of_all or edge_terms(surface, common),
        own=own,
        own_alpha=own_here,
    )


def _fill(surface: Surface, starved: BoolArray) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Diagonal (u,) and edge entries (e,) of the Laplacian on faces with a starved corner, and its scale (u,)."""
    if not starved.any():
        return np.zeros(len(starved)), np.zeros(len(surface.edges)), np.zeros(len(starved))
    touched: BoolArray = np.asarray(starved[surface.corners].any(axis=1), np.bool_)
    # Degenerate faces carry the fill too, lest their corners hang on nothing: as much as if they were a little wider.
    weight = np.zeros(len(touched))
    corners = surface.position[surface.corners[touched]]
    least = POINT * np.maximum(surface.typical[touched], 1e-30)
    longest = np.square(corners - corners[:, [1, 2, 0]]).sum(axis=2).max(axis=1)
    weight[touched] = STARVED / 12.0 * np.maximum(surface.area[touched], np.maximum(NARROWEST * longest, least))
    per_corner = np.repeat(weight[:, None], 3, axis=1)
    diagonal, edges = spread_pairs(surface, at_corners(surface, 2.0 * per_corner), -per_corner)
    return diagonal, edges, at_corners(surface, 4.0 * per_corner)
