"""Observations and changes of mind, put in order."""

from __future__ import annotations

from expedition.experiments.map_updates import map_updates
from mapping.geometry import Pose2
from tests.unit.expedition.observations import SEEN, observation, repositioning


def test_without_changes_of_mind():
    updates = map_updates(SEEN, [])
    assert [update.stamp for update in updates] == [1.0, 1.0, 2.0, 3.0]
    assert [update.T_map_laser for update in updates] == [
        Pose2(x, 0.0, 0.0) for x in (10.0, 20.0, 11.0, 21.0)
    ]
    scan = updates[0].scan
    assert scan is not None
    assert (scan.ranges.tolist(), scan.bearing_start, scan.range_max) == ([1.0, 2.0, 3.0], -0.1, 20)
    assert all(not update.moved for update in updates)


def test_new_poses_go_with_the_observation_of_the_same_instant():
    updates = map_updates(SEEN, [repositioning(3.0, "bob", [22.0])])
    assert len(updates) == 4
    assert updates[3].moved == {1: Pose2(22.0, 1.0, 0.0)}
    assert updates[3].T_map_laser == Pose2(21.0, 0.0, 0.0)


def test_new_poses_that_speak_of_the_observation_itself_too():
    updates = map_updates(SEEN, [repositioning(3.0, "bob", [22.0, 23.0])])
    assert updates[3].moved == {1: Pose2(22.0, 1.0, 0.0)}
    assert updates[3].T_map_laser == Pose2(23.0, 1.0, 0.0)


def test_new_poses_between_observations_are_an_update_of_their_own():
    told = [repositioning(2.5, "ada", [12.0, 13.0]), repositioning(9.0, "eve", [0.0])]
    updates = map_updates(SEEN, told)
    assert [update.stamp for update in updates] == [1.0, 1.0, 2.0, 2.5, 3.0, 9.0]
    assert updates[3].scan is None and updates[3].T_map_laser is None
    assert updates[3].moved == {0: Pose2(12.0, 1.0, 0.0), 2: Pose2(13.0, 1.0, 0.0)}
    assert updates[5].moved == {}


def test_of_two_tellings_at_one_instant_the_last_counts():
    told = [repositioning(1.5, "ada", [12.0]), repositioning(1.5, "ada", [14.0])]
    updates = map_updates(SEEN, told)
    assert updates[2].moved == {0: Pose2(14.0, 1.0, 0.0)}
    assert len(updates) == 5


def test_two_observations_at_one_instant():
    seen = [observation(1.0, "ada", 0, 1.0), observation(1.0, "ada", 1, 2.0)]
    updates = map_updates(seen, [repositioning(1.0, "ada", [3.0])])
    assert updates[0].moved == {}
    assert updates[1].moved == {0: Pose2(3.0, 1.0, 0.0)}
