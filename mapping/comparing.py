"""Comparing one scan with one submap: where it lies in it, if it fits and can be believed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.correlative_search import SearchWindow
from mapping.geometry import Floats, Pose2, wrap_angle
from mapping.loop_settings import LoopSettings
from mapping.match_map import MatchMap
from mapping.scan import LaserScan
from mapping.scan_matching import MatchResult
from mapping.wall_information import firm_part, wall_information

# No pose is ever known better than this against another robot's, or against long ago [m], [rad].
FLOOR = np.diag([0.02**2, 0.02**2, math.radians(0.3) ** 2])
# A smaller turn is not worth a search [rad].
_SEARCH_TURN = math.radians(2.0)


@dataclass(frozen=True, slots=True)
class Match:
    """Where a scan lies in a map.

    Attributes:
        T_map_base: its pose, in the map's frame.
        information: (3, 3) of it, same frame; nothing in directions that no wall holds.
    """

    T_map_base: Pose2
    information: Floats


def firm_match(
    map_: MatchMap, scan: LaserScan, guess: Pose2, prior: Floats, result: MatchResult
) -> Match:
    """Return what straight walls hold of a match; in all else the guess stands.

    Args:
        map_: the map that was matched with.
        scan: the scan.
        guess: where it was expected.
        prior: (3, 3) covariance of that, frame of the map.
        result: where it fits.
    """
    information = firm_part(wall_information(map_, scan, result.T_map_base))
    pull = information @ _difference(result.T_map_base, guess)
    x, y, turn = np.linalg.solve(np.linalg.inv(prior) + information, pull).tolist()
    return Match(Pose2(guess.x + x, guess.y + y, wrap_angle(guess.theta + turn)), information)


def fits(result: MatchResult, settings: LoopSettings) -> bool:
    """Whether a match is worth an edge of the pose graph."""
    return result.explained >= settings.points and result.fit >= settings.fit_least


def window_of(prior: Floats, settings: LoopSettings) -> SearchWindow:
    """Return the window in which a scan is looked for, by the covariance (3, 3) of the guess."""
    return SearchWindow(
        min(3.0 * widest_sigma(prior), settings.window_m),
        min(3.0 * math.sqrt(prior[2, 2]), math.radians(settings.window_deg)),
    )


def widest_sigma(covariance: Floats) -> float:
    """Return one sigma of a place along the direction that is known least [m].

    Args:
        covariance: (3, 3) of (x, y, theta).
    """
    xx, xy, yy = float(covariance[0, 0]), float(covariance[0, 1]), float(covariance[1, 1])
    return math.sqrt(0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy))


def compare(
    map_: MatchMap, scan: LaserScan, guess: Pose2, prior: Floats, settings: LoopSettings
) -> Match | None:
    """Match a scan with a submap, at the guess first, and then in the window around it.

    Args:
        map_: the submap's.
        scan: the scan.
        guess: its pose, as foreseen, in the submap's frame.
        prior: (3, 3) covariance of that.
        settings: what counts as a fit.
    """
    result = map_.match(scan, guess, prior)
    if not fits(result, settings) or result.fit < settings.fit_at_once:
        window = window_of(prior, settings)
        if window.reach < settings.search_from_m and window.turn < _SEARCH_TURN:
            return None
        result = map_.match(scan, guess, prior, window)
        if not fits(result, settings):
            return None
    match = firm_match(map_, scan, guess, prior, result)
    offset = _difference(match.T_map_base, guess)
    if float(offset @ np.linalg.solve(prior + FLOOR, offset)) > settings.gate:
        return None
    return match


def _difference(one: Pose2, other: Pose2) -> Floats:
    """Return (x, y, theta) of one pose less another, (3,), in the frame of both."""
    return np.array([one.x - other.x, one.y - other.y, wrap_angle(one.theta - other.theta)])
