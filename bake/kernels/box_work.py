"""What the kernels of the least squares solve work on, and their sums over a block's threads.

Unknowns are gone through by chunks, which never cross components: what is summed is added up in a chunk in a fixed
order, and over the chunks of a component in theirs, so that the same device gives the same bits each time. A chunk is a
block of `lanes` threads on CUDA, and one thread on the CPU.
"""

from functools import cache
from typing import Any

import warp as wp

wp.set_module_options({"enable_backward": False, "fast_math": False})


@cache
def work_type(columns: int) -> Any:
    """The struct for so many right-hand sides that share their matrix."""
    values = wp.types.vector(length=columns, dtype=wp.float64)
    counts = wp.types.vector(length=columns, dtype=wp.int32)

    class BoxWork:
        # the scaled system
        row: wp.array(dtype=wp.int32)
        column: wp.array(dtype=wp.int32)
        entry: wp.array(dtype=wp.float64)
        upper: wp.array(dtype=wp.float64)
        reach: wp.array(dtype=wp.float64)  # empty where norms are held against the goal
        by_norm: wp.int32
        most: wp.int32
        enough: wp.float64  # least share of the promised energy that a projection must save
        # chunks of unknowns, and which of them are gone through
        chunk: wp.array(dtype=wp.int32)
        chunk_component: wp.array(dtype=wp.int32)
        first_chunk: wp.array(dtype=wp.int32)
        listed: wp.array(dtype=wp.int32)
        # of each unknown; `face` has a bit for each right-hand side
        x: wp.array(dtype=values)
        gradient: wp.array(dtype=values)
        direction: wp.array(dtype=values)
        product: wp.array(dtype=values)
        x_before: wp.array(dtype=values)
        gradient_before: wp.array(dtype=values)
        face: wp.array(dtype=wp.int32)
        # of each chunk
        sum: wp.array(dtype=values)
        pull: wp.array(dtype=values)
        left: wp.array(dtype=values)
        largest: wp.array(dtype=values)
        largest_pull: wp.array(dtype=values)
        # of each component; masks have a bit for each right-hand side
        goal: wp.array(dtype=values)
        norm: wp.array(dtype=values)
        norm_before: wp.array(dtype=values)
        promised: wp.array(dtype=values)
        measure: wp.array(dtype=values)
        length: wp.array(dtype=values)
        products: wp.array(dtype=counts)
        working: wp.array(dtype=wp.int32)
        ends: wp.array(dtype=wp.int32)
        projects: wp.array(dtype=wp.int32)
        stuck: wp.array(dtype=wp.int32)

    return wp.struct(BoxWork)


def row_sums(columns: int) -> tuple[Any, Any]:
    """Functions for a row of the matrix times some values, and times what puts values outside on their bounds.

    They are written out in C++, which is three times as fast here: through arrays' strides no compiler sees as well.
    """
    values = wp.types.vector(length=columns, dtype=wp.float64)
    each = range(columns)
    begin = "".join(f"double sum_{k} = 0.0; " for k in each)
    end = f"return wp::vec_t<{columns}, wp::float64>({', '.join(f'sum_{k}' for k in each)});"
    row = f"""
        const int* columns = column.data;
        const double* entries = entry.data;
        const wp::vec_t<{columns}, wp::float64>* all = vector.data;
        {begin}
        for (int e = first; e < last; ++e) {{
            const double weight = entries[e];
            const wp::vec_t<{columns}, wp::float64>& there = all[columns[e]];
    """
    product = row + "".join(f"sum_{k} += weight * there.c[{k}]; " for k in each) + "} " + end
    back = "".join(
        f"""
            const double x_{k} = there.c[{k}];
            sum_{k} += weight * (x_{k} < 0.0 ? -x_{k} : (x_{k} > most ? most - x_{k} : 0.0));
        """
        for k in each
    )
    outside = row + "const double most = upper.data[columns[e]];" + back + "} " + end

    @wp.func_native(product)
    def row_product(
        entry: wp.array(dtype=wp.float64),
        column: wp.array(dtype=wp.int32),
        vector: wp.array(dtype=values),
        first: wp.int32,
        last: wp.int32,
    ) -> values: ...

    @wp.func_native(outside)
    def row_outside(
        entry: wp.array(dtype=wp.float64),
        column: wp.array(dtype=wp.int32),
        vector: wp.array(dtype=values),
        upper: wp.array(dtype=wp.float64),
        first: wp.int32,
        last: wp.int32,
    ) -> values: ...

    return row_product, row_outside


def summed(columns: int, lanes: int) -> tuple[Any, Any]:
    """Functions for the sum and the largest of a value over a block's threads; all of them must call, and get it."""
    values = wp.types.vector(length=columns, dtype=wp.float64)
    if lanes == 1:

        @wp.func
        def own_total(value: values) -> values:
            return value

        @wp.func
        def own_largest(value: values) -> values:
            return value

        return own_total, own_largest

    @wp.func
    def total(value: values) -> values:
        return wp.tile_extract(wp.tile_reduce(wp.add, wp.tile(value, preserve_type=True)), 0)

    @wp.func
    def largest(value: values) -> values:
        return wp.tile_extract(wp.tile_reduce(wp.max, wp.tile(value, preserve_type=True)), 0)

    return total, largest
