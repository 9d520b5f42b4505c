"""A spot as it would be with a remedy: the surface around it baked again, in the scene as the remedy makes it.

The samples around the spot are traced as a rebake would trace them: same places, same seeds, all of the changed scene
to hit. They are solved on a patch of the surface, wide enough that its rim does not reach the spot. The fit takes one
thing from the whole scene, the mean scatter of its samples; it is corrected by what the change does to faces drawn at
random and to those near the changed objects (`bake.explain.scatter_change`).
"""

from __future__ import annotations

import dataclasses
import time
from dataclasses import dataclass

import numpy as np

from bake.decorators.fog import make_fog
from bake.errors import SceneError
from bake.explain.cause_types import Remedy
from bake.explain.explainer import Explainer
from bake.explain.patch import cut_out, rings_around
from bake.explain.remedies import remedied, remedied_settings
from bake.explain.retrace import tracer_like
from bake.explain.scatter_change import changed_scatter, trace_all
from bake.explain.types import Spot
from bake.samples import place_samples
from bake.scene import flatten, hash_files, load_scene
from bake.solve import VertexMapper
from bake.types import Float32Array, Float64Array, Int64Array, Scene, VertexState

RINGS = 12
"""Rings of faces in the patch; the inner half is shown."""


@dataclass(frozen=True, slots=True)
class Preview:
    """What a remedy would do to a spot.

    Attributes:
        remedy: Which.
        distances: The distance of each column, metres.
        before: Shape (k,), float64: the spot's value now; NaN in columns that the remedy adds.
        after: Shape (k,), float64: with the remedy; NaN if the spot no longer receives AO.
        vertices: Shape (v,), int64, index into `World.positions`: the vertices around the spot.
        ao: Shape (v, k), float32: their values with the remedy.
        samples: Samples that were traced again.
        rays: Rays traced.
        seconds: What it took.
    """

    remedy: Remedy
    distances: tuple[float, ...]
    before: Float64Array
    after: Float64Array
    vertices: Int64Array
    ao: Float32Array
    samples: int
    rays: int
    seconds: float


class Previewer:
    """Previews remedies on one bake; keeps the scene once it is read.

    Args:
        explainer: Of the bake.
        scene: What was baked; read from its file when it is first needed, if None.
    """

    def __init__(self, explainer: Explainer, scene: Scene | None = None) -> None:
        self._explainer = explainer
        self._scene = scene

    def preview(self, spot: Spot, remedy: Remedy) -> Preview:
        """The spot with a remedy.

        Args:
            spot: Of the explainer's bake.
            remedy: One that writes (`Remedy.writes`).

        Raises:
            SceneError: the remedy has nothing to write, or the scene has changed since the bake or cannot be read.
            SettingsError: an option of the remedy is out of its bounds.
            DeviceError: nothing here can trace.
        """
        begin = time.perf_counter()
        if not remedy.writes:
            raise SceneError("this cannot be previewed", where=remedy.text, remedy="change the model and bake again")
        result = self._explainer.result
        settings = remedied_settings(self._explainer.settings, remedy)
        world = flatten(remedied(self.scene(), remedy), settings)
        samples = place_samples(world, settings)
        ring = rings_around(world, spot.vertices, RINGS)
        changed = dataclasses.replace(result, settings=settings)
        with tracer_like(changed, world, make_fog(world, settings)) as tracer:
            part, own, rows, vertices = cut_out(world, samples, ring > 0)
            tally = trace_all(tracer, samples.only(rows))
            scatter, drawn = changed_scatter(self._explainer, tracer, samples, set(remedy.objects))
        field = VertexMapper(part, own, settings, scene=scatter).solve(
            tally.ao, tally.valid(settings.back_face_threshold)
        )
        distances = settings.column_distances
        values = np.full((world.vertex_count, len(distances)), np.nan, np.float32)
        values[vertices] = field.ao
        inner = np.unique(world.faces[(ring > 0) & (ring <= RINGS // 2)])
        known = np.full(world.vertex_count, VertexState.NOT_BAKED, np.uint8)
        known[vertices] = field.state
        inner = inner[known[inner] == VertexState.BAKED]  # what others are filled from may lie beyond the rim
        traced = len(rows) + drawn
        return Preview(
            remedy=remedy,
            distances=distances,
            before=self._before(spot, distances),
            after=spot.weights @ values[spot.vertices].astype(np.float64),
            vertices=inner.astype(np.int64),
            ao=values[inner],
            samples=traced,
            rays=traced * settings.rays,
            seconds=time.perf_counter() - begin,
        )

    def scene(self) -> Scene:
        """What was baked.

        Raises:
            SceneError: a file has changed since, or cannot be read.
        """
        if self._scene is None:
            result = self._explainer.result
            if hash_files(result.scene_path, result.files) != dict(result.files):
                raise SceneError(
                    "the scene has changed since it was baked", where=str(result.scene_path), remedy="bake it again"
                )
            self._scene = load_scene(result.scene_path, crease_angle=result.settings.crease_angle)
        return self._scene

    def _before(self, spot: Spot, distances: tuple[float, ...]) -> Float64Array:
        explainer = self._explainer
        own = explainer.settings.column_distances
        now = spot.weights @ explainer.field.ao[spot.vertices].astype(np.float64)
        return np.array([now[own.index(distance)] if distance in own else np.nan for distance in distances])
