"""The steps of the least squares solve that go through the unknowns, a chunk a block; see `bake.solve.face_descent`.

Components that are done keep their values: their chunks are passed over, and in a chunk where only one of the
right-hand sides is done its step has no length.
"""

from dataclasses import dataclass
from typing import Any

import warp as wp

from bake.kernels.box_work import row_sums, summed, work_type

wp.set_module_options({"enable_backward": False, "fast_math": False})

ZERO, ONE = wp.constant(wp.float64(0.0)), wp.constant(wp.float64(1.0))


@dataclass(frozen=True, slots=True)
class RowKernels:
    """The kernels over listed chunks; the last argument is the first of them.

    Attributes:
        begin: Gradient of the values, with the right-hand side in `product`.
        multiply: Product with the direction, and the curvature along it.
        move: A step along the direction, and what the gradient is then.
        project: Gradient once values outside are put on their bounds, and the energy saved on the face.
        turn: The next direction; where a face ended, the next face.
    """

    begin: Any
    multiply: Any
    move: Any
    project: Any
    turn: Any


def row_kernels(columns: int, lanes: int, module: str) -> RowKernels:
    """For some number of right-hand sides, and of threads a block."""
    values = wp.types.vector(length=columns, dtype=wp.float64)
    Work = work_type(columns)
    total, largest_of = summed(columns, lanes)
    row_product, row_outside = row_sums(columns)
    stride = wp.constant(lanes)
    count = wp.constant(columns)

    @wp.kernel(module=module, enable_backward=False, grid_stride=False)
    def begin(work: Work, first: wp.int32):
        i, lane = wp.tid()
        chunk = work.listed[first + i]
        for r in range(work.chunk[chunk] + lane, work.chunk[chunk + 1], stride):
            product = row_product(work.entry, work.column, work.x, work.row[r], work.row[r + 1])
            work.gradient[r] = product - work.product[r]

    @wp.kernel(module=module, enable_backward=False, grid_stride=False)
    def multiply(work: Work, first: wp.int32):
        i, lane = wp.tid()
        chunk = work.listed[first + i]
        if work.working[work.chunk_component[chunk]] == 0:
            return
        curvature = values()
        for r in range(work.chunk[chunk] + lane, work.chunk[chunk + 1], stride):
            product = row_product(work.entry, work.column, work.direction, work.row[r], work.row[r + 1])
            work.product[r] = product
            curvature += wp.cw_mul(work.direction[r], product)
        curvature = total(curvature)
        if lane == 0:
            work.sum[chunk] = curvature

    @wp.kernel(module=module, enable_backward=False, grid_stride=False)
    def move(work: Work, first: wp.int32):
        i, lane = wp.tid()
        chunk = work.listed[first + i]
        component = work.chunk_component[chunk]
        if work.working[component] == 0:
            return
        length = work.length[component]
        norm = values()
        pull = values()
        left = values()
        largest = values()
        largest_pull = values()
        for r in range(work.chunk[chunk] + lane, work.chunk[chunk + 1], stride):
            x = work.x[r] - wp.cw_mul(length, work.direction[r])
            gradient = work.gradient[r] - wp.cw_mul(length, work.product[r])
            work.x[r] = x
            work.gradient[r] = gradient
            upper = work.upper[r]
            face = work.face[r]
            reach = ZERO
            if work.by_norm == 0:
                reach = work.reach[r]
            for k in range(count):
                g = gradient[k]
                if ((face >> k) & 1) == 1:
                    norm[k] = norm[k] + g * g
                    largest[k] = wp.max(largest[k], wp.abs(g) * reach)
                    if x[k] < ZERO or x[k] > upper:
                        left[k] = ONE
                else:
                    if (x[k] <= ZERO and g < ZERO) or (x[k] > ZERO and g > ZERO):
                        pull[k] = pull[k] + g * g
                        largest_pull[k] = wp.max(largest_pull[k], wp.abs(g) * reach)
        norm = total(norm)
        pull = total(pull)
        left = largest_of(left)
        if work.by_norm == 0:
            largest = largest_of(largest)
            largest_pull = largest_of(largest_pull)
        if lane == 0:
            work.sum[chunk] = norm
            work.pull[chunk] = pull
            work.left[chunk] = left
            work.largest[chunk] = largest
            work.largest_pull[chunk] = largest_pull

    @wp.kernel(module=module, enable_backward=False, grid_stride=False)
    def project(work: Work, first: wp.int32):
        i, lane = wp.tid()
        chunk = work.listed[first + i]
        component = work.chunk_component[chunk]
        projects = work.projects[component]
        if projects == 0:
            return
        saved = values()
        for r in range(work.chunk[chunk] + lane, work.chunk[chunk + 1], stride):
            change = row_outside(work.entry, work.column, work.x, work.upper, work.row[r], work.row[r + 1])
            x = work.x[r]
            x_before = work.x_before[r]
            gradient = work.gradient[r]
            gradient_before = work.gradient_before[r]
            for k in range(count):
                if ((projects >> k) & 1) == 1:
                    gradient[k] = gradient[k] + change[k]
                    step = x_before[k] - wp.clamp(x[k], ZERO, work.upper[r])
                    saved[k] = saved[k] + (gradient[k] + gradient_before[k]) * step
            work.gradient[r] = gradient
        saved = total(saved)
        if lane == 0:
            work.sum[chunk] = saved

    @wp.kernel(module=module, enable_backward=False, grid_stride=False)
    def turn(work: Work, first: wp.int32):
        i, lane = wp.tid()
        chunk = work.listed[first + i]
        component = work.chunk_component[chunk]
        ends = work.ends[component]
        if (work.working[component] | ends) == 0:
            return
        projects = work.projects[component]
        stuck = work.stuck[component]
        conjugate = work.length[component]
        norm = values()
        largest = values()
        for r in range(work.chunk[chunk] + lane, work.chunk[chunk + 1], stride):
            gradient = work.gradient[r]
            direction = work.direction[r]
            face = work.face[r]
            if ends == 0:
                for k in range(count):
                    if ((face >> k) & 1) == 1:
                        direction[k] = gradient[k] + conjugate[k] * direction[k]
            else:
                x = work.x[r]
                x_before = work.x_before[r]
                gradient_before = work.gradient_before[r]
                upper = work.upper[r]
                reach = ZERO
                if work.by_norm == 0:
                    reach = work.reach[r]
                for k in range(count):
                    bit = wp.int32(1) << k
                    if (ends & bit) != 0:
                        if (stuck & bit) != 0:
                            x[k] = x_before[k]
                            gradient[k] = gradient_before[k]
                        elif (projects & bit) != 0:
                            x[k] = wp.clamp(x[k], ZERO, upper)
                        x_before[k] = x[k]
                        gradient_before[k] = gradient[k]
                        g = gradient[k]
                        direction[k] = ZERO
                        face = face & (~bit)
                        if not ((x[k] <= ZERO and g >= ZERO) or (x[k] >= upper and g <= ZERO)):
                            face = face | bit
                            direction[k] = g
                            norm[k] = norm[k] + g * g
                            largest[k] = wp.max(largest[k], wp.abs(g) * reach)
                    elif (face & bit) != 0:
                        direction[k] = gradient[k] + conjugate[k] * direction[k]
                work.x[r] = x
                work.gradient[r] = gradient
                work.x_before[r] = x_before
                work.gradient_before[r] = gradient_before
                work.face[r] = face
            work.direction[r] = direction
        if ends != 0:
            norm = total(norm)
            if work.by_norm == 0:
                largest = largest_of(largest)
            if lane == 0:
                work.sum[chunk] = norm
                work.largest[chunk] = largest

    return RowKernels(begin, multiply, move, project, turn)
