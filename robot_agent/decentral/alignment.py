"""Finds where a robot's own map lies in the team's, by what the others saw around there.

Source: Pfingsthorn et al. 2007, section 2, for starts that are known: "it is sufficient to know
their relative starting poses", and for "cases where explicit alignment and correction of partial
maps is necessary", here by exhaustive search (Olson 2009) in the map of the others' scans.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from mapping.correlative_search import SearchWindow
from mapping.geometry import Floats, Pose2
from mapping.match_map import MapSettings, MatchMap
from mapping.scan import LaserScan
from mapping.scan_matching import match
from mapping.scan_points import scan_points, turned_points

# The others' scans from farther away than this do not show where the robot is [m].
_NEAR = 12.0
_SCANS_MOST = 150
# Own scans take part that were made within this of the last one [m].
_TOGETHER = 1.0
# So many of these take part, and about so many end points of them all in the search: more would
# make the search surer of itself than it may be, as scans from one spot share their errors.
_OWN_MOST = 8
_POINTS_MOST = 400


@dataclass(frozen=True, slots=True)
class Fit:
    """Where a robot's own map lies in the team's, and how well what it saw fits there.

    Attributes:
        T_map_own: its pose.
        points: end points at walls.
        share: of the end points that fall where something is known, those at walls.
        known: share of all end points that fall where something is known.
        sigma: one standard deviation of the place [m].
    """

    T_map_own: Pose2
    points: int
    share: float
    known: float
    sigma: float


def map_around(
    scans: Iterable[tuple[LaserScan, Pose2]], place: Pose2, resolution: float
) -> MatchMap:
    """Return a map of those of some placed scans that were made around a place, map frame."""
    near = [(s, pose) for s, pose in scans if pose.distance_to(place) <= _NEAR]
    every = max(1, math.ceil(len(near) / _SCANS_MOST))
    drawn = MatchMap(MapSettings(resolution=resolution))
    drawn.insert_all(near[::every])
    return drawn


def align(
    around: MatchMap,
    own: Sequence[tuple[LaserScan, Pose2]],
    T_map_own_guess: Pose2,
    sigma: tuple[float, float],
) -> Fit | None:
    """Return where the robot's own map lies in a map of the others, None with nothing to tell.

    What all scans made near the last one show together is searched for in a window of three
    standard deviations: one scan alone fits in many places along a corridor.

    Args:
        around: what the others saw.
        own: scans and their poses in the robot's own map; at least one.
        T_map_own_guess: where its map is thought to lie.
        sigma: how well that is known, [m] and [rad].
    """
    if around.scans == 0:
        return None
    place, turn = sigma
    T_own_last = own[-1][1]
    near = [(s, pose) for s, pose in own if pose.distance_to(T_own_last) <= _TOGETHER][-_OWN_MOST:]
    points = _together(near, T_own_last)
    found = match(
        around.grid,
        around.surfaces,
        points,
        T_map_own_guess @ T_own_last,
        np.diag([place**2, place**2, turn**2]),
        around.settings.matching,
        SearchWindow(3.0 * place, min(3.0 * turn, math.pi)),
    )
    T_map_own = found.T_map_base @ T_own_last.inverse()
    at_walls, known, all_points = 0, 0, 0
    for scan, T_own_base in near:
        # Where it is now known to be: only the fit counts.
        held = around.match(scan, T_map_own @ T_own_base, np.diag([1e-4, 1e-4, 1e-5]))
        at_walls, known = at_walls + held.explained, known + held.known
        all_points += int(scan.hits.sum())
    sigma_found = math.sqrt(float(np.linalg.eigvalsh(found.covariance[:2, :2])[1]))
    return Fit(
        T_map_own,
        at_walls,
        at_walls / known if known else 0.0,
        known / all_points if all_points else 0.0,
        sigma_found,
    )


def _together(scans: Sequence[tuple[LaserScan, Pose2]], T_own_base: Pose2) -> Floats:
    """Return end points and facings of scans in the frame of a pose of the robot's, (N, 4)."""
    T_base_own = T_own_base.inverse()
    points = [turned_points(scan_points(scan), T_base_own @ pose) for scan, pose in scans]
    joined = np.concatenate(points)
    return np.ascontiguousarray(joined[:: max(1, len(joined) // _POINTS_MOST)])
