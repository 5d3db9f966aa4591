"""The laser messages of CARMEN's text logs.

Source: the CARMEN robot navigation toolkit's log format (Montemerlo, Roy, Thrun 2003).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from expedition.recordings.fields import DamagedError, Ranges, count, number, pose
from expedition.recordings.recording import Reading
from mapping.geometry import IDENTITY, Pose2
from mapping.scan import LaserScan

RANGE_MAX = 80.0
"""What a SICK LMS can reach [m], for logs that do not say."""

SICK_CODES = (81.0, 82.0)
"""A SICK LMS says with readings in this span [m] (8183 to 8191 cm) that nothing came back."""

AFTER_READINGS = 9  # x y theta odom_x odom_y odom_theta ipc_timestamp host logger_timestamp
AFTER_REMISSIONS = 14  # two poses, tv rv forward side turn_axis, ipc_timestamp host ...

# CARMEN knows a laser by the number of its readings: (field of view, step) [deg].
_SICK = {
    180: (180.0, 1.0),
    181: (180.0, 1.0),
    360: (180.0, 0.5),
    361: (180.0, 0.5),
    720: (180.0, 0.25),
    721: (180.0, 0.25),
    401: (100.0, 0.25),
}


@dataclass(slots=True)
class Laser:
    """What a log's PARAM lines said so far about its laser.

    Attributes:
        T_base_laser: where it sits.
        range_max: its reach [m].
        ranges: the readings met so far.
    """

    T_base_laser: Pose2 = IDENTITY
    range_max: float = RANGE_MAX
    ranges: Ranges = field(default_factory=Ranges)


def read_param(fields: Sequence[str], laser: Laser) -> None:
    """Take from a PARAM line what it says about the front laser; other ones are ignored.

    Raises:
        DamagedError: its value is of no use.
    """
    name = fields[1] if len(fields) > 1 else ""
    if name not in ("robot_frontlaser_offset", "robot_front_laser_max", "laser_max_range"):
        return
    if len(fields) < 3:
        raise DamagedError(f"{name} has no value")
    value = number(fields[2])
    if name == "robot_frontlaser_offset":
        if abs(value) > 100.0:
            raise DamagedError("the laser is absurdly far from the robot")
        laser.T_base_laser = Pose2(value, 0.0, 0.0) if value else IDENTITY
    else:
        laser.range_max = reach(value)


def read_flaser(fields: Sequence[str], laser: Laser) -> Reading:
    """Return the reading of a FLASER line.

    Raises:
        DamagedError: the line is damaged.
    """
    beams = _beams(fields, 1)
    if len(fields) != 2 + beams + AFTER_READINGS:
        raise DamagedError(f"{len(fields)} fields are not those of {beams} readings")
    after = fields[2 + beams :]
    pose(after[0:3])  # of no use here, but its damage shows that the line is not to be trusted
    start, step = bearings(beams)
    scan = LaserScan(
        ranges=_ranges(fields[2 : 2 + beams], laser),
        bearing_start=start,
        bearing_step=step,
        range_max=laser.range_max,
        stamp=number(after[6]),
        T_base_laser=laser.T_base_laser,
    )
    return Reading(scan, pose(after[3:6]))


def read_robotlaser(fields: Sequence[str], laser: Laser) -> Reading:
    """Return the reading of a ROBOTLASER1 line.

    Raises:
        DamagedError: the line is damaged.
    """
    beams = _beams(fields, 8)
    remissions_at = 9 + beams
    if len(fields) <= remissions_at:
        raise DamagedError(f"{len(fields)} fields are not those of {beams} readings")
    remissions = count(fields[remissions_at])
    if len(fields) != remissions_at + 1 + remissions + AFTER_REMISSIONS:
        raise DamagedError(
            f"{len(fields)} fields are not those of {beams} readings and {remissions} remissions"
        )
    after = fields[remissions_at + 1 + remissions :]
    start, step = number(fields[2]), number(fields[4])
    if not (abs(start) <= 2.0 * math.pi and step > 0.0 and step * (beams - 1) <= 2.1 * math.pi):
        raise DamagedError("the bearings go more than once around")
    T_wheel_base = pose(after[3:6])
    maximum_range = number(fields[5])
    scan = LaserScan(
        ranges=_ranges(fields[9:remissions_at], laser),
        bearing_start=start,
        bearing_step=step,
        range_max=reach(maximum_range) if maximum_range else laser.range_max,
        stamp=number(after[11]),
        T_base_laser=_mounting(T_wheel_base, pose(after[0:3])),
    )
    return Reading(scan, T_wheel_base)


def bearings(beams: int) -> tuple[float, float]:
    """Return the first beam's bearing and the step [rad] of a FLASER line with so many readings."""
    view, step = _SICK.get(beams, (180.0, 180.0 / max(beams - 1, 1)))
    return math.radians(-0.5 * view), math.radians(step)


def reach(range_max: float) -> float:
    """Return from which range [m] on nothing came back, for a laser's own `range_max` [m].

    Raises:
        DamagedError: it is no reach.
    """
    if not 0.0 < range_max <= 1e5:
        raise DamagedError(f"{range_max} is not a laser's reach")
    # A log may give 81.91 as maximum and mean by 81.83 that nothing came back.
    return SICK_CODES[0] if SICK_CODES[0] < range_max < SICK_CODES[1] else range_max


def _beams(fields: Sequence[str], at: int) -> int:
    if len(fields) <= at:
        raise DamagedError("the line ends before its readings")
    beams = count(fields[at])
    if beams < 2:
        raise DamagedError(f"{beams} readings are no sweep")
    return beams


def _ranges(texts: Sequence[str], laser: Laser) -> npt.NDArray[np.float32]:
    return np.fromiter(map(laser.ranges.__getitem__, texts), np.float32, len(texts))


def _mounting(T_wheel_base: Pose2, T_wheel_laser: Pose2) -> Pose2:
    """Return `T_base_laser` to 0.1 mm and 0.1 mrad: finer differences come from rounded digits."""
    exact = T_wheel_base.inverse() @ T_wheel_laser
    # Adding zero turns a rounded -0.0 into 0.0.
    rounded = Pose2(*(round(value, 4) + 0.0 for value in exact.as_tuple()))
    return IDENTITY if rounded == IDENTITY else rounded
