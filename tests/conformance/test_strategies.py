"""What every strategy in the table must do, tested by its being there."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coordination.bid import RobotBid
from coordination.strategy import STRATEGIES, Region, Strategy, StrategyError, load_strategy
from mapping.geometry import IDENTITY

NAMES = ("anna", "ben", "carl", "dora")
every_strategy = pytest.mark.parametrize("name", sorted(STRATEGIES))

metres = st.integers(0, 24).map(lambda quarter: quarter / 4.0)


@st.composite
def bids_of(draw: st.DrawFn, robot: str) -> RobotBid:
    rows = draw(
        st.lists(st.tuples(metres, metres, metres, metres, metres, metres), min_size=0, max_size=6)
    )
    table = np.array(rows, dtype=np.float64).reshape(-1, 6)
    places = table[:, :2]
    return RobotBid(
        robot,
        1,
        1,
        IDENTITY,
        places,
        table[:, 2],
        table[:, 3],
        np.column_stack((places - table[:, 4:5] / 2, places + table[:, 5:6] / 2)),
        np.empty((0, 2)),
        np.abs(table[:, 3]),
        draw(st.sampled_from([0.5, 1.0, 2.0])),
    )


@st.composite
def situations(
    draw: st.DrawFn,
) -> tuple[tuple[RobotBid, ...], tuple[Region, ...], tuple[Region, ...]]:
    bidding = draw(st.lists(st.sampled_from(NAMES), unique=True))
    bids = tuple(draw(bids_of(robot)) for robot in bidding)
    current = tuple(draw(regions(robot)) for robot in bidding if draw(st.booleans()))
    running = tuple(
        draw(regions(robot)) for robot in NAMES if robot not in bidding and draw(st.booleans())
    )
    return bids, current, running


@st.composite
def regions(draw: st.DrawFn, robot: str) -> Region:
    x, y, width, height = (draw(metres) for _ in range(4))
    return Region(robot, (x, y), (x - width, y - height, x + width, y + height))


@every_strategy
@settings(deadline=None, max_examples=60)
@given(situation=situations())
def test_choices_are_fit(
    name: str,
    situation: tuple[tuple[RobotBid, ...], tuple[Region, ...], tuple[Region, ...]],
) -> None:
    strategy = load_strategy(name)
    bids, current, running = situation
    choices = strategy.assign(bids, current, running)
    by_robot = {bid.robot: bid for bid in bids}
    robots = [choice.robot for choice in choices]
    assert robots == sorted(set(robots)), "one choice each, by name"
    for choice in choices:
        bid = by_robot[choice.robot]
        assert choice.goal == tuple(bid.places[choice.row])
        assert choice.rectangle == tuple(bid.rectangles[choice.row])
        assert choice.cost == bid.costs[choice.row]
        assert strategy.min_gain <= choice.gain <= bid.gains[choice.row] + 1e-9
        assert math.isfinite(choice.utility)
    if strategy.coordinated:
        goals = [choice.goal for choice in choices]
        assert len(set(goals)) == len(goals), "two robots at one place"
        assert not set(goals) & {region.goal for region in running}


@every_strategy
@settings(deadline=None, max_examples=30)
@given(situation=situations(), order=st.randoms(use_true_random=False))
def test_choices_depend_on_nothing_but_the_bids(
    name: str,
    situation: tuple[tuple[RobotBid, ...], tuple[Region, ...], tuple[Region, ...]],
    order: object,
) -> None:
    bids, current, running = situation
    shuffled = list(bids)
    order.shuffle(shuffled)  # type: ignore[attr-defined]
    strategy = load_strategy(name)
    first = strategy.assign(bids, current, running)
    assert strategy.assign(bids, current, running) == first
    assert load_strategy(name).assign(tuple(shuffled), current, running) == first


@every_strategy
def test_nothing_comes_of_nothing(name: str) -> None:
    assert load_strategy(name).assign((), (), ()) == ()


@every_strategy
def test_it_is_a_strategy_and_takes_its_settings(name: str) -> None:
    strategy = load_strategy(name, {"min_gain_m2": 3.0})
    assert isinstance(strategy, Strategy) and strategy.min_gain == 3.0
    with pytest.raises(StrategyError, match="does not take"):
        load_strategy(name, {"colour": "red"})


@every_strategy
def test_a_lone_robot_with_one_place_goes_there(name: str) -> None:
    bid = RobotBid(
        "anna",
        1,
        1,
        IDENTITY,
        np.array([[4.0, 0.0]]),
        np.array([12.0]),
        np.array([4.0]),
        np.array([[3.0, -1.0, 7.0, 2.0]]),
        np.empty((0, 2)),
        np.zeros(1),
    )
    (choice,) = load_strategy(name).assign((bid,), (), ())
    assert choice.goal == (4.0, 0.0)
