from __future__ import annotations

import numpy as np

from coordination.bid import RobotBid
from coordination.strategies.nearest import Nearest, NearestSettings
from coordination.strategy import Region
from mapping.geometry import IDENTITY


def bid(robot: str, *rows: tuple[float, float, float]) -> RobotBid:
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
    )


def test_all_robots_may_go_to_one_place() -> None:
    offers = (bid("anna", (5, 9, 2), (9, 50, 6)), bid("ben", (5, 9, 3), (9, 50, 7)))
    choices = Nearest().assign(offers, (), ())
    assert [choice.goal for choice in choices] == [(5, 0), (5, 0)]


def test_a_robot_goes_on_to_its_goal_while_a_frontier_is_there() -> None:
    heading = (Region("anna", (9.2, 0.0), (8, -1, 10, 1)),)
    near_and_far = bid("anna", (5, 9, 2), (9, 50, 6))
    assert Nearest().assign((near_and_far,), heading, ())[0].goal == (9, 0)
    gone = bid("anna", (5, 9, 2), (14, 50, 9))
    assert Nearest().assign((gone,), heading, ())[0].goal == (5, 0)


def test_places_with_too_little_to_gain_are_left() -> None:
    strategy = Nearest(NearestSettings(min_gain_m2=10.0))
    assert strategy.assign((bid("anna", (5, 9, 2), (9, 50, 6)),), (), ())[0].goal == (9, 0)
    assert strategy.assign((bid("anna", (5, 9, 2)), bid("ben")), (), ()) == ()
