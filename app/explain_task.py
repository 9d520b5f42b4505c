"""The engine's share of an explanation: what it asks of `bake.explain`, kept warm from one spot to the next."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bake.explain.cause_types import Cause, Remedy
from bake.explain.types import Explanation, Spot, SpotWithout, SurfaceWithout
from bake.types import BakeResult, Progress

if TYPE_CHECKING:  # the window needs none of this to run, and starts the faster
    from bake.explain.explainer import Explainer
    from bake.explain.preview import Preview, Previewer

RAYS_OF = 24
"""Samples whose rays are sent to the window: more could not be told apart in the view."""


@dataclass(frozen=True, slots=True)
class SpotRequest:
    """Which spot to explain.

    Attributes:
        face: Index into `World.faces`.
        weights: Barycentric weights of its corners.
        distance: The distance in view, metres: the one that causes are named at.
    """

    face: int
    weights: tuple[float, float, float]
    distance: float


@dataclass(frozen=True, slots=True)
class ExplainedSpot:
    """What came of it: the explanation with the rays of the heaviest samples, and its causes, the likeliest first."""

    request: SpotRequest
    explanation: Explanation
    causes: tuple[Cause, ...]


@dataclass(frozen=True, slots=True)
class WithoutRequest:
    """What if an object did not cast: at a spot, or on the whole surface."""

    spot: Spot
    object: int
    surface: bool = False


@dataclass(frozen=True, slots=True)
class PreviewRequest:
    """What if a remedy were applied."""

    spot: Spot
    remedy: Remedy


def explain_spot(result: BakeResult, request: SpotRequest) -> Generator[Progress, None, ExplainedSpot]:
    """Explains a spot and names its causes."""
    from bake.explain.causes import name_causes

    yield Progress("explain", 0, 0)
    explainer = _warm.explainer(result)
    explanation = explainer.explain_face(request.face, np.array(request.weights))
    yield Progress("explain", 1, 2)
    causes = name_causes(explainer, explanation, distance=request.distance)
    return ExplainedSpot(request, explanation.with_rays_of(RAYS_OF), causes)


def spot_without(
    result: BakeResult, request: WithoutRequest
) -> Generator[Progress, None, SpotWithout | SurfaceWithout]:
    """AO without an object; of the whole surface it takes longer, and can be cancelled."""
    yield Progress("without", 0, 0)
    explainer = _warm.explainer(result)
    if request.surface:
        return (yield from explainer.without_steps(request.object))
    return explainer.spot_without(request.spot, request.object)


def preview_remedy(result: BakeResult, request: PreviewRequest) -> Generator[Progress, None, Preview]:
    """The spot with a remedy."""
    yield Progress("preview", 0, 0)
    return _warm.previewer(result).preview(request.spot, request.remedy)


class _Warm:
    """The explainer of the result that was last asked about."""

    def __init__(self) -> None:
        self._explainer: Explainer | None = None
        self._previewer: Previewer | None = None

    def explainer(self, result: BakeResult) -> Explainer:
        from bake.explain.explainer import Explainer

        if self._explainer is None or self._explainer.result is not result:
            if self._explainer is not None:
                self._explainer.close()
            self._explainer, self._previewer = Explainer(result), None
        return self._explainer

    def previewer(self, result: BakeResult) -> Previewer:
        from bake.explain.preview import Previewer

        explainer = self.explainer(result)
        if self._previewer is None:
            self._previewer = Previewer(explainer)
        return self._previewer


_warm = _Warm()
