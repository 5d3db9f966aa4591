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

# The others' scans from farther away than this do not show where the robot is [m].
_NEAR = 12.0
_SCANS_MOST = 150
# Own scans take part that were made within this of the last one [m].
_TOGETHER = 1.0


@dataclass(frozen=True, slots=True)
class Fit:
    """Where a robot's own map lies in the team's, and how well what it saw fits there.

    Attributes:
        T_map_own: its pose.
        points: end points at walls.
        share: of the end points that fall where something is known, those at walls.
        sigma: one standard deviation of the place [m].
    """

    T_map_own: Pose2
    points: int
    share: float
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

    The last scan is searched for in a window of three standard deviations; scans made near it must
    fit as well as it does.

    Args:
        around: what the others saw.
        own: scans and their poses in the robot's own map; at least one.
        T_map_own_guess: where its map is thought to lie.
        sigma: how well that is known, [m] and [rad].
    """
    if around.scans == 0:
        return None
    place, turn = sigma
    last, T_own_last = own[-1]
    window = SearchWindow(3.0 * place, min(3.0 * turn, math.pi))
    prior: Floats = np.diag([place**2, place**2, turn**2])
    found = around.match(last, T_map_own_guess @ T_own_last, prior, window)
    T_map_own = found.T_map_base @ T_own_last.inverse()
    points, known = 0, 0
    for scan, T_own_base in own:
        if T_own_base.distance_to(T_own_last) > _TOGETHER:
            continue
        # Where it is now known to be: only the fit counts.
        held = around.match(scan, T_map_own @ T_own_base, np.diag([1e-4, 1e-4, 1e-5]))
        points, known = points + held.explained, known + held.known
    covariance = found.covariance[:2, :2]
    sigma_found = math.sqrt(float(np.linalg.eigvalsh(covariance)[1]))
    return Fit(T_map_own, points, points / known if known else 0.0, sigma_found)
