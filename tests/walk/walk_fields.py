"""Fields of AO whose walk is known in advance."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from synthetic import Field, build_regions, points_of

from bake import spherical_harmonics
from bake.region_types import RegionGraph, Regions
from bake.regions.fit import fit_regions
from bake.settings import BakeSettings


def constant_sh(value: float, count: int, distances: int = 2) -> np.ndarray:
    """Convolved harmonics of one AO about every normal, shape (count, 9, distances)."""
    sh = np.zeros((count, 9, distances))
    sh[:, 0] = value / spherical_harmonics.Y0
    return sh


def ramp(slope: float, start: float = 0.5) -> Field:
    """AO that changes evenly along x."""

    def field(positions: np.ndarray) -> np.ndarray:
        sh = constant_sh(1.0, len(positions))
        return sh * (start + slope * positions[:, 0])[:, None, None]

    return field


def constants(graph: RegionGraph, values: Sequence[float]) -> Regions:
    """Regions each of which has one AO; the regularisation leaves them as they are."""
    regions = build_regions(graph=graph, field=lambda p: constant_sh(0.5, len(p)), invalid=0.0)
    coefficients = np.zeros_like(regions.fitted.coefficients)
    for number, value in enumerate(values):
        coefficients[number, 0] = constant_sh(value, 1)[0]
    return with_models(regions, coefficients)


def with_models(regions: Regions, coefficients: np.ndarray) -> Regions:
    """The same regions, fitted and regularised models replaced."""
    fitted = dataclasses.replace(regions.fitted, coefficients=coefficients.astype(np.float32))
    return dataclasses.replace(regions, fitted=fitted, regularised=fitted)


def fitted_to(graph: RegionGraph, field: Field) -> Regions:
    """Regions fitted to a field, all points valid, not regularised."""
    regions = build_regions(graph=graph, field=field, invalid=0.0)
    models = fit_regions(points_of(graph, field), graph, BakeSettings())
    return with_models(regions, models.coefficients)
