"""Whether and where scans fit the team's map, and robots with it that are not tied to it yet."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from mapping.correlative_search import SearchWindow
from mapping.geometry import Floats
from mapping.match_map import MatchMap
from mapping.matching_together import match_together, together
from mapping.mutual_sightings import MutualSightings
from mapping.placed_by_sight import Guess, seen_by_others
from mapping.scan_matching import MatchResult
from mapping.way import Report
from server.placing import Member
from server.settings import MergerSettings

_HELD_TOGETHER = 6  # reports that are matched together


def guesses(
    name: str, members: Mapping[str, Member], sightings: MutualSightings
) -> Iterator[Guess]:
    """Return where a robot that is not tied to the team's map may be, the surest first.

    Among posts of a robot's size others take it for one of them, and it them: what was told stands
    beside what was seen.
    """
    relation = seen_by_others(name, members, sightings)
    if relation is not None:
        yield Guess(relation.T_a_b, relation.covariance, seen=True)
    yield Guess(members[name].T_map_odom, members[name].covariance, seen=False)


def match_held(map_: MatchMap, held: Sequence[Report], guess: Guess) -> MatchResult:
    """Match the last reports of a robot with the team's map, all together.

    Args:
        map_: the team's map.
        held: its reports so far.
        guess: where its local map may lie.
    """
    sigma, turn_sigma = guess.sigmas
    # Starts are told with uniform errors: one sigma of them is their largest.
    sigmas = 3.0 if guess.seen else 1.25
    window = SearchWindow(sigmas * sigma + 0.1, sigmas * turn_sigma + 0.02)
    scans = [(report.scan, report.T_odom_base) for report in held[-_HELD_TOGETHER:]]
    T_odom_base = scans[-1][1]
    return match_together(map_, together(scans, T_odom_base), T_odom_base, guess, window)[0]


def aligns(result: MatchResult, held: int, settings: MergerSettings) -> bool:
    """Whether a match is good enough to tie a robot to the team's map."""
    if result.explained < settings.align_points or result.fit < settings.align_fit:
        return False
    sigma = math.sqrt(np.linalg.eigvalsh(result.covariance[:2, :2])[-1])
    sure = sigma <= settings.align_sigma_m and result.covariance[2, 2] <= (
        math.radians(settings.align_sigma_deg) ** 2
    )
    return bool(sure) or held >= settings.hold_most


def search_window(prior: Floats, settings: MergerSettings) -> SearchWindow | None:
    """Return the window to search, or None where the guess is good."""
    sigma = math.sqrt(max(prior[0, 0], prior[1, 1]))
    turn_sigma = math.sqrt(prior[2, 2])
    if sigma < settings.search_sigma_m and turn_sigma < math.radians(3.0):
        return None
    return SearchWindow(min(3.0 * sigma, 1.5), min(3.0 * turn_sigma, 0.5))


def contradicts(result: MatchResult, settings: MergerSettings) -> bool:
    """Whether enough end points fall where the map is known, and too few of them at walls."""
    return result.known >= settings.known_least and result.fit < settings.fit_least
