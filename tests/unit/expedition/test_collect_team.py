from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from expedition.collect_team import (
    listener_part,
    listener_witness,
    peer_part,
    peer_witness,
    team_part,
)
from mapping.geometry import IDENTITY, Pose2
from mapping.observation_coding import Observation, encode_observation
from mapping.shared_map import SharedMap
from mapping.team_map import TeamMap
from protocol.effects import Rejected
from protocol.log.author_log import Author, Entry
from protocol.log.held_log import HeldLog
from protocol.log.observation_log import ObservationLog
from protocol.log.pose_coding import pose_steps
from server.settings import MapSettings
from tests.unit.protocol.test_crew import beacon
from tests.unit.robot_agent.decentral.peer_rig import CODING, ROOM, Rig, seen_by
from tests.unit.rooms import scan_in
from tests.unit.server.test_listener import begun

SETTINGS = MapSettings()
VICTIM = (1.5, 0.5)  # map frame


def shared_map(seen: list[tuple[str, int, int, Pose2, float]]) -> SharedMap:
    """The map of some observations: robot, life, number, pose, stamp [s]; all see the victim."""
    log, shared = ObservationLog("me"), SharedMap(TeamMap[tuple[str, int]](0.1))
    for robot, life, number, pose, stamp in seen:
        victims = np.array([pose.inverse().apply(VICTIM)]).reshape(-1, 2)
        payload = encode_observation(Observation(scan_in(ROOM, pose, stamp), victims), CODING)
        log.put(Author(robot, life), number, Entry(payload, pose_steps(pose), 0), robot)
    changes = log.take_changes()
    assert shared.take_in(HeldLog(log), changes.entries, changes.repositioned) == []
    return shared


HERE, THERE = Pose2(0.0, 0.0, 0.0), Pose2(1.0, 0.0, 0.3)
SEEN = [
    ("bob", 0, 1, THERE, 2.0),
    ("ann", 1, 1, THERE, 5.0),
    ("ann", 0, 1, HERE, 1.0),
    ("ann", 0, 2, THERE, 3.0),
]


def test_of_a_team_that_saw_nothing_there_is_no_map() -> None:
    part = team_part(shared_map([]), SETTINGS)
    assert part["grid"] is part["map_digest"] is None
    assert part["robots"] == {} and part["observations"] == part["victims"] == []


def test_a_robots_way_is_that_of_all_its_lives_in_order_of_time() -> None:
    part = team_part(shared_map(SEEN), SETTINGS)
    assert part["robots"]["ann"]["track_map"][:, 0].tolist() == [1.0, 3.0, 5.0]
    assert part["robots"]["bob"]["track_map"].shape == (1, 4)
    graph = part["pose_graph"]
    assert graph.chains["ann"].shape == (3, 3)
    assert graph.stamps["ann"].tolist() == [1.0, 3.0, 5.0]


def test_all_observations_are_told_in_order_of_time_with_the_lasers_pose() -> None:
    told = team_part(shared_map(SEEN), SETTINGS)["observations"]
    assert [(o["t_s"], o["robot"], o["number"]) for o in told] == [
        (1.0, "ann", 1),
        (2.0, "bob", 1),
        (3.0, "ann", 2),
        (5.0, "ann", 1),
    ]
    assert told[1]["pose"].tolist() == pytest.approx(THERE.as_tuple(), abs=1e-3)
    assert told[0]["ranges"].dtype == np.float32


def test_a_victim_that_many_saw_is_one() -> None:
    (victim,) = team_part(shared_map(SEEN), SETTINGS)["victims"]
    assert (victim["x_m"], victim["y_m"]) == pytest.approx(VICTIM, abs=0.02)
    assert (victim["seen_by"], victim["t_s"], victim["sightings"]) == ("ann", 1.0, 4)


def test_single_coverages_add_up_lives_and_together_are_less() -> None:
    part = team_part(shared_map(SEEN), SETTINGS)
    single, union = part["single_clear"], part["union_clear"]
    assert list(single) == ["bob", "ann"]
    assert 0 < single["bob"] <= union < single["bob"] + single["ann"]


def test_a_server_that_listens_tells_how_it_ended_and_what_the_team_found() -> None:
    rig = begun()
    rig.says("bob", seen_by("bob", Pose2(1.0, 0.0, 0.0)))
    rig.says("ann", beacon())
    rig.tick(20.0)
    rig.says("bob", beacon(1.0))
    part = listener_part(rig.listener)
    assert (part["ended"], part["sim_time_s"]) == ("failed", 20.5)
    assert "before the mission" in part["reason"]
    rig.tick()
    rig.through("bob")
    rig.through("ann")
    rig.tick()
    assert listener_part(rig.listener)["ended"] == "explored"
    found = listener_witness(rig.listener)
    assert list(found["robots"]) == ["ann", "bob"] and found["map_digest"]


@pytest.fixture(scope="module")
def robot() -> Rig:
    rig = Rig()
    rig.join()
    rig.radio("bob", seen_by("bob", Pose2(1.0, 0.0, 0.0)))
    rig.peer.handle(Rejected("radio", "eve", "nonsense"), 0.0)
    rig.live(1.0)
    return rig


def test_a_robot_tells_of_itself(robot: Rig) -> None:
    part = peer_part(robot.peer)
    (me,) = part["robots"].values()
    assert "ended" not in me
    assert me["map_digest"] == team_part(robot.sharing.shared, SETTINGS)["map_digest"]
    assert me["track_map"].shape == (5, 4)
    (event,) = part["events"]
    assert (event["t_s"], event["peer"], event["count"]) == (1.0, "eve", 1)


def test_a_robot_that_is_through_has_finished() -> None:
    rig = Rig()
    rig.join()
    rig.peer.choosing.through = True
    assert peer_part(rig.peer)["robots"]["me"]["ended"] == "finished"


def test_a_robot_in_a_later_life_leaves_its_way_to_the_team() -> None:
    rig = Rig(life=1)
    rig.join()
    (me,) = peer_part(rig.peer)["robots"].values()
    assert "track_map" not in me and me["map_digest"] is None


def test_a_robot_tells_of_the_team_and_of_what_is_left(robot: Rig) -> None:
    part = peer_witness(robot.peer, SETTINGS)
    assert sorted(part["robots"]) == ["bob", "me"]
    assert part["remaining"] and all("reason" in place for place in part["remaining"])
    nothing: dict[str, Any] = peer_witness(Rig().peer, SETTINGS)
    assert "remaining" not in nothing
    blind = Rig()
    blind.radio("bob", seen_by("bob", IDENTITY))
    assert peer_witness(blind.peer, SETTINGS)["grid"] is not None
