from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.frontier_tour import round_lengths, ways_between
from mapping.path_planning import cost_field


def corridor() -> np.ndarray:
    """A corridor along row 1 with rooms of two cells beside it at columns 2, 6 and 10."""
    weights = np.zeros((5, 13), dtype=np.uint8)
    weights[1, :] = 1
    for column in (2, 6, 10):
        weights[2:4, column] = 1
    return weights


def test_ways_between_rooms_lead_through_the_corridor():
    weights = corridor()
    field = cost_field(weights, [(1, 0)], 1.0)
    rooms = [(3, 2), (3, 6), (3, 10)]
    ways = ways_between(field, weights, rooms, 0.0)
    assert np.array_equal(ways, ways.T) and (np.diag(ways) == 0.0).all()
    for j, k in itertools.combinations(range(3), 2):
        there = cost_field(weights, [rooms[j]], 1.0).at([rooms[k]])[0]
        assert ways[j, k] == pytest.approx(there)


def test_places_in_sight_take_the_straight_way():
    weights = np.ones((21, 21), dtype=np.uint8)
    field = cost_field(weights, [(10, 10)], 0.5)
    corners = [(2, 2), (2, 18)]
    assert ways_between(field, weights, corners, 0.0)[0, 1] > 10.0
    assert ways_between(field, weights, corners, 20.0)[0, 1] == pytest.approx(8.0)


def test_ways_are_never_shorter_than_the_cheapest():
    rng = np.random.default_rng(4)
    weights = (rng.random((30, 30)) > 0.25).astype(np.uint8)
    weights[0, 0] = 1
    field = cost_field(weights, [(0, 0)], 1.0)
    reached = np.argwhere(np.isfinite(field.cost))[::37]
    ways = ways_between(field, weights, reached, 0.0)
    for j, cell in enumerate(reached):
        true = cost_field(weights, [tuple(cell)], 1.0).at(reached)
        assert (ways[j] >= true - 1e-6).all()


def test_no_places_have_no_ways():
    weights = corridor()
    field = cost_field(weights, [(1, 0)], 1.0)
    assert ways_between(field, weights, np.zeros((0, 2), dtype=np.int64), 5.0).shape == (0, 0)


def lengths(xs: list[float], start: float, beyond: list[float] | None = None, wanted=None):
    places = np.array(xs)
    between = np.abs(places[:, np.newaxis] - places)
    return round_lengths(
        between,
        np.abs(places - start),
        np.zeros(len(xs)) if beyond is None else np.array(beyond),
        np.arange(len(xs)) if wanted is None else np.array(wanted, dtype=np.int64),
    )


def test_the_near_corner_first_makes_the_shorter_round():
    near, far = lengths([-2.0, 10.0], start=0.0)
    assert near == pytest.approx(2.0 + 12.0)
    assert far == pytest.approx(10.0 + 12.0)


def test_what_lies_beyond_the_last_place_is_not_driven_back():
    near, far = lengths([-3.0, 3.0], start=0.0, beyond=[5.0, 0.0])
    assert near == pytest.approx(3.0 + 5.0 + 6.0)
    assert far == pytest.approx(3.0 + 6.0)


def test_a_place_that_is_not_wanted_is_visited_by_its_own_round_only():
    first, second = lengths([1.0, 5.0], start=0.0, wanted=[0])
    assert first == pytest.approx(1.0)
    assert second == pytest.approx(5.0 + 4.0)


@given(st.lists(st.tuples(st.floats(-9, 9), st.floats(-9, 9)), min_size=1, max_size=6))
@settings(max_examples=30, deadline=None)
def test_a_round_is_no_shorter_than_the_shortest_and_not_much_longer(rows):
    places = np.array(rows)
    between = np.hypot(*(places[:, np.newaxis] - places).transpose(2, 0, 1))
    first = np.hypot(places[:, 0], places[:, 1])
    found = round_lengths(between, first, np.zeros(len(rows)), np.arange(len(rows)))
    for j in range(len(rows)):
        rest = [k for k in range(len(rows)) if k != j]
        shortest = first[j] + min(
            sum(between[a, b] for a, b in itertools.pairwise((j, *order)))
            for order in itertools.permutations(rest)
        )
        assert shortest - 1e-9 <= found[j] <= 1.5 * shortest + 1e-9
