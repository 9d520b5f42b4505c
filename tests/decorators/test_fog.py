"""Shrubs as boxes of fog: which boxes, which densities, overlap and fitting."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bake.decorators.fog import make_fog
from bake.decorators.fog_density import without_overlap
from bake.decorators.fog_fit import HIGHEST
from bake.errors import SettingsError
from bake.settings import BakeSettings
from bake.types import ObjectKeys, Role, World
from tests.worlds import box, icosphere, make_world, quad

SETTINGS = BakeSettings()


def shrubs(*shapes: tuple[np.ndarray, np.ndarray], keys: tuple[ObjectKeys, ...] = (), openness: float = 0.0) -> World:
    """A floor that casts, and shrubs."""
    casts = np.array([True, True] + [False] * sum(len(f) for _, f in shapes))
    return make_world(
        quad(50.0),
        *shapes,
        casts=casts,
        samples=casts,
        openness=np.where(casts, 0.0, openness),
        roles=(Role.STATIC, *[Role.SHRUB] * len(shapes)),
        keys=(ObjectKeys(), *(keys or [ObjectKeys()] * len(shapes))),
    )


def test_no_shrubs_no_fog() -> None:
    """Without shrubs, or where the stage is skipped, there is none."""
    assert make_fog(make_world(quad()), SETTINGS) is None
    assert make_fog(shrubs(box()), SETTINGS.replaced(skip=("fog",))) is None
    assert make_fog(shrubs((np.zeros((0, 3)), np.zeros((0, 3), int))), SETTINGS) is None


def test_box_and_density_of_each_shrub() -> None:
    """A box is that of the faces' vertices; the object's own density wins."""
    lone = np.concatenate([icosphere(1, 1.0, centre=(9.0, 1.0, 0.0))[0], [[99.0, 99.0, 99.0]]])
    world = shrubs(
        box((1.0, 2.0, 3.0), centre=(-5.0, 1.0, 0.0)),
        (lone, icosphere(1)[1]),
        keys=(ObjectKeys(density=2.5), ObjectKeys()),
    )
    fog = make_fog(world, SETTINGS.replaced(fog_density=0.3))
    assert fog is not None
    np.testing.assert_array_equal(fog.object, [1, 2])
    np.testing.assert_allclose(fog.minimum[0], [-5.5, 0.0, -1.5])
    np.testing.assert_allclose(fog.maximum[0], [-4.5, 2.0, 1.5])
    assert fog.maximum[1].max() <= 10.0
    np.testing.assert_allclose(fog.given_density, [2.5, 0.3])
    np.testing.assert_array_equal(fog.density, fog.given_density)


@pytest.mark.parametrize("count", [2, 3, 17])
def test_coincident_boxes_share_their_density(count: int) -> None:
    """Each of n boxes in one place gets exactly an nth."""
    low, high = np.tile(np.float32([[1, 2, 3]]), (count, 1)), np.tile(np.float32([[2, 5, 4]]), (count, 1))
    given_density = np.full(count, 0.7, np.float32)
    np.testing.assert_array_equal(without_overlap(low, high, given_density), given_density / np.float32(count))


def test_overlap_lowers_by_the_shared_volume() -> None:
    """Half of the small box lies in the large one, which loses an eighth part of a half to it."""
    low = np.float32([[0, 0, 0], [1, 0, 0], [10, 0, 0]])
    high = np.float32([[2, 2, 2], [3, 1, 1], [11, 1, 1]])
    lowered = without_overlap(low, high, np.ones(3, np.float32))
    np.testing.assert_allclose(lowered, [1 / (1 + 1 / 8), 1 / (1 + 1 / 2), 1.0], rtol=1e-6)


def test_empty_boxes_lower_nothing() -> None:
    """A box without density takes nothing from the box that it coincides with."""
    low, high = np.zeros((2, 3), np.float32), np.ones((2, 3), np.float32)
    np.testing.assert_array_equal(without_overlap(low, high, np.float32([0.5, 0.0])), np.float32([0.5, 0.0]))


BOXES = arrays(np.float32, (9, 6), elements=st.integers(-4, 4).map(float))


@given(BOXES)
def test_sweep_equals_all_pairs(corners: np.ndarray) -> None:
    """The sweep finds what comparing every pair finds, flat and coincident boxes included."""
    low, high = np.minimum(corners[:, :3], corners[:, 3:]), np.maximum(corners[:, :3], corners[:, 3:])
    lowered = without_overlap(low, high, np.ones(9, np.float32))
    for i in range(9):
        shared = 0.0
        for j in range(9):
            if i != j:
                overlap, edge = np.minimum(high[i], high[j]) - np.maximum(low[i], low[j]), high[i] - low[i]
                shared += float(
                    np.prod([o >= 0 if e == 0 else max(o, 0) / e for o, e in zip(overlap, edge, strict=True)])
                )
        assert lowered[i] == pytest.approx(1.0 / (1.0 + shared), rel=1e-5)


def test_thousands_of_boxes_in_parts() -> None:
    """Eight thousand crowded boxes: none gains density, and the crowd is far thinner than its boxes."""
    rng = np.random.default_rng(1)
    low = rng.uniform(0, 60, (8000, 3)).astype(np.float32) * np.float32([1, 0.05, 1])
    lowered = without_overlap(low, low + np.float32(2.0), np.ones(8000, np.float32))
    assert lowered.max() <= 1.0
    assert lowered.min() > 0.0
    assert lowered.mean() < 0.4


def test_fit_finds_the_density_of_stacked_cards() -> None:
    """Many faint, evenly spread cards in random places are fog: its density is found from rays."""
    rng = np.random.default_rng(3)
    # Cards of random orientation and area a, n a volume, of openness o: σ = n a / 2 (1 - o) per unit of length.
    count, openness, edge = 20000, 0.9, 0.12
    centre = rng.uniform(0, 4, (count, 3))
    frames = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0][:, :2] * edge / 2
    corners = np.stack(
        [centre + s * frames[:, 0] + t * frames[:, 1] for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))], 1
    )
    first = 4 * np.arange(count)[:, None]
    faces = np.concatenate([first + np.array(corner) for corner in ([0, 1, 2], [0, 2, 3])])
    world = shrubs((corners.reshape(-1, 3), faces), openness=openness)
    fog = make_fog(world, SETTINGS.replaced(fit_fog=True))
    assert fog is not None
    volume = float((fog.maximum - fog.minimum).prod())
    assert fog.given_density[0] == pytest.approx(count * edge**2 / 2 * (1 - openness) / volume, rel=0.05)


def test_fit_extremes() -> None:
    """A closed box is as dense as allowed or nearly so, an open one has none; a said density stays; flat is nothing."""
    closed, said = box(), box(centre=(5.0, 0.0, 0.0))
    fog = make_fog(shrubs(closed, said, keys=(ObjectKeys(), ObjectKeys(density=0.2))), SETTINGS.replaced(fit_fog=True))
    assert fog is not None
    assert 50.0 < fog.given_density[0] <= HIGHEST
    assert fog.given_density[1] == np.float32(0.2)
    clear = make_fog(shrubs(icosphere(1), quad(1.0, 3.0), openness=1.0), SETTINGS.replaced(fit_fog=True))
    assert clear is not None
    np.testing.assert_array_equal(clear.given_density, 0.0)


def test_fit_sees_only_the_shrub_itself() -> None:
    """A shrub fitted among others equals the same shrub fitted alone, wherever it stands."""
    shape = icosphere(1, 0.7)
    moved = (shape[0] + [12.0, 3.0, -4.0], shape[1])
    inside = (shape[0] * 0.5, shape[1])
    settings = SETTINGS.replaced(fit_fog=True)
    alone, among = make_fog(shrubs(shape), settings), make_fog(shrubs(inside, moved, shape), settings)
    assert alone is not None
    assert among is not None
    np.testing.assert_allclose(among.given_density[1:], alone.given_density[0], rtol=0.03)
    assert among.given_density[0] == pytest.approx(2.0 * alone.given_density[0], rel=0.05)


@pytest.mark.parametrize("density", [-0.1, math.inf, math.nan, 1e9])
def test_fog_density_has_bounds(density: float) -> None:
    """Nonsense is refused."""
    with pytest.raises(SettingsError, match="fog-density"):
        BakeSettings(fog_density=density)
