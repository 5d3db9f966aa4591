from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from mapping.geometry import IDENTITY, Pose2
from protocol.messages import Heartbeat
from protocol.peer_messages import Beacon
from robot_agent.decentral.beaconing import Beaconing
from robot_agent.decentral.settings import PeerSettings

SETTINGS = PeerSettings(beacon_period_s=0.5, beacon_rest_s=2.0, beacon_points=3)
POSE = Pose2(1.0, 2.0, 0.5)


@dataclass(frozen=True)
class At:
    """What a robot is at."""

    busy: bool = False
    idle: bool = False
    through: bool = False
    goal: tuple[float, float] | None = None


def beat(moving: bool = False, points: int = 0) -> Heartbeat:
    path = np.arange(2 * points, dtype=np.float32).reshape(-1, 2)
    return Heartbeat(T_odom_base=IDENTITY, speed_m_s=0.123, moving=moving, path_map=path)


def due(
    beaconing: Beaconing, now: float, at: At = At(), heartbeat: Heartbeat | None = None
) -> Beacon | None:
    return beaconing.due(heartbeat or beat(), POSE, at, (3, 0.25, 0.1), 77, now)


def instants(at: At, heartbeat: Heartbeat) -> list[float]:
    """When beacons are sent by one whose heart beats ten times a second."""
    beaconing = Beaconing(SETTINGS)
    times = [round(0.1 * k, 6) for k in range(41)]
    return [now for now in times if due(beaconing, now, at, heartbeat)]


def test_a_beacon_tells_all_of_the_robot_and_the_beginning_of_its_path() -> None:
    beacon = due(Beaconing(SETTINGS), 0.0, At(busy=True, goal=(7.0, 8.0)), beat(points=5))
    assert beacon is not None
    assert (beacon.life, beacon.radius_m, beacon.sigma_m, beacon.held) == (3, 0.25, 0.1, 77)
    assert (beacon.T_map_base, beacon.speed_m_s, beacon.busy) == (POSE, 0.12, True)
    assert beacon.goal_map == (7.0, 8.0)
    assert beacon.path_map.tolist() == [[0.0, 1.0], [2.0, 3.0], [4.0, 5.0]]


@pytest.mark.parametrize(("at", "moving"), [(At(busy=True), False), (At(), True)])
def test_it_tells_often_while_it_drives(at: At, moving: bool) -> None:
    assert instants(at, beat(moving)) == [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0]


def test_it_tells_seldom_at_rest() -> None:
    assert instants(At(), beat()) == [0.0, 2.0, 4.0]


CHANGES = [{"busy": True}, {"idle": True}, {"through": True}, {"goal": (1.0, 2.0)}]


@pytest.mark.parametrize("change", CHANGES)
def test_what_others_wait_for_it_tells_at_once(change: dict[str, Any]) -> None:
    beaconing = Beaconing(SETTINGS)
    assert due(beaconing, 0.0) is not None
    assert due(beaconing, 0.1) is None
    changed = replace(At(), **change)
    assert due(beaconing, 0.2, changed) is not None
    assert due(beaconing, 0.3, changed) is None
    assert due(beaconing, 0.4) is not None
