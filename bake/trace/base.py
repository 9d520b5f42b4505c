"""The interface that every tracer fulfils."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from types import TracebackType
from typing import Self

from bake.settings import BakeSettings
from bake.types import Float32Array, Int32Array, SampleSet, Tally, World


@dataclass(frozen=True, slots=True)
class Hits:
    """Closest hits of plain rays.

    Attributes:
        distance: Shape (n,), float32, metres; inf for a miss.
        face: Shape (n,), int32, index into `World.faces`; -1 for a miss.
        cosine: Shape (n,), float32: of direction and geometric normal; positive where the back is struck.
        weights: Shape (n, 2), float32: barycentric weights of corners 0 and 1.
    """

    distance: Float32Array
    face: Int32Array
    cosine: Float32Array
    weights: Float32Array


class Tracer(ABC):
    """Traces one world with one set of settings; close it, or use it in a `with` statement.

    Attributes:
        name: "embree", "warp" or "brute".
        device: "cpu" or the CUDA device's name.
        batch_size: Samples a call of `accumulate` handles well: large enough to keep the device busy, small enough
            that Cancel answers at once.
    """

    name: str
    device: str
    batch_size: int

    def __init__(self, world: World, settings: BakeSettings) -> None:
        self.world = world
        self.settings = settings

    @abstractmethod
    def accumulate(self, samples: SampleSet, batch: slice, tally: Tally) -> None:
        """Traces the rays of the samples in `batch` and writes their rows of `tally`.

        Every sample sends exactly `settings.rays` rays; `tally.rays` says so afterwards.
        """

    @abstractmethod
    def nearest(self, origins: Float32Array, directions: Float32Array, t_max: float) -> Hits:
        """Closest hits within `t_max` metres of plain rays, shape (n, 3) each; directions have unit length.

        Origins are relative to `World.origin`. Partly open faces count as hits.
        """

    @abstractmethod
    def close(self) -> None:
        """Frees what the tracer holds; it cannot be used afterwards."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
