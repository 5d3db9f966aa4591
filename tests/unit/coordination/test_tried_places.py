from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from coordination.tried_places import TriedPlaces


def test_a_failure_bars_one_robot() -> None:
    tried = TriedPlaces(0.5, 3)
    assert not tried.failed((1.0, 1.0), "anna", "stuck")
    assert tried.kept_from("anna", 0.0).tolist() == [[1.0, 1.0]]
    assert tried.kept_from("ben", 0.0).tolist() == []
    assert tried.kept_from("anna", 0.0, bars=False).tolist() == []


def test_close_by_is_the_same_place() -> None:
    tried = TriedPlaces(0.5, 3)
    tried.failed((1.0, 1.0), "anna", "stuck")
    assert not tried.failed((1.3, 1.0), "anna", "stuck")
    assert tried.failed((1.0, 1.4), "ben", "no way")
    assert not tried.failed((1.0, 1.0), "carl", "no way")  # given up already
    assert tried.given_up().tolist() == [[1.0, 1.0]]
    given_up = tried.given_up_at((1.2, 1.2))
    assert given_up is not None and given_up.tries == 4
    assert tried.given_up_at((2.0, 2.0)) is None
    assert tried.kept_from("dora", 0.0).tolist() == [[1.0, 1.0]]


def test_a_visited_place_rests() -> None:
    tried = TriedPlaces(0.5, 2)
    assert not tried.visited((1.0, 1.0), "anna", 10.0)
    assert tried.kept_from("ben", 9.9).tolist() == [[1.0, 1.0]]
    assert tried.resting(9.9).tolist() == [[1.0, 1.0]]
    assert tried.resting(10.0).tolist() == []
    assert tried.next_awake(9.0) == 10.0
    assert tried.kept_from("ben", 10.0).tolist() == []
    assert tried.next_awake(10.0) is None
    assert tried.visited((1.0, 1.0), "ben", 20.0)
    assert tried.resting(15.0).tolist() == []  # given up


def test_bars_are_lifted_but_what_was_given_up_stays_so() -> None:
    tried = TriedPlaces(0.5, 2)
    tried.failed((1.0, 1.0), "anna", "stuck")
    tried.failed((5.0, 5.0), "anna", "stuck")
    tried.failed((5.0, 5.0), "ben", "stuck")
    assert tried.lift_bars() == [(1.0, 1.0)]
    assert tried.lift_bars() == []
    assert tried.kept_from("anna", 0.0).tolist() == [[5.0, 5.0]]


points = st.tuples(st.integers(0, 6).map(float), st.just(0.0))


@given(st.lists(st.tuples(points, st.sampled_from(["anna", "ben"])), max_size=30))
def test_every_place_is_given_up_after_so_many_tries(
    tries: list[tuple[tuple[float, float], str]],
) -> None:
    tried = TriedPlaces(0.5, 3)
    last = [place for place, robot in tries if tried.failed(place, robot, "stuck")]
    counts = {place: [p for p, _ in tries].count(place) for place, _ in tries}
    assert sorted(last) == sorted(place for place, count in counts.items() if count >= 3)
    assert len(tried.given_up()) == len(last)
    assert all(math.isclose(y, 0.0) for _, y in tried.given_up())
