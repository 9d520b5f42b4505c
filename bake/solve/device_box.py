"""Least squares under bounds by fused kernels: what `BoxSolver` does in NumPy, on CUDA or on all cores.

The steps are those of `bake.solve.face_descent`, all right-hand sides side by side, so that the matrix is read once for
two of them. Kernels are launched one after another and no number comes back in between: what is done stays as it is, so
it does not matter after how many steps the host looks whether all are.
"""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass
from functools import cache, partial
from itertools import pairwise
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from bake.devices import Device, initialised_warp, worker_count
from bake.solve import face_descent
from bake.solve.conjugate_gradient import Asked, BoxSolution, BoxSolver, Columns, Found
from bake.types import BoolArray, Float64Array, Int32Array, Int64Array

_log = logging.getLogger(__name__)

ROWS = 512
"""Most unknowns of a chunk, whose sums are added up apart."""

LANES = 64
"""Threads of a block on CUDA."""

AT_ONCE = 8
"""Steps on CUDA between two looks of the host."""

RELISTED = 0.6
"""On the CPU chunks are listed anew once less than this share of their unknowns is not yet solved for."""

PARTS_A_THREAD = 2
"""Parts of a launch on the CPU: several a thread even out what the threads get."""

_loading = Lock()


class DeviceBoxSolver(BoxSolver):
    """A `BoxSolver` whose `solve_all` runs on a device; results are those of `BoxSolver` but for rounding.

    Args:
        matrix, first: As for `BoxSolver`.
        device: Where to.
        lanes: Threads of a block; as the device asks for if None.
    """

    def __init__(self, matrix: csr_array, first: Int64Array, device: Device, *, lanes: int | None = None) -> None:
        super().__init__(matrix, first)
        self._device = device
        self._lanes = lanes or (LANES if device.is_cuda else 1)
        self._chunks = _Chunks.of(first)

    def solve_all(
        self,
        rhs: Float64Array,
        start: Float64Array,
        *,
        tolerance: float = 1e-8,
        within: Float64Array | None = None,
        most_iterations: int = 200,
        columns: Columns = map,
    ) -> Iterator[BoxSolution]:
        """See `BoxSolver.solve_all`; right-hand sides are solved for two at a time, and `columns` is not asked.

        Should the device fail, or its memory not suffice, NumPy does the work, and the log says so.
        """
        asked = [self.asked(rhs[:, k], tolerance, within) for k in range(rhs.shape[1])]
        try:
            pairs = [range(k, min(k + 2, len(asked))) for k in range(0, len(asked), 2)]
            found = [
                one
                for pair in pairs
                for one in self._found([asked[k] for k in pair], start[:, pair.start : pair.stop], most_iterations)
            ]
        except (RuntimeError, OSError) as error:
            _log.warning("values are solved for on the CPU: %s failed (%s)", self._device.alias, error)
            return super().solve_all(
                rhs, start, tolerance=tolerance, within=within, most_iterations=most_iterations, columns=columns
            )
        return (self.told(one, where, most_iterations) for one, where in zip(asked, found, strict=True))

    def _found(self, asked: list[Asked], start: Float64Array, most: int) -> list[Found]:
        run = _Run(self._device, self._lanes, self._chunks, asked, start, most)
        run.all_steps()
        return run.found()


