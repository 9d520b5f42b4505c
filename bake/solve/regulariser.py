"""The edge regulariser, bounded against the data.

The textbook term of a butterfly with faces of area A₁ and A₂ is G_e = (A₁ + A₂) · jump, in metres, so that
xᵀRx = Σ (G_e x)² has the unit of the mass matrix and alpha has none (Sloan et al. 2013; NVIDIA's baking sample).

On real levels that term is far stiffer than the data wherever a large face meets a small or a thin one: it then glues
the small face's values to the large one's plane with thousands of times the small face's weight, which makes values
overshoot and conjugate gradients crawl. Scaling the whole operator down keeps its null space, constants and functions
affine across the pair, so each edge is held to

    g_i² ≤ m_i   for each of its four vertices i,

m the lumped mass: an edge never pulls at a vertex with more than alpha times the weight of the vertex's own samples. On
a regular grid of equilateral triangles the textbook term has g² = 1.15 m, so there the bound hardly shows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.solve.scatter import scatter_add
from bake.solve.surface import Surface
from bake.types import Float64Array


@dataclass(frozen=True, slots=True)
class EdgeTerms:
    """Entries of R, or of a multiple of it, on the pattern of the surface.

    Attributes:
        diagonal: Shape (u,), m².
        edges: Shape (e,), m².
        wings: Shape (w,), m².
    """

    diagonal: Float64Array
    edges: Float64Array
    wings: Float64Array


def bounded_share(surface: Surface, mass: Float64Array) -> Float64Array:
    """What is left of each butterfly's textbook term, shape (w,), in [0, 1].

    Args:
        surface: The welded surface.
        mass: Shape (u,), float64, m²: the weight that bounds an edge's pull at each unknown.
    """
    wings = surface.butterflies
    share = np.ones(len(wings.hinge))
    for corner in range(4):
        pull = wings.operator[:, corner] ** 2
        weight = mass[wings.stencil[:, corner]]
        np.divide(weight, pull, out=share, where=pull * share > weight)
    return share


def edge_terms(surface: Surface, weight: Float64Array) -> EdgeTerms:
    """R with the butterflies weighted by `weight`, shape (w,)."""
    wings = surface.butterflies
    a, b, c, d = wings.operator.T
    diagonal = np.zeros(surface.unknown_count)
    edges = scatter_add(wings.hinge, weight * a * b, len(surface.edges))
    for corner, g in enumerate((a, b, c, d)):
        diagonal += scatter_add(wings.stencil[:, corner], weight * g * g, surface.unknown_count)
    for side, product in enumerate((a * c, b * c, a * d, b * d)):
        edges += scatter_add(wings.sides[:, side], weight * product, len(surface.edges))
    return EdgeTerms(diagonal, edges, weight * c * d)
