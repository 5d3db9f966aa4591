"""From path to command."""

from __future__ import annotations

import numpy as np
import pytest

from mapping.geometry import Pose2
from protocol.body import Body
from robot_agent.navigation_settings import DrivingSettings, RightOfWaySettings
from robot_agent.path_following import DrivenPath, evenly_spaced
from robot_agent.right_of_way import Sighting, Teammate
from robot_agent.steering import Steered, Steering

NOTHING = np.empty((0, 2))
START = Pose2(1.0, 0.0, 0.0)


def steer(points: np.ndarray, pose: Pose2 = START, others: tuple[Sighting, ...] = ()) -> Steered:
    steering = Steering(Body(), DrivingSettings(), RightOfWaySettings())
    line = evenly_spaced(np.array([[0.0, 0.0], [6.0, 0.0]]), 0.1)
    path = DrivenPath(line, np.full(len(line), 0.7))
    path.advance(pose.x, pose.y)
    return steering.follow(path, pose, points, others)


def wall(x: float, half: float = 1.0, middle: float = 0.0) -> np.ndarray:
    y = np.linspace(-half, half, 81) + middle
    return np.column_stack((np.full(len(y), x), y))


def sides(half: float) -> np.ndarray:
    """Two walls beside the way, so far from its middle."""
    x = np.linspace(0.0, 1.5, 60)
    left, right = np.column_stack((x, np.full(60, half))), np.column_stack((x, np.full(60, -half)))
    return np.concatenate((right, left[::-1]))


def mate(x: float, y: float = 0.0, vx: float = 0.0) -> Sighting:
    told = Teammate("b", Pose2(x, y, 0.0), 0.0, 0.25, NOTHING, False)
    return Sighting(told, x, y, vx, 0.0, np.array([[x, y]]), 0.0, False)


def test_full_speed_in_the_open_and_past_far_walls() -> None:
    assert steer(NOTHING) == Steered(0.5, 0.0, False, False)
    assert steer(wall(2.0)).speed == 0.5
    assert steer(sides(0.35)).speed == 0.5


def test_slower_in_narrow_places() -> None:
    assert 0.18 <= steer(sides(0.29)).speed < 0.45


def test_stops_before_a_wall() -> None:
    assert 0.05 < steer(wall(0.45)).speed < 0.4
    stopped = steer(wall(0.28))
    assert stopped.speed == 0.0 and stopped.blocked and not stopped.by_teammate


def test_goes_round_something_small() -> None:
    pole = wall(0.5, half=0.03, middle=0.1)
    steered = steer(pole)
    assert steered.speed > 0.1 and steered.turn_rate < 0.0


def test_turns_on_the_spot_when_the_path_is_behind() -> None:
    steered = steer(NOTHING, Pose2(1, 0, 3.0))
    assert steered.speed == 0.0 and steered.turn_rate != 0.0 and not steered.blocked


def test_a_blocked_robot_looks_where_it_wants_to_go() -> None:
    steered = steer(wall(0.27), Pose2(1.0, 0.0, 0.6))
    assert steered.blocked and steered.turn_rate < 0.0


def test_waits_for_a_teammate_but_follows_one_that_leaves() -> None:
    standing = steer(NOTHING, others=(mate(1.6),))
    assert standing.by_teammate and standing.speed < 0.2
    leaving = steer(NOTHING, others=(mate(1.75, vx=0.5),))
    assert leaving.speed == 0.5
    assert steer(NOTHING, others=(mate(9.0),)).speed == 0.5


def test_what_the_lidar_sees_of_a_teammate_is_the_teammate() -> None:
    steered = steer(wall(0.28, half=0.2), others=(mate(1.7),))
    assert steered.blocked and steered.by_teammate
    assert steered.speed == pytest.approx(0.0)