@dataclass(frozen=True, slots=True)
class _Chunks:
    """Consecutive unknowns of one component each.

    Attributes:
        first: Shape (h + 1,), int32: where each begins.
        component: Shape (h,), int32.
        of_component: Shape (c + 1,), int32: first chunk of each component.
    """

    first: Int32Array
    component: Int32Array
    of_component: Int32Array

    @staticmethod
    def of(first: Int64Array) -> _Chunks:
        """Of components that own unknowns `first[i]:first[i + 1]`."""
        counts = -(-np.diff(first) // ROWS)
        of_component = np.concatenate([[0], np.cumsum(counts)])
        component = np.repeat(np.arange(len(counts)), counts)
        begin = first[component] + ROWS * (np.arange(len(component)) - of_component[component])
        begin = np.append(begin, first[-1])
        return _Chunks(begin.astype(np.int32), component.astype(np.int32), of_component.astype(np.int32))


class _Run:
    """One or two right-hand sides on their way to the solution."""

    def __init__(
        self, device: Device, lanes: int, chunks: _Chunks, asked: list[Asked], start: Float64Array, most: int
    ) -> None:
        self._warp = wp = initialised_warp()
        self._device, self._lanes, self._chunks = device, lanes, chunks
        self._columns = len(asked)
        self._kernels = load_kernels(self._columns, device, lanes)
        part = asked[0].part
        n, c, h = len(part.scale), len(part.sizes), len(chunks.component)
        values = wp.types.vector(length=self._columns, dtype=wp.float64)
        counts = wp.types.vector(length=self._columns, dtype=wp.int32)
        every = np.full(c, (1 << self._columns) - 1, np.int32)
        self._work: Any = self._kernels.work()
        work = self._work
        work.row = self._array(part.matrix.indptr.astype(np.int32, copy=False), wp.int32)
        work.column = self._array(part.matrix.indices.astype(np.int32, copy=False), wp.int32)
        work.entry = self._array(part.matrix.data, wp.float64)
        work.upper = self._array(part.scale, wp.float64)
        work.reach = self._array(np.zeros(1) if part.reach is None else part.reach, wp.float64)
        work.by_norm, work.most, work.enough = int(part.reach is None), most, face_descent.SUFFICIENT
        work.chunk = self._array(chunks.first, wp.int32)
        work.chunk_component = self._array(chunks.component, wp.int32)
        work.first_chunk = self._array(chunks.of_component, wp.int32)
        work.listed = self._array(np.arange(h, dtype=np.int32), wp.int32)
        x = np.clip(start, 0.0, 1.0) * part.scale[:, None]
        work.x, work.product = self._array(x, values), self._array(np.stack([one.b for one in asked], axis=1), values)
        for name in ("gradient", "direction", "x_before", "gradient_before"):
            setattr(work, name, wp.zeros(n, dtype=values, device=device.alias))
        work.face = wp.zeros(n, dtype=wp.int32, device=device.alias)
        for name in ("sum", "pull", "left", "largest", "largest_pull"):
            setattr(work, name, wp.zeros(h, dtype=values, device=device.alias))
        work.goal = self._array(np.stack([one.goal for one in asked], axis=1), values)
        for name in ("norm", "norm_before", "promised", "measure", "length"):
            setattr(work, name, wp.zeros(c, dtype=values, device=device.alias))
        work.products = self._array(np.ones((c, self._columns), np.int32), counts)
        work.working, work.ends = self._array(every, wp.int32), self._array(every.copy(), wp.int32)
        work.projects = wp.zeros(c, dtype=wp.int32, device=device.alias)
        work.stuck = wp.zeros(c, dtype=wp.int32, device=device.alias)
        self._components, self._listed = c, np.arange(h, dtype=np.int32)

    def all_steps(self) -> None:
        """Until every component is done, stuck or out of products."""
        if self._lanes > 1:
            self._in_blocks()
        else:
            threads = worker_count()
            with ThreadPoolExecutor(max(1, threads - 1), "solve") as pool:
                self._on_cores(pool, threads)

    def found(self) -> list[Found]:
        """Where each right-hand side ended."""
        x, gradient = self._numbers("x"), self._numbers("gradient")
        measure, products = self._numbers("measure"), self._numbers("products")
        stuck = self._work.stuck.numpy()
        return [
            Found(
                np.ascontiguousarray(x[:, k]),
                np.ascontiguousarray(gradient[:, k]),
                np.ascontiguousarray(measure[:, k]),
                products[:, k].astype(np.int64),
                (stuck >> k & 1).astype(np.bool_),
            )
            for k in range(self._columns)
        ]

    def _numbers(self, name: str) -> NDArray[Any]:
        return getattr(self._work, name).numpy().reshape(-1, self._columns)

    def _in_blocks(self) -> None:
        """A chunk or a component a block; on CUDA steps are captured once and played back, some at a time."""
        wp, rows, components = self._warp, len(self._listed), self._components
        kernels = self._kernels

        def launch(kernel: Any, count: int) -> None:
            wp.launch_tiled(
                kernel, dim=[count], inputs=[self._work, 0], block_dim=self._lanes, device=self._device.alias
            )

        def steps() -> None:
            for _ in range(AT_ONCE):
                launch(kernels.multiply, rows)
                launch(kernels.measure_out, components)
                launch(kernels.move, rows)
                launch(kernels.judge, components)
                launch(kernels.project, rows)
                launch(kernels.accept, components)
                launch(kernels.turn, rows)
                launch(kernels.renew, components)

        launch(kernels.begin, rows)
        launch(kernels.turn, rows)
        launch(kernels.renew, components)
        play = steps
        if self._device.is_cuda:
            with wp.ScopedDevice(self._device.alias), wp.ScopedCapture() as capture:
                steps()
            play = partial(wp.capture_launch, capture.graph)
        while self._work.working.numpy().any():
            play()

    def _on_cores(self, pool: ThreadPoolExecutor, threads: int) -> None:
        """Every kernel in parts side by side, as Warp runs a launch on the thread that asks for it."""
        kernels, chunks = self._kernels, self._chunks
        size = np.diff(chunks.first)
        working, ends = self._work.working.numpy(), self._work.ends.numpy()
        commands = _Commands(self._warp, self._work, threads)

        def run(kernel: Any, weight: Int64Array) -> None:
            commands.run(pool, kernel, weight)

        components = np.ones(self._components, np.int64)
        rows = size[self._listed]
        run(kernels.begin, rows)
        run(kernels.turn, rows)
        run(kernels.renew, components)
        while working.any():
            active = working[chunks.component[self._listed]] != 0
            if rows[active].sum() < RELISTED * rows.sum():
                self._list(active)
                rows = size[self._listed]
                commands = _Commands(self._warp, self._work, threads)
            run(kernels.multiply, rows)
            run(kernels.measure_out, components)
            run(kernels.move, rows)
            run(kernels.judge, components)
            if ends.any():
                run(kernels.project, rows)
                run(kernels.accept, components)
                run(kernels.turn, rows)
                run(kernels.renew, components)
            else:
                run(kernels.turn, rows)

    def _list(self, active: BoolArray) -> None:
        self._listed = np.ascontiguousarray(self._listed[active])
        self._work.listed = self._array(self._listed, self._warp.int32)

    def _array(self, values: NDArray[Any], dtype: Any) -> Any:
        """A NumPy array on the device; on the CPU both share their memory."""
        return self._warp.array(np.ascontiguousarray(values), dtype=dtype, device=self._device.alias, copy=False)


class _Commands:
    """Launches on the CPU, made ready once for the whole iteration."""

    def __init__(self, warp: Any, work: Any, threads: int) -> None:
        self._warp, self._work, self._threads = warp, work, threads
        self._ready: dict[Any, list[Callable[[], None]]] = {}

    def run(self, pool: ThreadPoolExecutor, kernel: Any, weight: Int64Array) -> None:
        """A kernel over as many things as there are weights, in parts of equal weight."""
        if kernel not in self._ready:
            self._ready[kernel] = self._made(kernel, weight)
        queue = deque(self._ready[kernel])
        helpers = [pool.submit(_drain, queue) for _ in range(min(self._threads, len(queue)) - 1)]
        try:
            _drain(queue)
        finally:
            wait(helpers)
        for helper in helpers:
            helper.result()

    def _made(self, kernel: Any, weight: Int64Array) -> list[Callable[[], None]]:
        parts = 1 if weight.sum() < 4 * ROWS else PARTS_A_THREAD * self._threads
        total: Int64Array = np.cumsum(weight)
        shares: Int64Array = int(total[-1]) * np.arange(1, parts) // parts
        edges: list[int] = sorted({0, *np.searchsorted(total, shares).tolist(), len(weight)})
        return [
            self._warp.launch(
                kernel, dim=(end - begin, 1), inputs=[self._work, begin], device="cpu", record_cmd=True
            ).launch
            for begin, end in pairwise(edges)
        ]


def _drain(queue: deque[Callable[[], None]]) -> None:
    while True:
        try:
            command = queue.popleft()
        except IndexError:
            return
        command()


@dataclass(frozen=True, slots=True)
class _Kernels:
    """All kernels for some number of right-hand sides, in one module, which is compiled once."""

    work: Any
    module: Any
    begin: Any
    multiply: Any
    move: Any
    project: Any
    turn: Any
    measure_out: Any
    judge: Any
    accept: Any
    renew: Any


def load_kernels(columns: int, device: Device, lanes: int | None = None) -> _Kernels:
    """The kernels for up to two right-hand sides, ready to run; compiled if this machine has not seen them yet.

    Raises:
        RuntimeError: they cannot be compiled or loaded.
    """
    lanes = lanes or (LANES if device.is_cuda else 1)
    with _loading:
        kernels = _kernels(min(columns, 2), lanes)
        initialised_warp().load_module(kernels.module, device=device.alias, block_dim=lanes)
    return kernels


@cache
def _kernels(columns: int, lanes: int) -> _Kernels:
    wp = initialised_warp()
    from bake.kernels.box_components import component_kernels
    from bake.kernels.box_rows import row_kernels
    from bake.kernels.box_work import work_type

    name = f"bake.kernels.box_{columns}_{lanes}"
    rows = row_kernels(columns, lanes, name)
    components = component_kernels(columns, lanes, name, drop=face_descent.DROP, settled=face_descent.SETTLED)
    return _Kernels(
        work=work_type(columns),
        module=wp.get_module(name),
        begin=rows.begin,
        multiply=rows.multiply,
        move=rows.move,
        project=rows.project,
        turn=rows.turn,
        measure_out=components.measure_out,
        judge=components.judge,
        accept=components.accept,
        renew=components.renew,
    )
