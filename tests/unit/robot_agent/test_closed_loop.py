"""Whole drives: robots, walls, noisy poses and lidars. Compiled code only: they are long."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.path_planning import cost_field
from tests.unit.robot_agent.closed_loop import COMPILED, Grid, World, planning_map_of

pytestmark = pytest.mark.skipif(not COMPILED, reason="too long for plain Python")


def two_rooms(width: float) -> Grid:
    """8 m x 5 m, a wall at x = 4 with a door of `width` [m]."""
    grid = Grid.walled(8.0, 5.0).fill(3.9, 0.0, 4.1, 5.0)
    return grid.fill(3.9, 2.5 - width / 2, 4.1, 2.5 + width / 2, solid=False)


def two_rooms_and_a_corridor() -> Grid:
    """Rooms of 4 m at both ends of a corridor 1 m wide and 10 m long."""
    grid = Grid.walled(18.0, 6.0).fill(4.0, 0.0, 14.0, 6.0)
    return grid.fill(4.0, 2.5, 14.0, 3.5, solid=False)


def ten_rooms() -> Grid:
    """A corridor with five rooms on either side, doors of 0.8 and 0.9 m, some furniture."""
    grid = Grid.walled(20.0, 13.0)
    grid.fill(0, 5, 20, 5.2).fill(0, 7, 20, 7.2)
    for x in (4, 8, 12, 16):
        grid.fill(x, 0, x + 0.2, 5).fill(x, 7.2, x + 0.2, 13)
    for x in (2, 6, 10, 14, 18):
        grid.fill(x, 5, x + 0.9, 5.2, solid=False).fill(x - 0.4, 7, x + 0.4, 7.2, solid=False)
    return grid.fill(5.5, 2, 6.5, 3).fill(13, 9, 15, 9.6).fill(1, 10, 1.4, 11)


def all_arrive(world: World, most: float) -> float:
    """Run; every robot that was sent must arrive, and nobody touch anything. Returns seconds."""
    sent = [robot for robot in world.robots if robot.busy]
    took = world.run(most)
    assert all("arrived" in robot.statuses for robot in sent), [r.last for r in sent]
    assert world.collisions == 0 and world.least_apart > 0.5
    return took


@pytest.mark.parametrize(("width", "speed"), [(0.7, 0.40), (0.6, 0.35)])
def test_through_a_narrow_door(width: float, speed: float) -> None:
    world = World(two_rooms(width))
    robot = world.add("a", 1.0, 1.0, 0.0, planning_map_of(world.grid))
    robot.send(7.0, 4.0)
    took = all_arrive(world, 40.0)
    assert robot.driven / took > speed


@pytest.mark.parametrize(("a", "b"), [(2.0, 16.0), (6.0, 12.0)])
def test_head_on_in_a_corridor(a: float, b: float) -> None:
    world = World(two_rooms_and_a_corridor(), seed=1)
    held = planning_map_of(world.grid)
    world.add("a", a, 3.0, 0.0, held).send(16.0, 3.2)
    world.add("b", b, 3.0, math.pi, held).send(2.0, 2.8)
    assert all_arrive(world, 120.0) < 80.0
    assert "giving_way" in world.robots[1].statuses
    assert "giving_way" not in world.robots[0].statuses


@pytest.mark.parametrize("seed", [0, 1])
def test_two_swap_rooms_through_one_door(seed: int) -> None:
    world = World(two_rooms(0.8), seed)
    held = planning_map_of(world.grid)
    world.add("a", 2.0, 2.5, 0.0, held).send(6.0, 2.5)
    world.add("b", 6.0, 2.5, math.pi, held).send(2.0, 2.5)
    assert all_arrive(world, 60.0) < 30.0


def test_three_cross_in_a_hall() -> None:
    world = World(Grid.walled(8.0, 8.0))
    held = planning_map_of(world.grid)
    for k, name in enumerate("abc"):
        angle = 2.0 * math.pi * k / 3.0
        x, y = 3.0 * math.cos(angle), 3.0 * math.sin(angle)
        world.add(name, 4.0 + x, 4.0 + y, angle + math.pi, held).send(4.0 - x, 4.0 - y)
    assert all_arrive(world, 60.0) < 30.0


def test_one_goes_into_a_dead_end_that_another_has_to_leave() -> None:
    grid = Grid.walled(12.0, 6.0).fill(4.0, 0.0, 12.0, 6.0)
    world = World(grid.fill(4.0, 2.5, 11.5, 3.5, solid=False))
    held = planning_map_of(world.grid)
    world.add("a", 2.0, 3.0, 0.0, held).send(10.5, 3.0)
    world.add("b", 11.0, 3.0, math.pi, held).send(2.0, 2.0)
    all_arrive(world, 150.0)


def test_an_idle_robot_leaves_the_door() -> None:
    world = World(two_rooms(0.8))
    held = planning_map_of(world.grid)
    world.add("a", 2.0, 2.5, 0.0, held).send(6.0, 2.5)
    world.add("b", 4.0, 2.5, 1.5, held)
    all_arrive(world, 40.0)
    assert "giving_way" in world.robots[1].statuses


def test_a_dead_robot_is_driven_round_and_closes_a_door() -> None:
    for grid, x, outcome in ((Grid.walled(10.0, 4.0), 5.0, "arrived"), (two_rooms(0.8), 4.0, "un")):
        world = World(grid)
        held = planning_map_of(grid)
        middle = grid.solid.shape[0] * grid.resolution / 2
        robot = world.add("a", 1.0, middle, 0.0, held)
        dead = world.add("b", x, middle, 0.0, held)
        for _ in range(5):
            world.tick()
        dead.frozen = True
        robot.send(7.0, middle)
        world.run(40.0)
        assert any(status.startswith(outcome) for status in robot.statuses)
        assert world.collisions == 0


@pytest.mark.parametrize("theta", [0.0, math.pi, -2.3])
def test_one_that_starts_at_a_wall_gets_away(theta: float) -> None:
    world = World(Grid.walled(6.0, 6.0))
    world.add("a", 0.452, 0.452, theta, planning_map_of(world.grid)).send(5.0, 3.0)
    all_arrive(world, 30.0)


def test_a_closed_door_that_the_map_shows_open() -> None:
    grid = two_rooms(0.8).fill(3.9, 4.0, 4.1, 4.8, solid=False)
    held = planning_map_of(grid)
    world = World(grid.fill(3.9, 2.0, 4.1, 3.0))
    world.add("a", 2.0, 2.5, 0.0, held).send(6.0, 2.5)
    assert all_arrive(world, 60.0) < 30.0


def test_a_door_tighter_than_the_map_shows_is_tried_once_and_known_from_then_on() -> None:
    held = planning_map_of(two_rooms(0.6))
    world = World(two_rooms(0.5))
    robot = world.add("a", 2.0, 3.0, 0.0, held)
    for seconds in (40.0, 4.0):
        robot.send(7.0, 4.0)
        assert world.run(seconds) < seconds
        assert robot.statuses[-1] == "unreachable"
    assert robot.tight_map is not None and robot.tight_map[0] == pytest.approx(4.0, abs=0.4)


def test_twenty_goals_in_rooms_at_speed() -> None:
    grid = ten_rooms()
    world = World(grid, seed=1)
    held = planning_map_of(grid)
    rng = np.random.default_rng(1)
    field = cost_field(held.weights, held.geometry.cell_at(10.0, 6.1), grid.resolution)
    cells = np.argwhere(np.isfinite(field.cost))
    goals = held.geometry.centres_of(cells[rng.integers(0, len(cells), 20)])
    robot = world.add("a", 10.0, 6.1, 0.0, held)
    for x, y in goals:
        robot.send(x, y, 0.35)
        world.run(200.0)
    assert robot.statuses.count("arrived") == 20
    assert world.collisions == 0
    assert robot.driven / world.now >= 0.38
