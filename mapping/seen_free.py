"""Which end points lie where earlier scans looked through: a map's word without any grid."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from mapping.geometry import Floats, Pose2, wrap_angle
from mapping.scan import LaserScan

# A laser looked through a place where its beams ended this far behind [m].
_THROUGH = 0.3


def count_contradictions(
    scan: LaserScan, T_map_base: Pose2, views: Sequence[tuple[LaserScan, Pose2]]
) -> int:
    """Return how much speaks against a pose, in end points.

    Those of the scan count where an earlier one looked through, and those of the last of these
    where the scan itself does: a wall that it cannot have missed.

    Args:
        scan: the scan.
        T_map_base: the pose of the robot to judge.
        views: at least one earlier scan, and where the robot was then.
    """
    last_scan, T_map_last = views[-1]
    ahead = count_seen_free(T_map_base.apply(scan.points_base()), views, _THROUGH)
    missed = T_map_last.apply(last_scan.points_base())
    return ahead + count_seen_free(missed, [(scan, T_map_base)], _THROUGH)


def count_seen_free(
    points_map: Floats, views: Iterable[tuple[LaserScan, Pose2]], margin: float
) -> int:
    """Return how many end points lie in free space, going by some earlier scans.

    Args:
        points_map: (N, 2) or more columns, x, y [m], map frame.
        views: earlier scans, and where the robot was then, `T_map_base`.
        margin: a point counts when the beams next to it ended at least this far behind it [m].
    """
    free = np.zeros(len(points_map), dtype=np.bool_)
    for scan, T_map_base in views:
        if len(scan.ranges) < 3:
            continue
        points = (T_map_base @ scan.T_base_laser).inverse().apply(points_map[:, :2])
        bearings = np.arctan2(points[:, 1], points[:, 0])
        middle = scan.bearing_start + 0.5 * scan.bearing_step * (len(scan.ranges) - 1)
        off = np.remainder(bearings - wrap_angle(middle) + np.pi, 2.0 * np.pi) - np.pi
        beams = np.round(off / scan.bearing_step + 0.5 * (len(scan.ranges) - 1)).astype(np.int64)
        inside = (beams >= 1) & (beams < len(scan.ranges) - 1)
        beams = np.where(inside, beams, 1)
        nearby = scan.ranges[beams[:, np.newaxis] + np.arange(-1, 2)].min(axis=1)
        free |= inside & (np.hypot(points[:, 0], points[:, 1]) + margin < nearby)
    return int(free.sum())
