"""Scans of one robot matched with a map all together, laid out by the robot's own poses.

One view along a corridor fits anywhere along it. What was seen in all directions has corners.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mapping.correlative_search import SearchWindow
from mapping.geometry import Floats, Pose2
from mapping.match_map import MatchMap
from mapping.placed_by_sight import Guess
from mapping.scan import LaserScan
from mapping.scan_matching import MatchResult, matches
from mapping.scan_points import scan_points, turned_points


def match_together(
    map_: MatchMap,
    points: Floats,
    T_own_base: Pose2,
    guess: Guess,
    window: SearchWindow,
) -> list[MatchResult]:
    """Return where the robot was at a pose of its own map, the most likely place first.

    Args:
        map_: the map.
        points: (N, 4) end points in the frame of that pose, see `together`.
        T_own_base: that pose.
        guess: where its own map may lie.
        window: how far around that to search.
    """
    return matches(
        map_.grid,
        map_.surfaces,
        points,
        guess.T_map_odom @ T_own_base,
        guess.covariance,
        map_.settings.matching,
        window,
    )


def together(
    seen: Sequence[tuple[LaserScan, Pose2]], T_own_base: Pose2, most: int | None = None
) -> Floats:
    """Return end points and facings of scans in the frame of a pose of the robot's, (N, 4).

    Args:
        seen: scans and their poses in the robot's own map; at least one.
        T_own_base: the pose, own map.
        most: about so many end points take part; None for all. Scans from one spot share their
            errors, so that many make a match surer of itself than it may be.
    """
    T_base_own = T_own_base.inverse()
    points = np.concatenate(
        [turned_points(scan_points(scan), T_base_own @ pose) for scan, pose in seen]
    )
    every = max(1, len(points) // most) if most else 1
    return np.ascontiguousarray(points[::every])
