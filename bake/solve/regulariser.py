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

from bake.in_parts import in_parts
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

    def part(begin: int, end: int) -> None:
        here = share[begin:end]
        for corner in range(4):
            pull = wings.operator[begin:end, corner] ** 2
            weight = mass[wings.stencil[begin:end, corner]]
            np.divide(weight, pull, out=here, where=pull * here > weight)

    in_parts(part, len(share))
    return share


def edge_terms(surface: Surface, weight: Float64Array) -> EdgeTerms:
    """R with the butterflies weighted by `weight`, shape (w,)."""
    wings = surface.butterflies
    count = len(weight)
    across = np.empty(count)
    products = np.empty((5, count))

    def squares(begin: int, end: int) -> None:
        for corner in range(4):
            g = wings.operator[begin:end, corner]
            np.multiply(weight[begin:end] * g, g, out=products[corner, begin:end])

    def mixed(begin: int, end: int) -> None:
        w, (a, b, c, d) = weight[begin:end], np.ascontiguousarray(wings.operator[begin:end].T)
        for side, (g, h) in enumerate(((a, c), (b, c), (a, d), (b, d))):
            np.multiply(w, g * h, out=products[side, begin:end])
        np.multiply(w * a, b, out=products[4, begin:end])
        np.multiply(w * c, d, out=across[begin:end])

    in_parts(squares, count)
    diagonal = np.zeros(surface.unknown_count)
    for corner in range(4):
        diagonal += scatter_add(wings.stencil[:, corner], products[corner], len(diagonal))
    in_parts(mixed, count)
    edges = scatter_add(wings.hinge, products[4], len(surface.edges))
    for side in range(4):
        edges += scatter_add(wings.sides[:, side], products[side], len(surface.edges))
    return EdgeTerms(diagonal, edges, across)
