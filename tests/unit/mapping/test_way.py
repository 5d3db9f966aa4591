"""What a robot tells of its way, and how much it can be believed."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.geometry import IDENTITY, Floats, Pose2
from mapping.motion_model import MotionModel
from mapping.scan import LaserScan
from mapping.way import Report, corrected_track, way_between

SCAN = LaserScan(np.full(10, 8.0, np.float32), 0.0, 0.1, 8.0, 0.0)
WHEELS = MotionModel()
SURE = np.diag([1e-6, 1e-6, 1e-8])


def report(pose: Pose2, covariance: Floats, T_wheel_base: Pose2 | None = None) -> Report:
    track = np.array([[1.0, pose.x, pose.y, pose.theta]])
    return Report(SCAN, pose, covariance, track, T_wheel_base)


def grown(covariance: Floats) -> Floats:
    """The covariance after a metre straight ahead from the origin, without a look at the map."""
    return WHEELS.propagate(IDENTITY, covariance, Pose2(1.0, 0.0, 0.0))[1]


def test_in_the_open_the_way_is_as_good_as_the_wheels() -> None:
    unsure = np.diag([0.3, 0.2, 0.05])
    last, now = report(IDENTITY, unsure), report(Pose2(1.0, 0.0, 0.0), grown(unsure))
    way = way_between(last, now, now.track_odom, WHEELS)
    assert way.T_last_base == Pose2(1.0, 0.0, 0.0)
    expected = WHEELS.covariance(Pose2(1.0, 0.0, 0.0))
    assert way.covariance == pytest.approx(expected, abs=3e-4)


def test_between_walls_the_way_is_as_good_as_both_poses() -> None:
    known = np.diag([1e-4, 1e-4, 1e-5])
    last, now = report(IDENTITY, known), report(Pose2(1.0, 0.0, 0.0), known)
    way = way_between(last, now, np.zeros((0, 4)), WHEELS)
    assert 1e-4 < way.covariance[0, 0] < 5e-4
    assert way.covariance[2, 2] < 1e-4


def test_a_pose_that_comes_home_moved_by_its_old_error() -> None:
    unsure = np.diag([0.09, 0.09, 0.01])
    last, now = report(IDENTITY, unsure), report(Pose2(1.0, 0.0, 0.0), SURE)
    way = way_between(last, now, now.track_odom, WHEELS)
    assert way.covariance[0, 0] == pytest.approx(0.09, rel=0.1)


def test_where_the_wheels_contradict_they_stand() -> None:
    """The robot closed a loop in its own map: its pose jumped by half a metre."""
    last = report(IDENTITY, np.diag([0.09, 0.09, 0.01]), Pose2(5.0, 5.0, math.pi))
    now = report(Pose2(1.5, 0.0, 0.0), SURE, Pose2(4.0, 5.0, math.pi))
    way = way_between(last, now, now.track_odom, WHEELS)
    assert way.T_last_base.distance_to(Pose2(1.0, 0.0, 0.0)) < 1e-9
    assert way.covariance[0, 0] < 0.01
    agreed = report(Pose2(1.02, 0.0, 0.0), SURE, Pose2(4.0, 5.0, math.pi))
    assert way_between(last, agreed, agreed.track_odom, WHEELS).T_last_base.x == 1.02


def test_covariances_are_told_in_the_frame_of_the_new_pose() -> None:
    start = Pose2(0.0, 0.0, math.pi / 2)
    end = Pose2(0.0, 1.0, math.pi / 2)
    grew = WHEELS.propagate(start, SURE, Pose2(1.0, 0.0, 0.0))[1]
    way = way_between(report(start, SURE), report(end, grew), np.zeros((0, 4)), WHEELS)
    assert way.covariance[0, 0] > 3 * way.covariance[1, 1]


def test_the_correction_grows_along_a_track() -> None:
    track = np.array([[1.0, 0.0, 0.0, 0.0], [2.0, 1.0, 0.0, 0.0]])
    corrected = corrected_track(track, IDENTITY, Pose2(0.0, 0.4, 0.0))
    assert corrected[:, 2] == pytest.approx([0.2, 0.4])
    assert corrected[:, 0] == pytest.approx([1.0, 2.0])


def test_a_covariance_that_is_none_does_no_harm() -> None:
    nonsense = np.array([[-1.0, 1e300, 0.0], [0.0, 1e300, 5.0], [0.0, 0.0, 0.0]])
    last, now = report(IDENTITY, nonsense), report(Pose2(1.0, 0.0, 0.0), nonsense)
    way = way_between(last, now, now.track_odom, WHEELS)
    assert np.isfinite(way.covariance).all()
    assert np.linalg.eigvalsh(way.covariance)[0] > 0.0
