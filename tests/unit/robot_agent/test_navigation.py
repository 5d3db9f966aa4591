"""One step of navigation, and short drives in a small world."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.geometry import Pose2
from protocol.body import Body
from robot_agent.navigation import Navigator
from robot_agent.navigation_settings import NavigationSettings, RecoverySettings, RightOfWaySettings
from robot_agent.right_of_way import Teammate
from tests.unit.robot_agent.closed_loop import Grid, Robot, World, planning_map_of, snapshot_of

NOTHING = np.empty((0, 2))
HALL = Grid.walled(4.0, 3.0, 0.1)


def navigator(**settings: object) -> Navigator:
    return Navigator(Body(), NavigationSettings.model_validate(settings), "a")


def world_with(grid: Grid, x: float, y: float, theta: float = 0.0) -> tuple[World, Robot]:
    world = World(grid)
    return world, world.add("a", x, y, theta, planning_map_of(grid))


def test_without_a_goal_it_stays() -> None:
    step = navigator().step(0.0, Pose2(1, 1, 0), NOTHING, [], False, planning_map_of(HALL))
    assert (step.status, step.speed, step.turn_rate) == ("idle", 0.0, 0.0)
    assert len(step.path_map) == 0 and step.remaining_m == 0.0


def test_drives_to_its_goal_and_says_so_once() -> None:
    world, robot = world_with(HALL, 0.8, 1.5)
    robot.send(3.2, 1.5)
    assert robot.navigator.goal_map == (3.2, 1.5)
    world.tick()
    assert robot.last is not None and robot.last.status == "driving"
    assert robot.last.remaining_m == pytest.approx(2.4, abs=0.2)
    assert len(robot.last.path_map) in (9, 10)
    world.run(12.0)
    world.tick()
    assert robot.statuses.count("arrived") == 1 and robot.statuses[-1] == "idle"
    assert robot.navigator.goal_map is None
    assert math.hypot(robot.T_world_base.x - 3.2, robot.T_world_base.y - 1.5) < 0.4
    assert robot.collisions == 0


def test_clear_ends_the_drive() -> None:
    nav, held = navigator(), planning_map_of(HALL)
    nav.set_goal((3.0, 1.5), 0.3)
    assert nav.step(0.0, Pose2(1, 1.5, 0), NOTHING, [], False, held).speed > 0.0
    nav.clear()
    assert nav.step(0.1, Pose2(1, 1.5, 0), NOTHING, [], False, held).status == "idle"


def test_an_unreachable_goal_is_told() -> None:
    world, robot = world_with(HALL, 1.0, 1.5)
    robot.send(8.0, 1.5)
    assert world.run(5.0) < 3.0
    assert robot.statuses[-1] == "unreachable" and robot.last is not None and robot.last.reason


def test_a_near_goal_behind_a_wall_is_not_reached() -> None:
    grid = Grid.walled(4.0, 3.0, 0.1).fill(1.9, 0.2, 2.0, 2.8)
    world, robot = world_with(grid, 1.6, 1.5)
    robot.send(2.3, 1.5, 0.9)
    world.run(5.0)
    assert "arrived" not in robot.statuses


def test_scan_points_are_carried_along() -> None:
    nav, held = navigator(), planning_map_of(Grid.walled(6.0, 3.0, 0.1))
    nav.set_goal((5.0, 1.5), 0.3)
    wall = np.column_stack((np.full(21, 0.8), np.linspace(-0.4, 0.4, 21)))
    far = nav.step(0.0, Pose2(1.0, 1.5, 0), wall, [], False, held)
    near = nav.step(0.1, Pose2(1.5, 1.5, 0), wall, [], False, held)
    fresh = nav.step(0.2, Pose2(1.5, 1.5, 0), wall.copy(), [], False, held)
    assert near.speed < 0.1 < far.speed and fresh.speed > 0.1


def test_a_robot_that_gets_nowhere_backs_up_and_gives_up_in_the_end() -> None:
    nav = navigator(recovery=RecoverySettings(most_recoveries=2, stalled_after_s=1.0))
    held = planning_map_of(HALL)
    nav.set_goal((3.0, 1.5), 0.3)
    steps = [
        nav.step(0.1 * k, Pose2(1.5, 1.5, 0), NOTHING, [], k % 5 > 0, held) for k in range(200)
    ]
    assert any(step.speed < 0.0 for step in steps)
    assert [step.status for step in steps].count("stuck") == 1
    assert steps[-1].status == "idle"


def test_waits_for_a_teammate_then_gives_up() -> None:
    nav = navigator(right_of_way=RightOfWaySettings(blocked_for_s=3.0))
    held = planning_map_of(Grid.walled(4.0, 1.0, 0.1))
    nav.set_goal((3.4, 0.5), 0.3)
    statuses = []
    for k in range(60):
        mate = Teammate("b", Pose2(1.66, 0.5, 0), 0.1 * k, 0.25, NOTHING, False)
        step = nav.step(0.1 * k, Pose2(1.1, 0.5, 0), NOTHING, [mate], False, held)
        assert step.speed == 0.0
        statuses.append(step.status)
    assert "stuck" in statuses and statuses[20] == "driving"


def test_without_a_goal_it_makes_way_and_then_stays() -> None:
    nav, held = navigator(), planning_map_of(HALL)
    pose, statuses = Pose2(2.0, 1.5, 1.5), []
    for k in range(60):
        path = np.array([[0.6, 1.5], [3.4, 1.5]]) if k < 30 else NOTHING
        mate = Teammate("b", Pose2(0.6, 1.5, 0), 0.1 * k, 0.25, path, True)
        step = nav.step(0.1 * k, pose, NOTHING, [mate], False, held)
        statuses.append(step.status)
        pose = pose @ Pose2(0.1 * step.speed, 0.0, 0.1 * step.turn_rate)
        assert step.remaining_m == 0.0
    assert statuses[0] == "giving_way" and statuses[-1] == "idle"
    assert abs(pose.y - 1.5) > 0.5


def test_a_bump_into_something_unseen_is_got_over() -> None:
    grid = Grid.walled(5.0, 3.0, 0.1)
    world, robot = world_with(grid, 0.8, 1.5)
    solid = grid.solid.copy()
    world.grid = Grid(solid, 0.1).fill(2.4, 1.4, 2.5, 1.6)
    # Glass: the body touches it, the lidar does not see it.
    sense = world._sense

    def blind(one: Robot) -> None:
        glass, world.grid = world.grid, grid
        sense(one)
        world.grid = glass

    world._sense = blind  # type: ignore[method-assign]
    robot.send(4.2, 1.5)
    world.run(60.0)
    assert "arrived" in robot.statuses and 1 <= robot.collisions < 20


def test_an_empty_map_leads_nowhere() -> None:
    nav = navigator()
    held = planning_map_of(HALL)
    held.apply_snapshot(snapshot_of(Grid(np.ones((5, 5), dtype=bool), 0.1), number=2))
    nav.set_goal((3.0, 1.5), 0.3)
    told = [nav.step(0.1 * k, Pose2(1, 1.5, 0), NOTHING, [], False, held) for k in range(20)]
    assert "unreachable" in [step.status for step in told]
