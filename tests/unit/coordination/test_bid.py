from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coordination.bid import (
    RobotBid,
    inside,
    near,
    overlap_fraction,
    overlap_fractions,
    true_overlap,
)
from mapping.geometry import IDENTITY

corner = st.integers(0, 7)


@st.composite
def whole_rectangles(draw: st.DrawFn) -> list[float]:
    x0, y0 = draw(corner), draw(corner)
    return [x0, y0, x0 + draw(st.integers(1, 4)), y0 + draw(st.integers(1, 4))]


def _cells(rectangle: list[float]) -> np.ndarray:
    x0, y0, x1, y1 = (int(v) for v in rectangle)
    return np.array([(y, x) for y in range(y0, y1) for x in range(x0, x1)], dtype=np.int64)


@settings(deadline=None, max_examples=60)
@given(whole_rectangles(), st.lists(whole_rectangles(), min_size=1, max_size=5))
def test_overlap_is_the_share_of_cells(rectangle: list[float], taken: list[list[float]]) -> None:
    union = np.concatenate([_cells(t) for t in taken])
    expected = true_overlap(_cells(rectangle), union)
    assert overlap_fraction(rectangle, taken) == pytest.approx(expected, abs=1e-12)


@settings(deadline=None, max_examples=40)
@given(st.lists(whole_rectangles(), max_size=5), st.lists(whole_rectangles(), max_size=5))
def test_more_taken_never_overlaps_less(a: list[list[float]], b: list[list[float]]) -> None:
    rows = np.array([[0.5, 0.5, 6.5, 6.5], [3.0, 3.0, 3.5, 9.0]])
    few = overlap_fractions(rows, np.array(a, dtype=np.float64).reshape(-1, 4))
    many = overlap_fractions(rows, np.array(a + b, dtype=np.float64).reshape(-1, 4))
    assert (many >= few - 1e-12).all() and (many <= 1.0).all() and (few >= 0.0).all()


def test_overlap_examples() -> None:
    one = [0.0, 0.0, 2.0, 2.0]
    assert overlap_fraction(one, []) == 0.0
    assert overlap_fraction(one, [one]) == 1.0
    assert overlap_fraction(one, [[1.0, 0.0, 3.0, 2.0]]) == 0.5
    assert overlap_fraction(one, [[5.0, 5.0, 6.0, 6.0]]) == 0.0
    cross = [[0.5, 0.0, 1.5, 2.0], [0.0, 0.5, 2.0, 1.5]]
    assert overlap_fraction(one, cross) == pytest.approx(0.75)


def test_a_rectangle_without_area() -> None:
    assert overlap_fraction([1.0, 1.0, 1.0, 1.0], [[0.0, 0.0, 2.0, 2.0]]) == 1.0
    assert overlap_fraction([3.0, 1.0, 3.0, 1.0], [[0.0, 0.0, 2.0, 2.0]]) == 0.0


def test_true_overlap_of_nothing() -> None:
    none = np.empty((0, 2), dtype=np.int64)
    some = np.array([[-3, 4], [-3, 5]])
    assert true_overlap(none, some) == 0.0 == true_overlap(some, none)
    assert true_overlap(some, np.array([[-3, 5], [-3, 5], [0, 0]])) == 0.5


def test_near_and_inside() -> None:
    places = np.array([[0.0, 0.0], [1.0, 0.0], [5.0, 5.0]])
    assert near(places, [[0.6, 0.0]], 0.5).tolist() == [False, True, False]
    assert near(places, [], 0.5).tolist() == [False, False, False]
    assert inside(places, (0.0, 0.0, 1.0, 1.0)).tolist() == [True, True, False]


def test_without_leaves_places_out() -> None:
    bid = RobotBid(
        "robin",
        1,
        1,
        IDENTITY,
        np.array([[0.0, 0.0], [3.0, 0.0]]),
        np.array([5.0, 6.0]),
        np.array([1.0, 2.0]),
        np.zeros((2, 4)),
        np.empty((0, 2)),
        np.array([0.0, 4.0]),
        2.0,
    )
    rest = bid.without([(0.1, 0.1)], 0.5)
    assert (
        len(rest) == 1
        and rest.gains.tolist() == [6.0]
        and rest.losses.tolist() == [4.0]
        and rest.cost_weight == 2.0
    )
    assert bid.without([], 0.5) is bid
