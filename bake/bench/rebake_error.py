"""How far a rebaked result is from a whole bake of the same scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bake.types import BakeResult, Decorators


@dataclass(frozen=True, slots=True)
class RebakeError:
    """Differences of one kind of values.

    Attributes:
        count: Values compared.
        largest: Largest difference; inf where one side has values that the other lacks.
        rms: Root of the mean square.
    """

    count: int
    largest: float
    rms: float


def rebake_errors(rebaked: BakeResult, whole: BakeResult) -> dict[str, RebakeError]:
    """Differences by kind: vertices, voxels, tree fits, small scalars, region points and region coefficients.

    A kind that neither result has is left out. Coefficients that multiply lengths count at the edge of what they are
    for: they are compared by the AO that they stand for where that is known, as they are elsewhere.
    """
    a, b = rebaked.decorators or Decorators(), whole.decorators or Decorators()
    found = {"vertices": _difference(rebaked.field.ao, whole.field.ao)}
    if a.volume is not None or b.volume is not None:
        found["voxels"] = _either(a.volume, b.volume, "sh")
        found["trees"] = _either(a.fits, b.fits, "coefficients")
    for name in ("shrub_scalars", "small_scalars"):
        one, other = getattr(a, name), getattr(b, name)
        if one is not None or other is not None:
            found[name] = _either(one, other, "ao")
    if rebaked.regions is not None or whole.regions is not None:
        one, other = rebaked.regions, whole.regions
        found["points"] = _either(one and one.points, other and other.points, "sh")
        found["regions"] = _either(one and one.regularised, other and other.regularised, "coefficients")
    return found


def _either(one: Any, other: Any, attribute: str) -> RebakeError:
    if one is None or other is None:
        return RebakeError(0, np.inf, np.inf)
    return _difference(getattr(one, attribute), getattr(other, attribute))


def _difference(one: NDArray[Any], other: NDArray[Any]) -> RebakeError:
    if one.shape != other.shape or not np.array_equal(np.isnan(one), np.isnan(other)):
        return RebakeError(int(other.size), np.inf, np.inf)
    known = ~np.isnan(one)
    delta = one[known].astype(np.float64) - other[known]
    if not len(delta):
        return RebakeError(0, 0.0, 0.0)
    return RebakeError(len(delta), float(np.abs(delta).max()), float(np.sqrt(np.square(delta).mean())))
