from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.grid import CLEAR, OBSTACLE, UNKNOWN
from mapping.visible_gain import Sight, visible_gains

FAR = 1e9  # a free path so long that nothing fades


def test_all_unknown_in_range_is_in_sight_of_a_robot_in_the_void() -> None:
    classes = np.full((61, 61), UNKNOWN, dtype=np.uint8)
    classes[30, 30] = CLEAR
    gains, depends = visible_gains(classes, None, [(30, 30)], Sight(20.0, FAR))
    assert gains[0] == pytest.approx(math.pi * 20.0**2 - 1.0, rel=0.01)
    assert depends[0].tolist() == pytest.approx([10, 10, 51, 51], abs=1)


def test_the_chance_to_see_falls_off_with_the_way_through_the_unknown() -> None:
    classes = np.full((401, 401), UNKNOWN, dtype=np.uint8)
    (gain,), _ = visible_gains(classes, None, [(200, 200)], Sight(190.0, 20.0, rays=360))
    # The integral of 2 pi r exp(-r / f) from the edge of the place's own cell on.
    assert gain == pytest.approx(2.0 * math.pi * 20.0**2, rel=0.15)


def test_nothing_is_in_sight_behind_walls_even_askew_ones() -> None:
    classes = np.full((41, 41), UNKNOWN, dtype=np.uint8)
    for k in range(-10, 11):
        for iy, ix in ((20 + k, 10 + abs(k)), (20 + k, 30 - abs(k))):  # a square on its corner
            classes[iy, ix] = OBSTACLE
        classes[20 + k, 10 + abs(k) + 1 : 30 - abs(k)] = CLEAR
    gains, _ = visible_gains(classes, None, [(20, 20)], Sight(20.0, FAR))
    assert gains[0] == 0.0


def test_a_hole_in_a_wall_shows_little_of_what_a_wide_opening_shows() -> None:
    def room(opening: int) -> float:
        classes = np.full((101, 101), UNKNOWN, dtype=np.uint8)
        classes[:, :60] = CLEAR
        classes[:, 60] = OBSTACLE
        classes[50 - opening : 51 + opening, 60] = CLEAR
        return float(visible_gains(classes, None, [(50, 50)], Sight(40.0, 30.0))[0][0])

    assert 0.0 < room(1) < 0.3 * room(8)


def test_cells_count_by_their_weight_and_off_the_grid_all_is_unknown() -> None:
    classes = np.full((21, 21), UNKNOWN, dtype=np.uint8)
    sight = Sight(9.0, FAR)
    plain, _ = visible_gains(classes, None, [(10, 10)], sight)
    half, _ = visible_gains(classes, np.full((21, 21), 0.5, np.float32), [(10, 10)], sight)
    corner, depends = visible_gains(classes, None, [(0, 0)], sight)
    assert half[0] == pytest.approx(0.5 * plain[0])
    assert corner[0] == pytest.approx(plain[0])
    assert depends[0, 0] < 0


def test_no_places_no_gains() -> None:
    gains, depends = visible_gains(
        np.zeros((3, 3), np.uint8), None, np.zeros((0, 2)), Sight(5.0, 5.0)
    )
    assert (len(gains), len(depends)) == (0, 0)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 100_000), reach=st.sampled_from([3.0, 7.5, 15.0]))
def test_seeing_more_never_promises_more(seed: int, reach: float) -> None:
    rng = np.random.default_rng(seed)
    classes = rng.choice(3, (19, 23), p=[0.5, 0.4, 0.1]).astype(np.uint8)
    known = np.where(rng.random(classes.shape) < 0.3, np.uint8(OBSTACLE), classes)
    places = np.argwhere(classes == CLEAR)
    sight = Sight(reach, 5.0, rays=32)
    before, _ = visible_gains(classes, None, places, sight)
    after, _ = visible_gains(known, None, places, sight)
    assert (after <= before + 1e-9).all()


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 100_000))
def test_nothing_outside_what_a_result_depends_on_matters(seed: int) -> None:
    rng = np.random.default_rng(seed)
    classes = rng.choice(3, (19, 23), p=[0.6, 0.3, 0.1]).astype(np.uint8)
    place, sight = (9, 11), Sight(6.0, 3.0, 32)
    before, (box,) = visible_gains(classes, None, [place], sight)
    other = rng.choice(3, classes.shape).astype(np.uint8)
    low_y, low_x, high_y, high_x = np.maximum(box, 0)
    other[low_y:high_y, low_x:high_x] = classes[low_y:high_y, low_x:high_x]
    after, _ = visible_gains(other, None, [place], sight)
    assert after == before


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 100_000), enough=st.floats(0.0, 100.0))
def test_counting_ends_when_it_is_enough(seed: int, enough: float) -> None:
    rng = np.random.default_rng(seed)
    classes = rng.choice(3, (19, 23), p=[0.6, 0.3, 0.1]).astype(np.uint8)
    places = np.argwhere(classes == CLEAR)
    sight = Sight(6.0, 3.0, 32)
    all_of_it, around = visible_gains(classes, None, places, sight)
    some, looked = visible_gains(classes, None, places, sight, np.full(len(places), enough))
    np.testing.assert_array_equal(np.minimum(some, enough), np.minimum(all_of_it, enough))
    assert (looked[:, :2] >= around[:, :2]).all() and (looked[:, 2:] <= around[:, 2:]).all()
