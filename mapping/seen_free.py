"""Which end points lie where earlier scans looked through: a map's word without any grid."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from mapping.geometry import Floats, Pose2, wrap_angle
from mapping.scan import LaserScan


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
