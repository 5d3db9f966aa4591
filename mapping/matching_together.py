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
    seen: Sequence[tuple[LaserScan, Pose2]],
    guess: Guess,
    window: SearchWindow,
    most: int | None = None,
) -> list[MatchResult]:
    """Return where the robot was at its last scan, the most likely place first.

    Args:
        map_: the map.
        seen: scans and their poses in the robot's own map; at least one.
        guess: where its own map may lie.
        window: how far around that to search.
        most: about so many end points take part; None for all. Scans from one spot share their
            errors, so that many make a match surer of itself than it may be.
    """
    T_own_last = seen[-1][1]
    return matches(
        map_.grid,
        map_.surfaces,
        together(seen, T_own_last, most),
        guess.T_map_odom @ T_own_last,
        guess.covariance,
        map_.settings.matching,
        window,
    )


def together(
    seen: Sequence[tuple[LaserScan, Pose2]], T_own_base: Pose2, most: int | None
) -> Floats:
    """Return end points and facings of scans in the frame of a pose of the robot's, (N, 4)."""
    T_base_own = T_own_base.inverse()
    points = np.concatenate(
        [turned_points(scan_points(scan), T_base_own @ pose) for scan, pose in seen]
    )
    every = max(1, len(points) // most) if most else 1
    return np.ascontiguousarray(points[::every])
