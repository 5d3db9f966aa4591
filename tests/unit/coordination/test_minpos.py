from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coordination.bid import RobotBid
from coordination.strategies.minpos import MinPos, MinPosSettings
from coordination.strategies.nearest import Nearest
from coordination.strategy import Region
from mapping.geometry import IDENTITY


def bid(robot: str, *rows: tuple[float, float, float], cost_weight: float = 1.0) -> RobotBid:
    """A bid of places on the x axis: x, gain, cost."""
    table = np.array(rows, dtype=np.float64).reshape(-1, 3)
    places = np.column_stack((table[:, 0], np.zeros(len(table))))
    rectangles = np.column_stack((places - 1.0, places + 1.0))
    return RobotBid(
        robot,
        1,
        1,
        IDENTITY,
        places,
        table[:, 1],
        table[:, 2],
        rectangles,
        np.empty((0, 2)),
        np.zeros(len(table)),
        cost_weight,
    )


def at(robot: str, x: float) -> Region:
    return Region(robot, (x, 0.0), (x - 1.0, -1.0, x + 1.0, 1.0))


def goals(
    bids: tuple[RobotBid, ...],
    current: tuple[Region, ...] = (),
    running: tuple[Region, ...] = (),
    **given: float,
) -> list[tuple[str, float, float]]:
    """Who goes to which x, by which utility."""
    choices = MinPos.from_settings(given).assign(bids, current, running)
    return [(choice.robot, choice.goal[0], choice.utility) for choice in choices]


def test_the_second_nearest_robot_goes_where_it_is_the_nearest() -> None:
    # Both are nearest to the frontier at 5; only for anna nobody is nearer.
    anna = bid("anna", (5, 9, 2), (-9, 9, 12))
    ben = bid("ben", (5, 9, 3), (-9, 9, 11))
    assert goals((anna, ben)) == [("anna", 5, 0), ("ben", -9, 0)]


def test_at_equal_ways_the_smaller_name_comes_first() -> None:
    rows = ((5.0, 9.0, 2.0), (9.0, 9.0, 6.0))
    assert goals((bid("anna", *rows), bid("ben", *rows))) == [("anna", 5, 0), ("ben", 5, -1)]
    # With a third frontier that only ben knows of, he goes there, far as it is.
    ben = bid("ben", *rows, (30, 9, 40))
    assert goals((bid("anna", *rows), ben))[1] == ("ben", 30, 0)


def test_more_robots_than_frontiers_meet_at_the_last_one() -> None:
    bids = tuple(bid(name, (5, 9, way)) for way, name in enumerate(("anna", "ben", "carl"), 1))
    assert goals(bids) == [("anna", 5, 0), ("ben", 5, -1), ("carl", 5, -2)]


def test_a_frontier_is_more_than_one_place() -> None:
    # Anna is nearer to one end of it, ben to the other; she is nearer on the whole.
    anna = bid("anna", (5, 9, 2), (5.8, 9, 4), (-9, 9, 12))
    ben = bid("ben", (5, 9, 4), (5.8, 9, 3), (-9, 9, 13))
    assert goals((anna, ben)) == [("anna", 5, 0), ("ben", 5.8, -1)]
    assert goals((anna, ben), frontier_m=0.5) == [("anna", 5, 0), ("ben", 5.8, 0)]


def test_places_of_two_robots_need_not_be_the_very_same() -> None:
    anna = bid("anna", (5, 9, 2))
    ben = bid("ben", (5.3, 9, 3), (9, 9, 7))
    assert goals((anna, ben)) == [("anna", 5, 0), ("ben", 9, 0)]
    assert goals((anna, ben), frontier_m=0.2)[1] == ("ben", 5.3, 0)


def test_a_robot_that_goes_on_is_nearest_to_its_goal() -> None:
    anna = bid("anna", (5, 9, 2), (9, 9, 6))
    assert goals((anna,)) == [("anna", 5, 0)]
    assert goals((anna,), running=(at("ben", 5.4),)) == [("anna", 9, 0)]
    assert goals((anna,), running=(at("ben", 5.4), at("carl", 9.0))) == [("anna", 5, -1)]


def test_who_gains_too_little_there_is_in_nobodys_way() -> None:
    anna, ben = bid("anna", (5, 0.1, 1)), bid("ben", (5, 9, 3), (9, 9, 7))
    assert goals((anna, ben)) == [("ben", 5, 0)]
    assert goals((anna, bid("ben"))) == []
    assert goals((bid("anna", (5, 0.0, 1)),), min_gain_m2=0.0) == []


def test_the_ways_of_a_slow_robot_are_longer() -> None:
    slow = bid("anna", (5, 9, 2), (-9, 9, 12), cost_weight=2.0)
    assert goals((slow, bid("ben", (5, 9, 3), (-9, 9, 30)))) == [("anna", -9, 0), ("ben", 5, 0)]


