from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry import IDENTITY, Pose2, wrap_angle
from protocol.log.pose_coding import PoseTable, pose_of, pose_steps
from robot_agent.decentral.own_poses import OwnPoses, moved

T_MAP_OWN = Pose2(2.0, -1.0, 0.5)
poses = st.builds(
    Pose2, st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(-math.pi, math.pi)
)


def table(*rows: Pose2) -> PoseTable:
    return np.array([pose_steps(row) for row in rows], dtype=np.int32).reshape(-1, 3)


def test_entries_of_earlier_starts_keep_their_poses_and_come_first() -> None:
    kept = table(Pose2(9.0, 9.0, 1.0))
    rows = OwnPoses(kept, T_MAP_OWN).table(np.array([[1.0, 0.0, 0.2]]))
    assert rows.dtype == np.int32
    assert rows[0].tolist() == kept[0].tolist()
    expected = T_MAP_OWN @ Pose2(1.0, 0.0, 0.2)
    assert pose_of(rows[1].tolist()).distance_to(expected) < 0.002


def test_without_entries_the_table_is_empty() -> None:
    assert OwnPoses(table(), T_MAP_OWN).table(np.zeros((0, 3))).shape == (0, 3)


@given(poses, poses, poses)
def test_the_frame_it_drives_in_follows_what_became_of_the_last_entry(
    now_known: Pose2, as_told: Pose2, since: Pose2
) -> None:
    """Driven on by `since`, the robot is that far from where its last entry is now known."""
    own = OwnPoses(table(), T_MAP_OWN)
    T_map_odom = own.T_map_odom(now_known.as_array(), as_told)
    there = T_map_odom @ as_told @ since
    expected = T_MAP_OWN @ now_known @ since
    assert there.distance_to(expected) < 1e-6
    assert wrap_angle(there.theta - expected.theta) == pytest.approx(0.0, abs=1e-9)


def test_a_pose_that_is_off_by_enough_is_a_move() -> None:
    before = table(IDENTITY, Pose2(1.0, 0.0, 0.0))
    assert not moved(table(), table(), 0.02, 0.01)
    assert not moved(before, before, 0.02, 0.01)
    assert not moved(before, table(IDENTITY, Pose2(1.0, 0.019, 0.009)), 0.02, 0.01)
    assert moved(before, table(IDENTITY, Pose2(1.0, 0.02, 0.0)), 0.02, 0.01)
    assert moved(before, table(IDENTITY, Pose2(1.0, 0.0, -0.01)), 0.02, 0.01)


def test_a_turn_past_half_a_circle_is_the_short_way_round() -> None:
    before, after = table(Pose2(0.0, 0.0, 3.14)), table(Pose2(0.0, 0.0, -3.14))
    assert not moved(before, after, 0.02, 0.01)
    assert moved(before, after, 0.02, 0.003)
