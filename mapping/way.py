"""A robot's own word on its way: the scans it tells of, and how it came from one to the next."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mapping.geometry import Floats, Pose2, interpolate, pose_from, wrap_angle
from mapping.motion_model import MotionModel
from mapping.pose_graph import carried_covariance, positive_part, turned_covariance
from mapping.scan import LaserScan

# No robot knows its way from one report to the next better than this [m], [rad].
_LEAST = np.diag([0.01**2, 0.01**2, 0.005**2])
# No variance is larger [m^2], [rad^2].
_MOST = 1e6
# The wheels contradict a robot's corrected way beyond this squared error (three dimensions).
_WHEELS_CONTRADICT = 12.0


@dataclass(frozen=True, slots=True)
class Report:
    """One scan of a robot as it told it.

    Attributes:
        scan: the scan, without beams that hit teammates.
        T_odom_base: the robot's locally corrected pose.
        covariance: (3, 3) of it relative to the robot's own map around it, odom frame.
        track_odom: (n, 4) stamp, x, y, theta since the report before, odom frame.
        T_wheel_base: where the wheels alone put the robot, in a frame of their own; None untold.
        sightings_odom: (k, 2) [m] where it saw discs of a teammate's size, odom frame.
    """

    scan: LaserScan
    T_odom_base: Pose2
    covariance: Floats
    track_odom: Floats
    T_wheel_base: Pose2 | None = None
    sightings_odom: Floats = field(default_factory=lambda: np.zeros((0, 2)))


@dataclass(frozen=True, slots=True)
class Way:
    """A robot's own word on how it got from one report to the next.

    Attributes:
        T_last_base: the new pose in the one before.
        covariance: (3, 3) of it, in the frame of the new pose.
        error: (3, 3) of it as far as the robot drove blind, odom frame.
        by_wheels: whether only the wheels' word stands.
    """

    T_last_base: Pose2
    covariance: Floats
    error: Floats = field(default_factory=lambda: np.zeros((3, 3)))
    by_wheels: bool = False


def way_between(last: Report, report: Report, track_odom: Floats, motion: MotionModel) -> Way:
    """Return what a robot tells of its way from one report to the next.

    Its word is at least as good as its wheels. Where its own map told it more, its covariance
    stopped growing; where it came back to a part of its map it knew better, its pose moved by an
    error as large as its uncertainty before. With P before and after, A = F P F' the old one
    carried along, Q what the wheels add, and K = 1 - P (A + Q)^-1 the gain, the error of the way
    is P - A + K A + A K'. If it moved so far that the wheels contradict, it closed a loop in its
    own map; then the wheels' word stands, and the loop is closed here, all along the way.

    Args:
        last: the report before.
        report: the new one.
        track_odom: (n, 4) stamp, x, y, theta since the report before, the new pose last.
        motion: how wrong the robot's wheels are.

    Source: the Kalman filter's errors before and after an update, subtracted (Kalman 1960).
    """
    before, after = _sane(last.covariance), _sane(report.covariance)
    pose, wheels = last.T_odom_base, np.zeros((3, 3))
    stops = [pose_from(row[1:]) for row in track_odom] or [report.T_odom_base]
    for stop in stops:
        pose, wheels = motion.propagate(pose, wheels, pose.inverse() @ stop)
    start, end = last.T_odom_base, report.T_odom_base
    T_last_base = start.inverse() @ end
    if last.T_wheel_base is not None and report.T_wheel_base is not None:
        T_wheels = last.T_wheel_base.inverse() @ report.T_wheel_base
        error = (T_wheels.inverse() @ T_last_base).as_array()
        allowed = turned_covariance(wheels, end.theta) + _LEAST
        if float(error @ np.linalg.solve(allowed, error)) > _WHEELS_CONTRADICT:
            return Way(T_wheels, allowed, wheels, by_wheels=True)
    carried = carried_covariance(before, end.x - start.x, end.y - start.y)
    kept = np.linalg.solve(carried + wheels + 1e-9 * np.eye(3), after).T
    lost = (np.eye(3) - kept) @ carried
    grown = positive_part(after - carried + lost + lost.T)
    return Way(T_last_base, turned_covariance(grown, end.theta) + _LEAST, grown)


def _sane(covariance: Floats) -> Floats:
    """Return what a robot tells as a covariance (3, 3), made one, no larger than the world."""
    strengths, directions = np.linalg.eigh(0.5 * (covariance + covariance.T))
    sane: Floats = (directions * strengths.clip(0.0, _MOST)) @ directions.T
    return sane


def corrected_track(track_odom: Floats, T_map_odom_before: Pose2, T_map_odom: Pose2) -> Floats:
    """Return poses (n, 4) stamp, x, y, theta in the map frame; the correction grows along the way.

    Args:
        track_odom: (n, 4) the same in the odom frame.
        T_map_odom_before: where the local map lay at the start of the track.
        T_map_odom: and at its end.
    """
    corrected = np.empty_like(track_odom)
    for k, (stamp, x, y, theta) in enumerate(track_odom.tolist()):
        T_blend = interpolate(T_map_odom_before, T_map_odom, (k + 1) / len(track_odom))
        pose = T_blend @ Pose2(x, y, theta)
        corrected[k] = stamp, pose.x, pose.y, wrap_angle(pose.theta)
    return corrected
