"""Fits the trees of one mesh, and checks the models against the gold signal as traced on the trees themselves."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bake.arrays import Float64Array
from bake.decorator_types import TreeModel, TreeVolume
from bake.decorators.alternating import Instance, Refined, refine
from bake.decorators.fit import GlobalFit, fit_global, model_error
from bake.decorators.tracing import SurfaceTracer, trace_samples
from bake.decorators.tree_samples import PlacedSamples, as_sample_set, place, sample_mesh
from bake.decorators.volume import evaluate, tree_boxes
from bake.scene_types import Mesh
from bake.settings import BakeSettings
from bake.stages import patiently
from bake.types import World

_CHECKED = 4  # of so many samples one is traced, to tell the models' errors
_TRACING = _CHECKED / (_CHECKED + 1)  # share of the rays of refining that come before those of the check


@dataclass(frozen=True, slots=True)
class FittedTrees:
    """Trees of one mesh.

    Attributes:
        model: Their local AO.
        centre: Shape (t, 3), middle of each tree's box.
        fits: t of them.
        rmse: Shape (t, 3, k): errors of the linear function alone, of the model, and of the volume.
        rmse_unrefined: Shape (t, k): the model's before its local AO was refined, or None.
    """

    model: TreeModel
    centre: Float64Array
    fits: tuple[GlobalFit, ...]
    rmse: Float64Array
    rmse_unrefined: Float64Array | None = None

    @staticmethod
    def joined(parts: Sequence[FittedTrees]) -> FittedTrees:
        """Several parts of the same group, in order."""
        return FittedTrees(
            parts[0].model,
            np.concatenate([part.centre for part in parts]),
            tuple(fit for part in parts for fit in part.fits),
            np.concatenate([part.rmse for part in parts]),
        )


class FitsKnown(Protocol):
    """Fits that an edit of the scene leaves as they are."""

    def fit(self, number: int) -> GlobalFit | None:
        """The fit of a tree; None if it has to be found."""
        ...

    def errors(self, number: int) -> Float64Array | None:
        """Errors of a tree's models, shape (3, k), as in `FittedTrees.rmse`; None if they have to be found."""
        ...


