from __future__ import annotations

import numpy as np

from coordination.waiting_place import IdleRobot
from server.waiting_ground import WaitingGround, pose_of
from tests.unit.server.master_rig import Rig, begun


def ground_of(rig: Rig) -> WaitingGround:
    master = rig.master
    return WaitingGround(master.merger, master.roster, master.settings.map)


def test_idle_robots_wait_on_free_ground_off_the_ways_of_others() -> None:
    rig = begun()
    idle = (IdleRobot("robot1", (0.0, 0.0)),)
    places, gains = np.array([[1.5, 0.0]]), np.array([10.0])
    assert set(ground_of(rig).choose(idle, places, gains)) <= {"robot1"}
    rig.hello("robot2", start=[1.0, 0.5, 0.0])
    rig.beat("robot2")
    assert set(ground_of(rig).choose(idle, places, gains)) <= {"robot1"}


def test_without_a_map_or_anything_left_there_is_no_place_to_wait() -> None:
    idle = (IdleRobot("robot1", (0.0, 0.0)),)
    assert ground_of(begun()).choose(idle, np.zeros((0, 2)), np.zeros(0)) == {}
    assert ground_of(Rig()).choose(idle, np.array([[1.5, 0.0]]), np.array([10.0])) == {}


def test_a_robot_is_where_it_last_said() -> None:
    rig = begun()
    assert pose_of(rig.master.merger, rig.master.roster, "robot1") == (0.0, 0.0, 0.0)
    assert pose_of(rig.master.merger, rig.master.roster, "robot2") is None
