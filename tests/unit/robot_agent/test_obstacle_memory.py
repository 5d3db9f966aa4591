"""Obstacles that are in no map."""

from __future__ import annotations

import numpy as np

from mapping.geometry import Pose2
from robot_agent.obstacle_memory import ObstacleMemory, unmapped_points
from robot_agent.path_following import DrivenPath, evenly_spaced
from robot_agent.right_of_way import Sighting, Teammate
from robot_agent.route_planning import Discs
from tests.unit.robot_agent.closed_loop import Grid, planning_map_of

SPOT = Discs(np.array([[1.0, 1.0]]), 0.3)


def test_a_spot_is_kept_out_of_for_a_while() -> None:
    memory = ObstacleMemory(0.25, 10.0)
    memory.add(5.0, SPOT)
    assert memory.keep_out(14.0, np.empty((0, 2)), None) == [SPOT]
    assert memory.keep_out(15.1, np.empty((0, 2)), None) == []


def test_what_stands_in_the_path_is_remembered_what_does_not_is_not() -> None:
    points = evenly_spaced(np.array([[0.0, 0.0], [3.0, 0.0]]), 0.1)
    path = DrivenPath(points, np.ones(len(points)))
    nothing = np.empty((0, 2))
    memory = ObstacleMemory(0.25, 10.0)
    assert len(memory.keep_out(0.0, np.array([[1.0, 1.0]]), path)) == 1
    assert memory.keep_out(1.0, nothing, path) == []
    assert len(memory.keep_out(2.0, np.array([[1.0, 0.1]]), None)) == 1
    assert memory.keep_out(3.0, nothing, None) == []
    memory.keep_out(4.0, np.array([[1.0, 0.1]]), path)
    (kept,) = memory.keep_out(5.0, nothing, None)
    assert kept.radius == 0.25


def test_only_near_points_that_nothing_explains_are_unmapped() -> None:
    held = planning_map_of(Grid.walled(5.0, 3.0, 0.1))
    mate = Teammate("b", Pose2(2.0, 2.0, 0.0), 0.0, 0.25, np.empty((0, 2)), False)
    other = Sighting(mate, 2.0, 2.0, 0.0, 0.0, np.array([[2.0, 2.0]]), 0.0, False)
    here = Pose2(1.0, 1.5, 0.0)
    wanted_map = np.array(
        [[2.0, 1.2], [0.25, 1.5], [2.0, 1.72], [4.3, 1.5], [-3.0, 1.5]], dtype=np.float64
    )
    found = unmapped_points(held, here, here.inverse().apply(wanted_map), [other])
    assert np.allclose(found, [[2.0, 1.2]])
