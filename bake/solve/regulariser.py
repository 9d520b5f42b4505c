"""The edge regulariser, bounded against the data.

The textbook term of a butterfly with faces of area A₁ and A₂ is G_e = (A₁ + A₂) · jump, in metres, so that
xᵀRx = Σ (G_e x)² has the unit of the mass matrix and alpha has none (Sloan et al. 2013; NVIDIA's baking sample).

On real levels that term is far stiffer than the data wherever a large face meets a small or a thin one: it then glues
the small face's values to the large one's plane with thousands of times the small face's weight, which makes values
overshoot and conjugate gradients crawl. Scaling the whole operator down keeps its null space, constants and functions
affine across the pair, so each edge is held to

    α_e g_i² ≤ α m_i   for each of its four vertices i,

m the lumped mass: smoothing never outweighs the vertex's own samples by more than alpha. On a regular grid of
equilateral triangles the textbook term has g² = 1.15 m, so there the bound hardly shows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.solve.surface import Surface
from bake.types import Float64Array


@dataclass(frozen=True, slots=True)
class EdgeTerms:
    """Entries of α R on the pattern of the surface.

    Attributes:
        diagonal: Shape (u,), m².
        edges: Shape (e,), m².
        wings: Shape (w,), m².
        limited: Butterflies whose strength was bounded.
    """

    diagonal: Float64Array
    edges: Float64Array
    wings: Float64Array
    limited: int


def operators(surface: Surface) -> Float64Array:
    """Textbook G_e of every butterfly on its unknowns (a, b, c, d), shape (w, 4), float64, metres."""
    return surface.butterflies.jump * surface.butterflies.area.sum(axis=1)[:, None]


def edge_terms(surface: Surface, operator: Float64Array, alpha: Float64Array, mass: Float64Array) -> EdgeTerms:
    """α R, bounded.

    Args:
        surface: The welded surface.
        operator: From `operators`.
        alpha: Shape (m,), float64: alpha of each face; a butterfly takes the mean of its two.
        mass: Shape (u,), float64, m²: lumped mass that bounds the strength.
    """
    wings = surface.butterflies
    strength = alpha[wings.faces].mean(axis=1)
    square = operator * operator
    with np.errstate(divide="ignore"):
        share = np.minimum(1.0, (mass[wings.stencil] / square).min(axis=1, initial=np.inf))
    weight = strength * share
    a, b, c, d = operator.T
    diagonal = np.bincount(wings.stencil.ravel(), (square * weight[:, None]).ravel(), minlength=surface.unknown_count)
    edges = np.bincount(wings.hinge, weight * a * b, minlength=len(surface.edges))
    products = np.column_stack([a * c, b * c, a * d, b * d]) * weight[:, None]
    edges += np.bincount(wings.sides.ravel(), products.ravel(), minlength=len(surface.edges))
    limited = int(np.count_nonzero((share < 1.0) & (strength > 0.0)))
    return EdgeTerms(diagonal, edges, weight * c * d, limited)
