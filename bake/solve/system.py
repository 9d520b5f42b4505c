"""The linear system of the least squares mapping: data, regulariser and prior in one matrix.

    (M + α R + diag(p)) x = b + p x̄

with p = r m where a vertex has samples (`bake.solve.prior`). A starved vertex has no row in M: it is tied to its
neighbours by a weak graph Laplacian on its faces' own area (which fills it harmonically), by α R where it lies across a
butterfly, and by a last tiny weight to the filled average, so that the matrix is positive definite whatever the mesh.

x is linear in the samples as long as no bound is active and r is held fixed: the system keeps what an adjoint needs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from bake.solve.average import weighted_average
from bake.solve.mass import FaceMoments, at_corners, mass_entries, right_hand_side, spread_pairs
from bake.solve.prior import prior_strength
from bake.solve.regulariser import edge_terms
from bake.solve.surface import Surface
from bake.types import BoolArray, Float64Array

STARVED = 0.1
"""Weight of the Laplacian that fills starved vertices, in units of their faces' area."""

ANCHOR = 1e-3
"""Weight that ties a starved vertex to the filled average, in units of its Laplacian."""


@dataclass(frozen=True, slots=True)
class System:
    """One matrix for all distances.

    Attributes:
        matrix: Shape (u, u), symmetric positive definite, m².
        rhs: Shape (u, k), float64, m².
        average: Shape (u, k), float64, in [0, 1]: the filled weighted average, the prior's centre and the first guess.
        strength: Shape (u,), float64: r.
        mass: Shape (u,), float64, m²: lumped mass; a sample's value enters `rhs` with (1 + r) dA φ.
        starved: Shape (u,), bool: unknowns without a valid sample.
        limited: Butterflies whose regulariser was bounded.
    """

    matrix: csr_array
    rhs: Float64Array
    average: Float64Array
    strength: Float64Array
    mass: Float64Array
    starved: BoolArray
    limited: int


def build_system(surface: Surface, moments: FaceMoments, operator: Float64Array, alpha: Float64Array) -> System:
    """Assembles the system.

    Args:
        surface: The welded surface.
        moments: Sums of the valid samples.
        operator: From `bake.solve.regulariser.operators`.
        alpha: Shape (m,), float64: alpha of each face.
    """
    mass = at_corners(surface, moments.mass)
    data = right_hand_side(surface, moments)
    average, starved = weighted_average(surface, mass, data)

    degree = np.maximum(np.bincount(surface.corners.ravel(), minlength=surface.unknown_count), 1)
    alpha_here = at_corners(surface, np.repeat(alpha[:, None], 3, axis=1)) / degree
    strength = np.where(starved, 0.0, prior_strength(surface, moments, alpha_here))

    diagonal, edges = mass_entries(surface, moments)
    fill_diagonal, fill_edges, fill_mass = _fill(surface, starved)
    terms = edge_terms(surface, operator, alpha, np.where(starved, fill_mass, mass))
    pull = np.where(starved, ANCHOR * fill_mass, strength * mass)
    matrix = surface.matrix(
        diagonal + terms.diagonal + fill_diagonal + pull, edges + terms.edges + fill_edges, terms.wings
    )
    rhs = data + pull[:, None] * average
    return System(matrix, rhs, average, strength, mass, starved, terms.limited)


def _fill(surface: Surface, starved: BoolArray) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Diagonal (u,) and edge entries (e,) of the Laplacian on faces with a starved corner, and its scale (u,)."""
    touched = starved[surface.corners].any(axis=1)
    typical = surface.area.mean() if len(surface.area) else 1.0
    # degenerate faces carry the fill too, lest their corners hang on nothing
    weight = np.where(touched, STARVED / 12.0 * np.maximum(surface.area, 1e-9 * max(typical, 1e-300)), 0.0)
    per_corner = np.repeat(weight[:, None], 3, axis=1)
    scale = at_corners(surface, 4.0 * per_corner)
    diagonal, edges = spread_pairs(surface, at_corners(surface, 2.0 * per_corner), -per_corner)
    return diagonal, edges, scale
