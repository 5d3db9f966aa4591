"""Routes over the planning map."""

from __future__ import annotations

import numpy as np
import pytest

from robot_agent.planning_map import PlanningMap
from robot_agent.route_planning import (
    Destination,
    Discs,
    Route,
    route_out_of_the_way,
    route_to_goal,
)
from tests.unit.robot_agent.closed_loop import Grid, planning_map_of


def two_rooms() -> PlanningMap:
    """4 m x 2.4 m, a wall at x = 2 with a door of 0.8 m at y = 1.2."""
    grid = Grid.walled(4.0, 2.4, 0.1).fill(1.9, 0.0, 2.1, 2.4)
    return planning_map_of(grid.fill(1.9, 0.8, 2.1, 1.6, solid=False))


def route(held: PlanningMap, here, goal, keep_out=(), tolerance: float = 0.3) -> Route | None:
    aim = Destination.on_map(held, goal, tolerance, here, 0.0)
    return route_to_goal(held, here, aim, 0.25, keep_out)


def test_through_the_middle_of_the_door() -> None:
    found = route(two_rooms(), (0.6, 0.6), (3.4, 1.8))
    assert found is not None
    points = found.path.points_map
    assert points[0] == pytest.approx((0.6, 0.6)) and points[-1] == pytest.approx(
        (3.4, 1.8), abs=0.1
    )
    in_door = points[np.abs(points[:, 0] - 2.0) < 0.1]
    assert np.abs(in_door[:, 1] - 1.2).max() < 0.12
    assert 2.9 < found.path.length < 3.6 and found.cost >= 2.9
    assert found.path.gaps.min() >= 0.3


def test_smooth_means_no_sharp_corner() -> None:
    found = route(two_rooms(), (0.6, 0.6), (3.4, 1.8))
    assert found is not None
    steps = np.diff(found.path.points_map, axis=0)
    headings = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    assert np.abs(np.diff(headings)).max() < 0.6


def test_a_goal_at_a_wall_is_approached_on_its_side() -> None:
    found = route(two_rooms(), (0.6, 0.6), (1.85, 0.5), tolerance=0.5)
    assert found is not None and found.path.end[0] < 1.7
    assert route(two_rooms(), (0.6, 0.6), (1.85, 0.5), tolerance=0.1) is None


def test_a_blocked_door_leaves_no_route() -> None:
    door = Discs(np.array([[2.0, 1.2]]), 0.3)
    assert route(two_rooms(), (0.6, 0.6), (3.4, 1.8), [door]) is None
    dear = Discs(np.array([[2.0, 1.2]]), 0.3, hard=False)
    found = route(two_rooms(), (0.6, 0.6), (3.4, 1.8), [dear])
    assert found is not None and found.cost > 4.0


def test_a_robot_too_near_to_a_wall_gets_away() -> None:
    found = route(two_rooms(), (0.35, 0.35), (3.4, 1.2))
    assert found is not None and found.path.points_map[0] == pytest.approx((0.35, 0.35))


def test_out_of_the_way() -> None:
    held = two_rooms()
    through = Discs(np.column_stack((np.linspace(0.5, 3.5, 31), np.full(31, 1.2))), 0.5)
    found = route_out_of_the_way(held, (2.0, 1.2), 0.25, (), [through])
    assert found is not None
    assert abs(found.path.end[1] - 1.2) >= 0.5
    everywhere = Discs(np.array([[2.0, 1.2]]), 9.0)
    assert route_out_of_the_way(held, (2.0, 1.2), 0.25, (), [everywhere]) is None


def test_one_who_comes_from_one_side_is_left_to_the_other() -> None:
    held = two_rooms()
    coming = Discs(np.array([[1.2, 1.2]]), 0.56)
    leave = Discs(np.column_stack((np.linspace(1.2, 3.0, 19), np.full(19, 1.2))), 0.5)
    found = route_out_of_the_way(held, (2.0, 1.2), 0.25, [coming], [leave])
    assert found is not None and found.path.end[0] > 2.2
