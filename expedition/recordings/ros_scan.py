"""A sweep from a ROS message."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from expedition.recordings.fields import FARTHEST, DamagedError
from expedition.recordings.ros_frames import Mounting
from mapping.scan import LaserScan


def scan_from(message: Any, stamp: float, mounting: Mounting) -> LaserScan:
    """Return the scan of a sensor_msgs/LaserScan, its beams counter-clockwise seen from above.

    Infinite ranges are beams without return (REP 117); ranges that are no number, or nearer than
    the laser can see, are to be ignored.

    Args:
        message: the message.
        stamp: when it was measured [s].
        mounting: how the laser sits on the robot.

    Raises:
        DamagedError: the message makes no sense.
    """
    start, step = float(message.angle_min), float(message.angle_increment)
    reach = float(message.range_max)
    beams = len(message.ranges)
    if not (math.isfinite(start) and 0.0 < abs(step) * max(beams - 1, 1) <= 2.1 * math.pi):
        raise DamagedError("the bearings make no sense")
    if not 0.0 < reach <= FARTHEST:
        raise DamagedError(f"{reach} is not a laser's reach")
    if beams < 2:
        raise DamagedError(f"{beams} readings are no sweep")
    ranges = np.array(message.ranges, dtype=np.float32)
    ranges[np.isposinf(ranges)] = reach
    ranges[~(ranges >= max(float(message.range_min), 0.0))] = 0.0
    if mounting.upside_down:
        start, step = -start, -step
    if step < 0.0:
        ranges = np.ascontiguousarray(ranges[::-1])
        start, step = start + (beams - 1) * step, -step
    return LaserScan(ranges, start, step, reach, stamp, mounting.T_base_laser)