def test_a_robot_goes_on_to_its_goal_while_its_rank_there_is_the_best() -> None:
    anna = bid("anna", (5, 9, 2), (9, 9, 6))
    assert goals((anna,), (at("anna", 9.2),)) == [("anna", 9, 0)]
    assert goals((anna,), (at("anna", 9.2),), keep_radius_m=0.1) == [("anna", 5, 0)]
    nearer = bid("ben", (9, 9, 1))
    assert goals((anna, nearer), (at("anna", 9.2),))[0] == ("anna", 5, 0)


def test_what_others_head_for_does_not_count_while_they_bid() -> None:
    bids = (bid("anna", (5, 9, 2), (9, 9, 6)), bid("ben", (5, 9, 3), (9, 9, 7)))
    assert goals(bids, (at("ben", 9.0),))[0] == goals(bids)[0]


def test_of_several_places_at_the_same_rank_and_cost_the_first_is_taken() -> None:
    (choice,) = MinPos().assign((bid("anna", (9, 9, 2), (5, 9, 2)),), (), ())
    assert (choice.row, choice.gain, choice.cost) == (0, 9, 2)


coordinates = st.integers(0, 16).map(lambda half: half / 2.0)
rows = st.tuples(coordinates, st.sampled_from([0.0, 0.4, 0.6, 9.0]), coordinates)
weights = st.sampled_from([1.0, 2.0])


@st.composite
def teams(draw: st.DrawFn) -> tuple[RobotBid, ...]:
    names = draw(st.lists(st.sampled_from(["anna", "ben", "carl", "dora"]), unique=True))
    return tuple(
        bid(name, *draw(st.lists(rows, max_size=5)), cost_weight=draw(weights)) for name in names
    )


regions = st.lists(coordinates, max_size=2).map(
    lambda xs: tuple(at(f"elsewhere{k}", x) for k, x in enumerate(xs))
)


@settings(deadline=None, max_examples=60)
@given(team=teams(), running=regions, x=coordinates, order=st.randoms(use_true_random=False))
def test_each_robot_comes_to_the_same_by_itself_in_whatever_order_it_heard_the_others(
    team: tuple[RobotBid, ...], running: tuple[Region, ...], x: float, order: object
) -> None:
    strategy = MinPos()
    current = tuple(at(one.robot, x) for one in team)
    together = {choice.robot: choice for choice in strategy.assign(team, current, running)}
    shuffled = list(team)
    order.shuffle(shuffled)  # type: ignore[attr-defined]
    for own in team:
        others = [one for one in shuffled if one is not own]
        alone = strategy.choose(own, others, at(own.robot, x), running)
        assert alone == together.get(own.robot)


@settings(deadline=None, max_examples=60)
@given(offers=st.lists(rows, max_size=6), heading=st.none() | coordinates)
def test_a_lone_robot_does_what_nearest_does(
    offers: list[tuple[float, float, float]], heading: float | None
) -> None:
    own = bid("anna", *offers)
    current = () if heading is None else (at("anna", heading),)
    lone, nearest = MinPos().assign((own,), current, ()), Nearest().assign((own,), current, ())
    assert [choice.row for choice in lone] == [choice.row for choice in nearest]


@settings(deadline=None, max_examples=60)
@given(team=teams(), running=regions)
def test_somebody_is_first_and_no_rank_exceeds_the_number_of_others(
    team: tuple[RobotBid, ...], running: tuple[Region, ...]
) -> None:
    choices = MinPos().assign(team, (), running)
    ranks = [-choice.utility for choice in choices]
    assert all(0 <= rank < len(team) + len(running) for rank in ranks)
    assert not ranks or running or min(ranks) == 0


@settings(deadline=None, max_examples=60)
@given(xs=st.lists(st.integers(0, 8), unique=True, min_size=4, max_size=6), ways=st.data())
def test_robots_that_know_the_same_never_meet_where_both_would_be_first(
    xs: list[int], ways: st.DataObject
) -> None:
    costs = st.lists(coordinates, min_size=len(xs), max_size=len(xs))
    team = tuple(
        bid(name, *((10.0 * x, 9.0, cost) for x, cost in zip(xs, ways.draw(costs), strict=True)))
        for name in ("anna", "ben", "carl")
    )
    first = [choice.goal for choice in MinPos().assign(team, (), ()) if choice.utility == 0.0]
    assert len(set(first)) == len(first)


def test_settings_out_of_range_are_refused() -> None:
    for name in MinPosSettings.model_fields:
        with pytest.raises(ValueError, match=name):
            MinPos.from_settings({name: -1.0})
