"""Straight on, around, or out of the way."""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry import Pose2
from robot_agent.navigation_settings import RightOfWaySettings
from robot_agent.planning_map import PlanningMap
from robot_agent.right_of_way import Sighting, Teammate
from robot_agent.route_choice import Choice, RouteChoice, Situation
from robot_agent.route_planning import Discs
from tests.unit.robot_agent.closed_loop import Grid, planning_map_of

HALL = planning_map_of(Grid.walled(6.0, 5.0, 0.1))


def corridor() -> PlanningMap:
    """A room of 2 m, a corridor of 1 m, a room of 2 m."""
    grid = Grid.walled(7.0, 3.0, 0.1).fill(2.2, 0.0, 4.8, 3.0)
    return planning_map_of(grid.fill(2.2, 1.0, 4.8, 2.0, solid=False))


def mate(name: str, *path: tuple[float, float], silent: bool = False) -> Sighting:
    points = np.array(path, dtype=np.float64)
    x, y = path[0]
    told = Teammate(name, Pose2(x, y, 0.0), 0.0, 0.25, points, True)
    return Sighting(told, x, y, 0.0, 0.0, points[:1] if silent else points, 0.0, silent)


def choose(
    name: str,
    here: tuple[float, float],
    goal: tuple[float, float] | None,
    others: list[Sighting],
    held: PlanningMap = HALL,
    spots: tuple[Discs, ...] = (),
) -> Choice:
    choice = RouteChoice(name, 0.25, RightOfWaySettings())
    situation = Situation(here, goal, 0.3, goal is not None, 0.0, spots, others)
    return choice.choose(0.0, situation, held)


def nearest(choice: Choice, x: float, y: float) -> float:
    assert choice.route is not None
    points = choice.route.path.points_map
    return float(np.hypot(points[:, 0] - x, points[:, 1] - y).min())


def test_alone_it_is_the_direct_way() -> None:
    choice = choose("a", (1, 2.5), (5, 2.5), [])
    assert choice.route is not None and choice.reachable and not choice.giving_way
    assert 3.9 < choice.to_go < 4.2 and choice.stop_at == math.inf


def test_without_a_goal_one_stays() -> None:
    choice = choose("a", (1, 2.5), None, [mate("b", (5, 4), (4, 4))])
    assert choice.route is None and choice.reachable and not choice.giving_way


def test_one_that_stands_is_driven_round() -> None:
    choice = choose("b", (1, 2.5), (5, 2.5), [mate("a", (3, 2.5))])
    assert nearest(choice, 3, 2.5) >= 0.55 and not choice.giving_way


def test_in_a_hall_the_lower_one_drives_round() -> None:
    coming = mate("a", (5, 2.5), (1, 2.5))
    choice = choose("b", (1, 2.5), (5, 2.5), [coming])
    assert choice.reachable
    if not choice.giving_way:
        assert nearest(choice, 3, 2.5) > 0.5
    higher = choose("a", (1, 2.5), (5, 2.5), [mate("b", (5, 2.5), (1, 2.5))])
    assert not higher.giving_way and nearest(higher, 3, 2.5) < 0.1


def test_in_a_corridor_the_lower_one_backs_out() -> None:
    held = corridor()
    coming = mate("a", (1.2, 1.5), (6.0, 1.5))
    choice = choose("b", (3.5, 1.5), (1.2, 1.5), [coming], held)
    assert choice.giving_way and choice.route is not None and choice.reachable
    x, y = choice.route.path.end
    assert x > 4.8 and abs(y - 1.5) >= 0.65


def test_before_a_corridor_it_waits_short_of_the_others_way() -> None:
    held = corridor()
    coming = mate("a", (3.5, 1.5), (5.4, 1.5), (6.0, 2.4))
    choice = choose("b", (6.2, 0.55), (1.2, 1.5), [coming], held)
    assert choice.giving_way and choice.route is not None
    x, y = choice.route.path.point_at(max(choice.stop_at, 0.0))
    away = np.hypot(coming.path_map[:, 0] - x, coming.path_map[:, 1] - y)
    assert away.min() > 0.6


def test_one_with_no_goal_makes_way() -> None:
    choice = choose("a", (3, 2.5), None, [mate("b", (1, 2.5), (5, 2.5))])
    assert choice.giving_way and choice.route is not None
    assert abs(choice.route.path.end[1] - 2.5) > 0.65


def test_with_no_room_it_stays() -> None:
    narrow = planning_map_of(Grid.walled(4.0, 1.0, 0.1))
    choice = choose("b", (3, 0.5), (1, 0.5), [mate("a", (1, 0.5), (3.4, 0.5))], narrow)
    assert choice.giving_way and choice.route is None


def test_where_ways_join_it_waits_a_moment() -> None:
    beside = mate("a", (1.0, 3.1), (2.0, 2.5), (5.0, 2.5))
    choice = choose("b", (1, 2.5), (5, 2.5), [beside])
    if choice.giving_way:
        assert choice.stop_at < 1.5 and choice.route is not None


def test_a_spot_closes_a_door_only_while_there_is_another_way() -> None:
    spot = Discs(np.array([[3.5, 1.5]]), 0.5)
    held = corridor()
    through = choose("a", (1.2, 1.5), (6, 1.5), [], held, (spot,))
    assert through.reachable
    dead = mate("b", (3.5, 1.5), silent=True)
    assert not choose("a", (1.2, 1.5), (6, 1.5), [dead], held).reachable
    alive = mate("b", (3.5, 1.5))
    assert choose("a", (1.2, 1.5), (6, 1.5), [alive], held).reachable


def test_the_wave_from_the_goal_is_kept_for_a_while() -> None:
    held = planning_map_of(Grid.walled(3.0, 3.0, 0.1))
    choice = RouteChoice("a", 0.25, RightOfWaySettings())
    situation = Situation((1, 1), (2, 2), 0.3, True, 0.0, (), ())
    choice.choose(0.0, situation, held)
    first = choice._destination
    choice.choose(99.0, situation, held)
    assert choice._destination is first
    held.number += 1
    choice.choose(5.0, situation, held)
    assert choice._destination is first
    choice.choose(9.0, situation, held)
    assert choice._destination is not first
    choice.choose(9.0, Situation((1, 1), None, 0.3, True, 0.0, (), ()), held)
    assert choice._destination is None
