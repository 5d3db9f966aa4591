"""A recording with better poses, as a CARMEN log that other programs read too."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt

from expedition.recordings.carmen_messages import bearings
from expedition.recordings.recording import Reading, Recording, RecordingError
from mapping.geometry import Pose2, pose_from
from mapping.scan import LaserScan


def write_carmen(path: Path, recording: Recording, poses: npt.ArrayLike) -> None:
    """Write a recording with corrected poses as a CARMEN log.

    Args:
        path: the file, written anew.
        recording: ranges, stamps and raw odometry.
        poses: (n, 3), where the robot was at each reading: x, y [m] and theta [rad], map frame.

    Raises:
        RecordingError: the laser is none that such a log can tell of.
        ValueError: there is not one pose for each reading.
    """
    lines = list(carmen_lines(recording, poses))  # nothing is written of what cannot be
    path.write_text("".join(line + "\n" for line in lines), encoding="ascii")


def carmen_lines(recording: Recording, poses: npt.ArrayLike) -> Iterator[str]:
    """Yield the lines of a CARMEN log, without line ends.

    Every FLASER line has the laser's corrected pose, then the raw odometry. All numbers are
    written in full: `carmen.parse` reads the same readings.

    Args:
        recording: ranges, stamps and raw odometry.
        poses: (n, 3), where the robot was at each reading: x, y [m] and theta [rad], map frame.

    Raises:
        RecordingError: the laser is none that such a log can tell of.
        ValueError: there is not one pose for each reading.
    """
    trajectory = np.asarray(poses, dtype=np.float64).reshape(-1, 3)
    if len(trajectory) != len(recording.readings):
        raise ValueError(f"{len(trajectory)} poses for {len(recording.readings)} readings")
    yield "# FLASER num_readings [range_readings] x y theta odom_x odom_y odom_theta"
    yield "# x y theta: of the laser, corrected; odom_x odom_y odom_theta: of the robot, raw"
    laser: tuple[float, float] | None = None
    for reading, row in zip(recording.readings, trajectory, strict=True):
        scan = reading.scan
        _check(scan)
        if laser != (scan.range_max, scan.T_base_laser.x):
            laser = scan.range_max, scan.T_base_laser.x
            yield f"PARAM laser_max_range {scan.range_max!r} nohost 0"
            yield f"PARAM robot_frontlaser_offset {scan.T_base_laser.x!r} nohost 0"
        yield _flaser(reading, pose_from(row), recording.readings[0].scan.stamp)


def _flaser(reading: Reading, T_map_base: Pose2, start: float) -> str:
    scan = reading.scan
    # The format has no word for infinity; what is beyond the reach says the same.
    ranges = np.where(np.isfinite(scan.ranges), scan.ranges, np.float32(scan.range_max))
    return " ".join(
        (
            f"FLASER {len(ranges)}",
            *map(str, ranges),
            _triple(T_map_base @ scan.T_base_laser),
            _triple(reading.T_wheel_base),
            f"{scan.stamp!r} nohost {scan.stamp - start:.6f}",
        )
    )


def _triple(pose: Pose2) -> str:
    return " ".join(repr(float(value)) for value in pose.as_tuple())


def _check(scan: LaserScan) -> None:
    """Raise RecordingError for a laser that FLASER cannot tell of."""
    known = bearings(len(scan.ranges))
    mounted = scan.T_base_laser
    if not (
        math.isclose(scan.bearing_start, known[0], abs_tol=1e-6)
        and math.isclose(scan.bearing_step, known[1], abs_tol=1e-9)
        and max(abs(mounted.y), abs(mounted.theta)) < 1e-9
    ):
        raise RecordingError(
            "a CARMEN log can only tell of a laser that looks straight ahead over 180 degrees: "
            "write the trajectory to a .tum file instead"
        )
