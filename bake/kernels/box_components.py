"""The steps of the least squares solve that go through the components, one a block; see `bake.solve.face_descent`."""

from dataclasses import dataclass
from typing import Any

import warp as wp

from bake.kernels.box_work import summed, work_type

wp.set_module_options({"enable_backward": False, "fast_math": False})

ZERO = wp.constant(wp.float64(0.0))


@dataclass(frozen=True, slots=True)
class ComponentKernels:
    """The kernels over components; the last argument is the first of them.

    Attributes:
        measure_out: How long the step is.
        judge: What the step led to: whether the face ends, the component is done, or how the next direction conjugates.
        accept: Whether a projection saved enough.
        renew: The norms on a new face, and whether the component is done.
    """

    measure_out: Any
    judge: Any
    accept: Any
    renew: Any


def component_kernels(columns: int, lanes: int, module: str, *, drop: float, settled: float) -> ComponentKernels:
    """For some number of right-hand sides, and of threads a block; the shares are those of `face_descent`."""
    values = wp.types.vector(length=columns, dtype=wp.float64)
    Work = work_type(columns)
    total, largest_of = summed(columns, lanes)
    stride, count = wp.constant(lanes), wp.constant(columns)
    dropped, near = wp.constant(wp.float64(drop * drop)), wp.constant(wp.float64(settled))
    half, outside_box = wp.constant(wp.float64(0.5)), wp.constant(wp.float64(float("inf")))

    @wp.kernel(module=module, enable_backward=False, grid_stride=False)
    def measure_out(work: Work, first: wp.int32):
        i, lane = wp.tid()
        component = first + i
        working = work.working[component]
        if working == 0:
            return
        curvature = values()
        for chunk in range(work.first_chunk[component] + lane, work.first_chunk[component + 1], stride):
            curvature += work.sum[chunk]
        curvature = total(curvature)
        if lane == 0:
            norm = work.norm[component]
            promised = work.promised[component]
            length = values()
            for k in range(count):
                if ((working >> k) & 1) == 1 and curvature[k] > ZERO:
                    length[k] = norm[k] / curvature[k]
                    promised[k] = promised[k] + half * length[k] * norm[k]
            work.length[component] = length
            work.promised[component] = promised

    @wp.kernel(module=module, enable_backward=False, grid_stride=False)
    def judge(work: Work, first: wp.int32):
        i, lane = wp.tid()
        component = first + i
        working = work.working[component]
        if working == 0:
            return
        norm = values()
        pull = values()
        left = values()
        largest = values()
        largest_pull = values()
        for chunk in range(work.first_chunk[component] + lane, work.first_chunk[component + 1], stride):
            norm += work.sum[chunk]
            pull += work.pull[chunk]
            left = wp.max(left, work.left[chunk])
            largest = wp.max(largest, work.largest[chunk])
            largest_pull = wp.max(largest_pull, work.largest_pull[chunk])
        norm = total(norm)
        pull = total(pull)
        left = largest_of(left)
        if work.by_norm == 0:
            largest = largest_of(largest)
            largest_pull = largest_of(largest_pull)
        if lane == 0:
            goal = work.goal[component]
            norm_old = work.norm[component]
            norm_before = work.norm_before[component]
            measure = work.measure[component]
            products = work.products[component]
            conjugate = values()
            ends = wp.int32(0)
            projects = wp.int32(0)
            for k in range(count):
                bit = wp.int32(1) << k
                if (working & bit) != 0:
                    products[k] = products[k] + 1
                    on_face = largest[k]
                    measured = wp.max(largest[k], largest_pull[k])
                    if work.by_norm == 1:
                        on_face = wp.sqrt(norm[k])
                        measured = wp.sqrt(norm[k] + pull[k])
                    spent = products[k] + 2 > work.most
                    if left[k] > ZERO:
                        measured = outside_box
                        if norm[k] <= dropped * norm_before[k] or on_face <= near * goal[k] or spent:
                            ends = ends | bit
                            projects = projects | bit
                    elif pull[k] > norm[k]:
                        ends = ends | bit
                    measure[k] = measured
                    if (ends & bit) == 0:
                        if norm_old[k] > ZERO:
                            conjugate[k] = norm[k] / norm_old[k]
                        if measured <= goal[k] or spent:
                            working = working & (~bit)
                else:
                    norm[k] = norm_old[k]
            work.norm[component] = norm
            work.measure[component] = measure
            work.products[component] = products
            work.length[component] = conjugate
            work.working[component] = working
            work.ends[component] = ends
            work.projects[component] = projects

    @wp.kernel(module=module, enable_backward=False, grid_stride=False)
    def accept(work: Work, first: wp.int32):
        i, lane = wp.tid()
        component = first + i
        projects = work.projects[component]
        if projects == 0:
            return
        saved = values()
        for chunk in range(work.first_chunk[component] + lane, work.first_chunk[component + 1], stride):
            saved += work.sum[chunk]
        saved = total(saved)
        if lane == 0:
            promised = work.promised[component]
            products = work.products[component]
            stuck = work.stuck[component]
            for k in range(count):
                bit = wp.int32(1) << k
                if (projects & bit) != 0:
                    products[k] = products[k] + 1
                    if not (half * saved[k] >= work.enough * promised[k]):
                        stuck = stuck | bit
            work.products[component] = products
            work.stuck[component] = stuck

    @wp.kernel(module=module, enable_backward=False, grid_stride=False)
    def renew(work: Work, first: wp.int32):
        i, lane = wp.tid()
        component = first + i
        ends = work.ends[component]
        if ends == 0:
            return
        norm = values()
        largest = values()
        for chunk in range(work.first_chunk[component] + lane, work.first_chunk[component + 1], stride):
            norm += work.sum[chunk]
            largest = wp.max(largest, work.largest[chunk])
        norm = total(norm)
        if work.by_norm == 0:
            largest = largest_of(largest)
        if lane == 0:
            goal = work.goal[component]
            norm_now = work.norm[component]
            norm_before = work.norm_before[component]
            promised = work.promised[component]
            measure = work.measure[component]
            products = work.products[component]
            stuck = work.stuck[component]
            working = work.working[component]
            for k in range(count):
                bit = wp.int32(1) << k
                if (ends & bit) != 0:
                    norm_now[k] = norm[k]
                    norm_before[k] = norm[k]
                    promised[k] = ZERO
                    measured = largest[k]
                    if work.by_norm == 1:
                        measured = wp.sqrt(norm[k])
                    measure[k] = measured
                    working = working & (~bit)
                    if measured > goal[k] and (stuck & bit) == 0 and products[k] + 2 <= work.most:
                        working = working | bit
            work.norm[component] = norm_now
            work.norm_before[component] = norm_before
            work.promised[component] = promised
            work.measure[component] = measure
            work.working[component] = working
            work.ends[component] = 0
            work.projects[component] = 0

    return ComponentKernels(measure_out, judge, accept, renew)
