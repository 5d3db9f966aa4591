from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.frontier_tour import _shorten_route, values_after, ways_between
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


def after(xs, gains, worth=1.0, beyond=None, wanted=None):
    places = np.array(xs, dtype=np.float64)
    return values_after(
        np.abs(places[:, np.newaxis] - places),
        np.array(gains, dtype=np.float64),
        np.zeros(len(xs)) if beyond is None else np.array(beyond, dtype=np.float64),
        np.arange(len(xs)) if wanted is None else np.array(wanted, dtype=np.int64),
        worth,
    )


def test_a_route_goes_on_to_what_pays():
    # From each place the other is 12 m away: 20 m2 are worth that, 5 are not.
    assert after([-2.0, 10.0], [5.0, 20.0]).tolist() == [8.0, 0.0]


def test_what_pays_on_the_way_is_taken_along():
    values = after([0.0, 5.0, 10.0], [0.0, 1.0, 30.0])
    assert values[0] == pytest.approx(30.0 + 1.0 - 10.0)


def test_what_lies_beyond_the_last_place_is_not_driven_back():
    values = after([0.0, 2.0], [9.0, 9.0], beyond=[5.0, 0.0])
    assert values.tolist() == [9.0 - 2.0 - 5.0, 9.0 - 2.0]


def test_places_that_are_not_wanted_are_passed_over():
    assert after([0.0, 1.0, 2.0], [9.0, 9.0, 9.0], wanted=[1]).tolist() == [8.0, 0.0, 8.0]
    assert after([0.0, 1.0], [9.0, 9.0], wanted=[]).tolist() == [0.0, 0.0]


def best_after(between, gains, worth: float, start: int) -> float:
    others = [k for k in range(len(gains)) if k != start]
    best = 0.0
    for count in range(1, len(others) + 1):
        for route in itertools.permutations(others, count):
            way = sum(between[a, b] for a, b in itertools.pairwise((start, *route)))
            best = max(best, sum(gains[k] for k in route) - worth * way)
    return best


@given(
    st.lists(
        st.tuples(st.floats(-9, 9), st.floats(-9, 9), st.floats(0, 20)), min_size=1, max_size=5
    )
)
@settings(max_examples=30, deadline=None)
def test_no_route_is_worth_more_than_the_best(rows):
    table = np.array(rows)
    places, gains = table[:, :2], table[:, 2]
    between = np.hypot(*(places[:, np.newaxis] - places).transpose(2, 0, 1))
    found = values_after(between, gains, np.zeros(len(rows)), np.arange(len(rows)), 1.0)
    for j in range(len(rows)):
        best = best_after(between, gains, 1.0, j)
        assert -1e-9 <= found[j] <= best + 1e-9


def test_crossed_routes_are_straightened():
    rng = np.random.default_rng(2)
    places = rng.uniform(0.0, 20.0, (14, 2))
    between = np.hypot(*(places[:, np.newaxis] - places).transpose(2, 0, 1))
    route = rng.permutation(14)
    before = sum(between[a, b] for a, b in itertools.pairwise(route))
    saved = _shorten_route(between, np.zeros(14), route)
    assert sorted(route.tolist()) == list(range(14))
    after = sum(between[a, b] for a, b in itertools.pairwise(route))
    assert after == pytest.approx(before - saved) and saved > 0.3 * before
