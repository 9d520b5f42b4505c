"""On CUDA: which BVH, leaves and blocks trace fastest, and how far that is from what the card can do at most."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from bake.bench.overhead import median_seconds
from bake.bench.scaling import PLAIN
from bake.bench.scaling_scenes import SEED, write_field
from bake.bench.table import Measurements
from bake.devices import Device, initialised_warp, resolve
from bake.samples import place_samples
from bake.scene import flatten, load_scene
from bake.settings import BakeSettings
from bake.trace.warp import TracerWarp
from bake.types import SampleSet, Tally, World

CONSTRUCTORS = ("lbvh", "sah", "median", "cubql")
LEAVES = (1, 2, 4, 8)
BLOCKS = (64, 128, 256)

LEAST_MRAYS_PER_S = 500.0
TRIANGLES = 1_800_000
_SAMPLES = 1 << 20
_COPIED = 1 << 30  # bytes
_THREADS = 1 << 22
_NODE_BYTES = 3000.0  # about thirty nodes and six triangles a ray


def measure_card(options: Mapping[str, Any]) -> Measurements:
    """Every constructor × leaf × block size on a field of 1.8 million triangles; one row with the reason without CUDA.

    Args:
        options: Bake options by long name.
    """
    device = resolve(str(options.get("device", "auto")))
    if not device.is_cuda:
        row = {"skipped": "no CUDA device here: the choice of BVH, leaves and blocks is the card's"}
        note = "on a machine with CUDA: main.py bench speed --tables card"
        return Measurements("card", [row], [note], seeds={"scene": SEED})
    settings = BakeSettings.from_options({**PLAIN, **options})
    with TemporaryDirectory() as folder:
        world = flatten(load_scene(write_field(Path(folder) / "field.glb", TRIANGLES)), settings)
    rows = measure_choices(world, settings, device, samples=_SAMPLES)
    best = max(float(row.get("Mrays/s", 0.0)) for row in rows)
    for row in rows:
        if "fastest" in row:
            row["passed"] = best >= LEAST_MRAYS_PER_S
    limits = measure_limits(device, copied=_COPIED, threads=_THREADS)
    per_ray_bytes = limits["copy GB/s"] * 1e3 / max(best, 1e-9)
    per_ray_flops = limits["multiply-add TFLOP/s"] * 1e6 / max(best, 1e-9)
    notes = [
        f"{device.name}, {world.face_count:,} triangles, {_SAMPLES:,} samples × {settings.rays} rays, median of 3",
        f"gate: the fastest choice traces {LEAST_MRAYS_PER_S:g} Mrays/s or more, rays made and weighed in the kernel",
        f"limits measured here: copy {limits['copy GB/s']:,.0f} GB/s (read and write), multiply-add "
        f"{limits['multiply-add TFLOP/s']:.1f} TFLOP/s; the fastest choice leaves {per_ray_bytes:,.0f} bytes of memory "
        f"traffic and {per_ray_flops:,.0f} operations a ray; a walk needs some {_NODE_BYTES:,.0f} bytes (estimate)",
    ]
    return Measurements("card", rows, notes, seeds={"scene": SEED, "bake": settings.seed})


def measure_choices(world: World, settings: BakeSettings, device: Device, *, samples: int) -> list[dict[str, Any]]:
    """One row a choice, the fastest marked; a choice that Warp refuses says why.

    Args:
        world: What is traced.
        settings: Those of the bake.
        device: Where; blocks matter on CUDA alone.
        samples: How many at most.
    """
    placed = place_samples(world, settings)
    step = max(1, len(placed) // samples)
    placed = placed.only(np.arange(0, len(placed), step, dtype=np.int64)[:samples])
    rows: list[dict[str, Any]] = []
    for constructor in CONSTRUCTORS if device.is_cuda else ("sah", "median"):
        for leaf in LEAVES:
            try:
                rows += _rows(world, settings, device, placed, constructor, leaf)
            except RuntimeError as error:
                rows.append({"constructor": constructor, "leaf": leaf, "refused": str(error).splitlines()[0]})
    best = max((row for row in rows if "Mrays/s" in row), key=lambda row: row["Mrays/s"])
    best["fastest"] = "←"
    return rows


def measure_limits(device: Device, *, copied: int, threads: int) -> dict[str, float]:
    """The device's memory traffic and arithmetic at most, measured.

    Args:
        device: Any; on the CPU one thread works.
        copied: Bytes of an array that is copied.
        threads: That multiply and add.
    """
    wp = initialised_warp()
    kernels: Any = importlib.import_module("bake.kernels.limits")
    source, target = (wp.zeros(copied // 4, dtype=wp.float32, device=device.alias) for _ in range(2))
    out = wp.zeros(threads, dtype=wp.float32, device=device.alias)

    def copy() -> None:
        wp.copy(target, source)
        wp.synchronize_device(device.alias)

    def calculate() -> None:
        wp.launch(kernels.multiply_add, dim=threads, inputs=[0.999, out], device=device.alias)
        wp.synchronize_device(device.alias)

    copy()
    calculate()
    return {
        "copy GB/s": 2.0 * copied / median_seconds(copy) / 1e9,
        "multiply-add TFLOP/s": kernels.FLOPS_A_THREAD * threads / median_seconds(calculate) / 1e12,
    }


class _Tuned(TracerWarp):
    """The same tracer over a BVH made as told, launched in blocks as told."""

    block = 256

    def __init__(self, world: World, settings: BakeSettings, device: Device, constructor: str, leaf: int) -> None:
        super().__init__(world, settings, device)
        self._mesh = None
        indices = self.array(world.faces[self.cast_face].ravel(), self.warp.int32)
        begin = time.perf_counter()
        self._mesh = self.warp.Mesh(
            points=self.positions, indices=indices, bvh_constructor=constructor, bvh_leaf_size=leaf
        )
        self.warp.synchronize_device(device.alias)
        self.build_s = time.perf_counter() - begin
        self.scene = int(np.uint64(self._mesh.id))

    def launch(self, kernel: Any, batch: slice, inputs: list[Any]) -> None:
        """In blocks of `block` threads on CUDA; see `TracerFused.launch`."""
        if self._pool is not None:
            super().launch(kernel, batch, inputs)
            return
        self.warp.launch(
            kernel,
            dim=batch.stop - batch.start,
            inputs=[*inputs, batch.start],
            device=self._warp_device,
            block_dim=self.block,
        )


def _rows(
    world: World, settings: BakeSettings, device: Device, samples: SampleSet, constructor: str, leaf: int
) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = []
    with _Tuned(world, settings, device, constructor, leaf) as tracer:
        for block in BLOCKS if device.is_cuda else BLOCKS[:1]:
            tracer.block = block
            trace = _tracing(tracer, samples)
            trace()
            seconds = median_seconds(trace)
            rays = len(samples) * settings.rays
            rows.append(
                {
                    "constructor": constructor, "leaf": leaf, "block": block, "build s": tracer.build_s,
                    "trace s": seconds, "Mrays/s": rays / seconds / 1e6,
                }
            )  # fmt: skip
    return rows


def _tracing(tracer: TracerWarp, samples: SampleSet) -> Callable[[], None]:
    tally = Tally.empty(len(samples), tracer.settings.distance_count)

    def trace() -> None:
        for batch in samples.batches(tracer.batch_size):
            tracer.accumulate(samples, batch, tally)

    return trace
