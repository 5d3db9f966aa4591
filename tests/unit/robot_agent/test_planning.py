"""When to plan anew."""

from __future__ import annotations

import numpy as np

from mapping.geometry import Pose2
from robot_agent.navigation_settings import NavigationSettings
from robot_agent.planning import Goal, Planning, Scene
from robot_agent.planning_map import PlanningMap
from robot_agent.right_of_way import Sighting, Teammate
from robot_agent.route_planning import Discs
from tests.unit.robot_agent.closed_loop import Grid, planning_map_of

NOTHING = np.empty((0, 2))
GOAL = Goal((4.0, 1.5), 0.3, True)


def hall() -> PlanningMap:
    return planning_map_of(Grid.walled(5.0, 3.0, 0.1))


def planning() -> Planning:
    return Planning(0.25, NavigationSettings(), "b")


def scene(
    held: PlanningMap,
    now: float,
    x: float = 1.0,
    y: float = 1.5,
    others: tuple = (),
    points=NOTHING,
) -> Scene:
    return Scene(now, Pose2(x, y, 0.0), points, others, False, held)


def coming(*path: tuple[float, float]) -> Sighting:
    points = np.array(path, dtype=np.float64)
    mate = Teammate("a", Pose2(*path[0], 0.0), 0.0, 0.25, points, True)
    return Sighting(mate, path[0][0], path[0][1], 0.0, 0.0, points, 0.0, False)


def test_plans_at_once_then_every_two_seconds() -> None:
    held, plans = hall(), planning()
    times = [k for k in range(60) if plans.update(scene(held, 0.1 * k), GOAL, 0.0)]
    assert times[:3] == [0, 20, 40]
    assert plans.path is not None and plans.left > 2.5 and not plans.giving_way


def test_without_a_goal_nothing_is_planned() -> None:
    held, plans = hall(), planning()
    assert not plans.update(scene(held, 0.0), None, 0.0)
    assert plans.left == 0.0
    standing = coming((4.0, 1.5))
    assert not plans.update(scene(held, 1.0, others=(standing,)), None, 0.0)


def test_without_a_goal_it_still_makes_way() -> None:
    held, plans = hall(), planning()
    other = coming((3.0, 1.5), (0.5, 1.5))
    assert plans.update(scene(held, 0.0, others=(other,)), None, 0.0)
    assert plans.giving_way


def test_plans_anew_when_the_path_is_lost() -> None:
    held, plans = hall(), planning()
    plans.update(scene(held, 0.0), GOAL, 0.0)
    assert not plans.update(scene(held, 0.4, y=2.2), GOAL, 0.0)
    assert plans.update(scene(held, 0.6, y=2.2), GOAL, 0.0)


def test_plans_anew_when_the_map_changes_on_the_path() -> None:
    held, plans = hall(), planning()
    plans.update(scene(held, 0.0), GOAL, 0.0)
    held.weights[13:18, 24:27] = 0
    assert plans.update(scene(held, 0.6), GOAL, 0.0)
    assert not plans.update(scene(held, 1.3), GOAL, 0.0)


def test_plans_anew_when_blocked_but_not_all_the_time() -> None:
    held, plans = hall(), planning()
    plans.update(scene(held, 0.0), GOAL, 0.0)
    assert not plans.update(scene(held, 0.8), GOAL, 0.7)
    assert plans.update(scene(held, 1.1), GOAL, 0.7)


def test_goes_on_only_when_the_way_has_stayed_free() -> None:
    held = planning_map_of(Grid.walled(5.0, 1.2, 0.1))
    plans = planning()
    goal = Goal((4.0, 0.6), 0.3, True)
    other = coming((3.5, 0.6), (0.5, 0.6))
    plans.update(scene(held, 0.0, y=0.6, others=(other,)), goal, 0.0)
    assert plans.giving_way
    gone = [k for k in range(1, 30) if plans.update(scene(held, 0.1 * k, y=0.6), goal, 0.0)]
    assert gone[0] == 4 and not plans.giving_way


def test_unreachable_after_a_while() -> None:
    held, plans = hall(), planning()
    outside = Goal((9.0, 9.0), 0.3, True)
    told = []
    for k in range(40):
        plans.update(scene(held, 0.1 * k), outside, 0.0)
        told.append(plans.unreachable(0.1 * k))
    assert not told[10] and told[16]
    plans.update(scene(held, 6.0), GOAL, 0.0)
    assert not plans.unreachable(6.0)


def test_spots_are_kept_out_of() -> None:
    held, plans = hall(), planning()
    plans.update(scene(held, 0.0), GOAL, 0.0)
    plans.avoid(0.5, Discs(np.array([[2.5, 1.5]]), 0.4))
    assert plans.plan is None
    plans.update(scene(held, 0.6), GOAL, 0.0)
    assert plans.path is not None
    points = plans.path.points_map
    assert np.hypot(points[:, 0] - 2.5, points[:, 1] - 1.5).min() > 0.3


def test_what_is_seen_is_driven_round() -> None:
    held, plans = hall(), planning()
    box = np.column_stack((np.full(9, 1.5), np.linspace(-0.2, 0.2, 9)))
    plans.update(scene(held, 0.0, points=box), GOAL, 0.0)
    assert plans.path is not None
    points = plans.path.points_map
    assert np.hypot(points[:, 0] - 2.5, points[:, 1] - 1.5).min() > 0.35