class MeshFitter:
    """Fits the trees of one mesh.

    Attributes:
        mesh, trees: What it fits.
        seen: Local AO at the samples as a volume would show it, for the trees that stand for all.
        rays: How many were traced so far.
    """

    def __init__(
        self, mesh: Mesh, world: World, model: TreeModel, trees: Sequence[int], settings: BakeSettings
    ) -> None:
        self.mesh, self.trees = mesh, trees
        self.seen: dict[int, Float64Array] = {}
        self.rays = 0
        self._world, self._model, self._settings = world, model, settings
        self._samples = sample_mesh(mesh)
        self._local = self._samples.interpolate(mesh, model.local_ao)

    def placed(self, number: int) -> PlacedSamples:
        """The samples on one of the trees."""
        return place(self._samples, self.mesh, self._world, number)

    def fitted(
        self, volume: TreeVolume, tracer: SurfaceTracer, numbers: Sequence[int], known: FitsKnown | None = None
    ) -> FittedTrees:
        """Against the gold signal of the volume, like against like: local AO as a volume shows it.

        Args:
            volume: As baked.
            tracer: Of the whole scene, for the errors.
            numbers: Which of the trees.
            known: Fits and errors that need not be found again.
        """
        centre = self._centres(numbers)
        usual: Float64Array | None = np.mean(np.stack(list(self.seen.values())), axis=0) if self.seen else None
        fits: list[GlobalFit] = []
        errors: list[Float64Array] = []
        for number, middle in zip(numbers, centre, strict=True):
            fit = None if known is None else known.fit(number)
            error = None if known is None else known.errors(number)
            if fit is None or error is None:
                placed = self.placed(number)
                offsets = placed.points - middle
                gold = _gold(volume, placed)
                if fit is None:
                    assert usual is not None, "trees are fitted after their mesh was seen alone"
                    fit = fit_global(gold, self.seen.get(number, usual), offsets, placed.area)
                if error is None:
                    models = (_linear(gold, offsets, placed.area), fit.at(offsets) * self._local, gold)
                    error = self._errors(tracer, placed, models)
            fits.append(fit)
            errors.append(error)
        return FittedTrees(self._model, centre, tuple(fits), np.array(errors))

    def refined(self, volume: TreeVolume, tracer: SurfaceTracer) -> Generator[float, None, FittedTrees]:
        """Against the gold signal traced at the samples, with the local AO as one of the unknowns.

        Yields:
            The share done, in [0, 1].
        """
        centre = self._centres(self.trees)
        placed = [self.placed(number) for number in self.trees]
        instances: list[Instance] = []
        for item, middle in zip(placed, centre, strict=True):
            yield _TRACING * len(instances) / len(placed)
            instances.append(Instance(self._traced(tracer, item, self._settings), item.points - middle, item.area))
        corners = self.mesh.faces[self._samples.face]
        work = patiently("refine", lambda: refine(instances, corners, self._samples.weights, self._model.local_ao))
        while True:
            try:
                next(work)
            except StopIteration as stop:
                found: Refined = stop.value[0]
                break
            yield _TRACING
        local = self._samples.interpolate(self.mesh, found.local_ao)
        errors: list[Float64Array] = []
        for item, spot, fit in zip(instances, placed, found.fits, strict=True):
            yield _TRACING + (1.0 - _TRACING) * len(errors) / len(placed)
            plain = fit_global(item.gold, self._local, item.offsets, item.area)
            models = (
                _linear(item.gold, item.offsets, item.area),
                fit.at(item.offsets) * local,
                _gold(volume, spot),
                plain.at(item.offsets) * self._local,
            )
            errors.append(self._errors(tracer, spot, models))
        rmse = np.array(errors)
        return FittedTrees(TreeModel(self._model.mesh, found.local_ao), centre, found.fits, rmse[:, :3], rmse[:, 3])

    def _centres(self, trees: Sequence[int]) -> Float64Array:
        world = self._world
        low, high = tree_boxes(world.positions, world.faces, world.first_face, np.array(trees))
        return 0.5 * (low + high)

    def _traced(self, tracer: SurfaceTracer, placed: PlacedSamples, settings: BakeSettings) -> Float64Array:
        self.rays += len(placed.face) * settings.rays
        return traced_gold(tracer, placed, self._world, settings)

    def _errors(self, tracer: SurfaceTracer, placed: PlacedSamples, models: Sequence[Float64Array]) -> Float64Array:
        """Errors, shape (models, k), against what other rays than those of the fit find at some of the samples.

        A tree whose samples are all buried is compared with the volume, the third of the models, instead.
        """
        some, settings = placed.every(_CHECKED), self._settings
        gold = self._traced(tracer, some, settings.replaced(seed=settings.seed ^ 1))
        if not np.isfinite(gold).any():
            gold = models[2][::_CHECKED]
        return np.array([model_error(gold, model[::_CHECKED], some.area) for model in models])


def traced_gold(tracer: SurfaceTracer, placed: PlacedSamples, world: World, settings: BakeSettings) -> Float64Array:
    """The gold signal of one tree traced at its samples, shape (n, k); NaN where they see too many back faces."""
    tally = trace_samples(tracer, as_sample_set(placed, world, settings.seed), settings.distance_count)
    return np.where(tally.valid(settings.back_face_threshold)[:, None], tally.ao.astype(np.float64), np.nan)


def _gold(volume: TreeVolume, placed: PlacedSamples) -> Float64Array:
    return evaluate(volume, placed.points, placed.normals).astype(np.float64)


def _linear(gold: Float64Array, offsets: Float64Array, area: Float64Array) -> Float64Array:
    """The best linear function without local AO."""
    return fit_global(gold, np.ones_like(gold), offsets, area).at(offsets)
