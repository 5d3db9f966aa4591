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

from mapping.correlative_search import APART, APART_TURN, SearchWindow
from mapping.geometry import Pose2
from mapping.match_map import MapSettings, MatchMap
from mapping.matching_together import match_together, together
from mapping.placed_by_sight import Guess
from mapping.scan import LaserScan
from mapping.scan_matching import MatchResult, MatchSettings
from mapping.search_image import SearchSettings

Placed = tuple[LaserScan, Pose2]

# The others' scans from farther away than this do not show where the robot is [m].
_NEAR = 12.0
_SCANS_MOST = 150
# Own scans take part that were made within this of the first one [m].
_TOGETHER = 8.0
# So many of these take part, and about so many end points of them all in the search.
_OWN_MOST = 12
_POINTS_MOST = 400
# So many separate places are compared: one of many that look alike is no place at all.
_MATCHING = MatchSettings(search=SearchSettings(candidates=8))
# Where a scan is taken to be when only its fit counts.
_HELD = np.diag([1e-4, 1e-4, 1e-5])


@dataclass(frozen=True, slots=True)
class Fit:
    """Where a robot's own map lies in the team's, and how well what it saw fits there.

    Attributes:
        T_map_own: its pose.
        points: end points at walls.
        share: of the end points that fall where something is known, those at walls.
        known: share of all end points that fall where something is known.
        sigma: one standard deviation of the place, along its worst direction [m].
        turn_sigma: of the heading [rad].
        rival: end points that this place leaves unexplained, as a share of those that the best
            place apart from it does; 0 if there is none such.
    """

    T_map_own: Pose2
    points: int
    share: float
    known: float
    sigma: float
    turn_sigma: float = 0.0
    rival: float = 0.0


def map_around(scans: Iterable[Placed], place: Pose2, resolution: float) -> MatchMap:
    """Return a map of those of some placed scans that were made around a place, map frame."""
    return map_of([(s, pose) for s, pose in scans if pose.distance_to(place) <= _NEAR], resolution)


def map_of(scans: Sequence[Placed], resolution: float, most: int = _SCANS_MOST) -> MatchMap:
    """Return a map of placed scans; of more than `most` evenly some are drawn."""
    every = max(1, math.ceil(len(scans) / most))
    drawn = MatchMap(MapSettings(resolution=resolution, matching=_MATCHING))
    drawn.insert_all(scans[::every])
    return drawn


def align(around: MatchMap, own: Sequence[Placed], guess: Guess) -> Fit | None:
    """Return where the robot's own map lies in a map of the others, None with nothing to tell.

    What scans made around the first one show together is searched for: one scan alone fits in many
    places along a corridor.

    Args:
        around: what the others saw.
        own: scans and their poses in the robot's own map; at least one.
        guess: where its map is thought to lie.
    """
    if around.scans == 0:
        return None
    T_own_first = own[0][1]
    near = [(s, pose) for s, pose in own if pose.distance_to(T_own_first) <= _TOGETHER]
    # What was seen first comes last: guesses are of where the robot began.
    return lay(around, near[:: max(1, math.ceil(len(near) / _OWN_MOST))][::-1], guess)


def lay(around: MatchMap, own: Sequence[Placed], guess: Guess) -> Fit:
    """Lay what a robot saw onto a map, all of it together, within three sigmas of a guess.

    Args:
        around: the map; not empty.
        own: scans and their poses in the robot's own map; at least one. The last was made about
            where the guess counts.
        guess: where its map is thought to lie.
    """
    place, turn = guess.sigmas
    window = SearchWindow(3.0 * place, min(3.0 * turn, math.pi))
    T_own_last = own[-1][1]
    seen = together(own, T_own_last, _POINTS_MOST)
    places = match_together(around, seen, T_own_last, guess, window)
    found = places[0]
    T_map_own = found.T_map_base @ T_own_last.inverse()
    points, share, known = explained(around, own, T_map_own)
    return Fit(
        T_map_own,
        points,
        share,
        known,
        math.sqrt(float(np.linalg.eigvalsh(found.covariance[:2, :2])[1])),
        math.sqrt(float(found.covariance[2, 2])),
        _rival(places, len(seen)),
    )


def explained(
    around: MatchMap, own: Iterable[Placed], T_map_own: Pose2
) -> tuple[int, float, float]:
    """Return how well scans fit a map, if the robot's own map lies at a pose in it.

    Returns:
        End points at walls; their share of those where something is known; the share of all end
        points that fall there.
    """
    at_walls, known, every = 0, 0, 0
    for scan, T_own_base in own:
        held = around.match(scan, T_map_own @ T_own_base, _HELD)
        at_walls, known = at_walls + held.explained, known + held.known
        every += int(scan.hits.sum())
    return at_walls, at_walls / known if known else 0.0, known / every if every else 0.0


def _rival(places: Sequence[MatchResult], points: int) -> float:
    """Return what the first place leaves unexplained, as a share of what the next one apart does.

    Args:
        places: where scans fit, the best first.
        points: end points in all.
    """
    best = places[0]
    apart = [
        points - place.explained
        for place in places[1:]
        if place.T_map_base.moved(best.T_map_base, APART, APART_TURN)
    ]
    return (points - best.explained) / max(min(apart), 1) if apart else 0.0
