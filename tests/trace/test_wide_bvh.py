"""The shallow tree over boxes of fog, and its walk as CUDA compiles it."""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp
from hypothesis import given, settings
from hypothesis import strategies as st

from bake.devices import initialised_warp
from bake.kernels.veil import FOG_WALK
from bake.trace.wide_bvh import LANES, LEAF, WIDEST, build_wide_bvh, node_widths


def boxes(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Boxes scattered over a field."""
    rng = np.random.default_rng(seed)
    low = rng.uniform(-50.0, 50.0, (count, 3)).astype(np.float32) * np.float32([1.0, 0.1, 1.0])
    return low, low + rng.uniform(0.1, 3.0, (count, 3)).astype(np.float32)


@given(st.integers(1, 3000), st.integers(0, 9))
@settings(max_examples=40, deadline=None)
def test_every_box_is_in_one_leaf_and_within_all_its_nodes(count: int, seed: int) -> None:
    """Walked from the root, each box turns up once, and lies in the bounds that every node above keeps for it."""
    low, high = boxes(count, seed)
    tree = build_wide_bvh(low, high)
    assert sorted(tree.order.tolist()) == list(range(count))
    found: list[int] = []
    pending = [(0, np.full(3, -np.inf), np.full(3, np.inf))]
    while pending:
        node, node_low, node_high = pending.pop()
        first_group, groups, first = tree.node[node].tolist()
        group = tree.bounds[first_group : first_group + groups]
        child_low = group[:, :3].transpose(0, 2, 1).reshape(-1, 3)
        child_high = group[:, 3:].transpose(0, 2, 1).reshape(-1, 3)
        real = np.flatnonzero(child_low[:, 0] < 1e38)
        assert (child_low[real] >= node_low).all()
        assert (child_high[real] <= node_high).all()
        if first < 0:
            number = tree.order[-1 - first + real]
            np.testing.assert_array_equal(child_low[real], low[number])
            np.testing.assert_array_equal(child_high[real], high[number])
            found += number.tolist()
            assert -1 - first + LANES * groups <= tree.places
        else:
            pending += [(first + int(c), child_low[c], child_high[c]) for c in real]
    assert sorted(found) == list(range(count))


@pytest.mark.parametrize("count", [1, 16, 17, 8000, 16385, 10**6, 10**9])
def test_levels_are_few_and_fit_the_stack(count: int) -> None:
    """No node is wider than allowed, the levels hold all boxes, and the walk's 192 places are enough."""
    widths = node_widths(count)
    assert widths[0] == LEAF
    assert max(widths[1:], default=0) <= WIDEST
    assert np.prod(np.array(widths, object)) >= count
    assert 1 + sum(width - 1 for width in widths[1:]) + LANES <= 192


def depths(source: str, *arrays: wp.array) -> np.ndarray:
    """Optical depths of rays 40 m long by a version of the walk."""

    @wp.func_native(source)
    def native(
        bounds: wp.array(dtype=wp.float32),
        node: wp.array(dtype=wp.int32),
        density: wp.array(dtype=wp.float32),
        o: wp.vec3,
        d: wp.vec3,
        t_max: wp.float32,
        limit: wp.float32,
    ) -> wp.float32: ...

    @wp.kernel(module="unique", enable_backward=False)
    def walk(
        bounds: wp.array(dtype=wp.float32),
        node: wp.array(dtype=wp.int32),
        density: wp.array(dtype=wp.float32),
        origin: wp.array(dtype=wp.vec3),
        way: wp.array(dtype=wp.vec3),
        depth: wp.array(dtype=wp.float32),
    ):
        i = wp.tid()
        depth[i] = native(bounds, node, density, origin[i], way[i], 40.0, 1.0)

    found = wp.zeros(len(arrays[-1]), dtype=wp.float32, device="cpu")
    wp.launch(walk, dim=len(found), inputs=[*arrays, found], device="cpu")
    return found.numpy()


def test_the_walk_of_cuda_finds_the_same() -> None:
    """Compiled for the CPU, the lines meant for CUDA sum up the same depths, up to the same limit."""
    initialised_warp()
    low, high = boxes(700, 3)
    tree = build_wide_bvh(low, high)
    rng = np.random.default_rng(4)
    density = np.zeros(tree.places, np.float32)
    density[: len(low)] = rng.uniform(0.01, 0.3, len(low))
    ways = rng.normal(size=(2000, 3)) * (1.0, 0.1, 1.0)
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    origins = rng.uniform(-50.0, 50.0, (2000, 3)) * (1.0, 0.1, 1.0)
    arrays = [
        wp.array(values, dtype=kind, device="cpu")
        for values, kind in (
            (tree.bounds.ravel(), wp.float32),
            (tree.node.ravel(), wp.int32),
            (density, wp.float32),
            (origins.astype(np.float32), wp.vec3),
            (ways.astype(np.float32), wp.vec3),
        )
    ]
    here = depths(FOG_WALK, *arrays)
    there = depths(FOG_WALK.replace("#if defined(__CUDA_ARCH__)", "#if 1"), *arrays)
    assert FOG_WALK.count("#if") == 1
    assert (here == 1.0).any()
    assert (here == 0.0).any()
    np.testing.assert_allclose(there, here, atol=1e-5)
