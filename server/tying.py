"""Whether and where scans fit the team's map, and robots with it that are not tied to it yet."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mapping.correlative_search import SearchWindow
from mapping.geometry import Floats, Pose2
from mapping.match_map import MatchMap
from mapping.pose_graph import carried_covariance, turned_covariance
from mapping.scan_matching import MatchResult, match
from mapping.scan_points import scan_points, turned_points
from mapping.way import Report
from server.mutual_sightings import MutualSightings, Relation
from server.placing import Member
from server.settings import MergerSettings

_HELD_TOGETHER = 6  # reports that are matched together


@dataclass(frozen=True, slots=True)
class Guess:
    """Where a robot's local map may lie in the team's.

    Attributes:
        T_map_odom: there.
        covariance: (3, 3) of it, map frame.
        seen: whether teammates saw the robot there; else it was told.
    """

    T_map_odom: Pose2
    covariance: Floats
    seen: bool


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
    covariance, T_odom_base = guess.covariance, held[-1].T_odom_base
    sigma = math.sqrt(max(covariance[0, 0], covariance[1, 1]))
    turn_sigma = math.sqrt(covariance[2, 2])
    # Starts are told with uniform errors: one sigma of them is their largest.
    sigmas = 3.0 if guess.seen else 1.25
    window = SearchWindow(sigmas * sigma + 0.1, sigmas * turn_sigma + 0.02)
    T_base_odom = T_odom_base.inverse()
    points = [
        turned_points(scan_points(report.scan), T_base_odom @ report.T_odom_base)
        for report in held[-_HELD_TOGETHER:]
    ]
    return match(
        map_.grid,
        map_.surfaces,
        np.concatenate(points),
        guess.T_map_odom @ T_odom_base,
        covariance,
        map_.settings.matching,
        window,
    )


def seen_by_others(
    name: str, members: Mapping[str, Member], sightings: MutualSightings
) -> Relation | None:
    """Return where a robot's local map lies in the team's by what robots saw of each other.

    Those between may not be tied to the team's map themselves yet.
    """
    told = {other: member.T_map_odom for other, member in members.items()}
    sigma = max(member.told[0] for member in members.values())
    turn_sigma = max(member.told[1] for member in members.values())
    # One frame was turned by its own error; so the offset's error may be longer than two.
    relations = sightings.relations(told, 3.0 * sigma, 2.0 * turn_sigma)
    found = {
        other: Relation(known.T_map_odom, np.zeros((3, 3)))
        for other, known in members.items()
        if known.aligned
    }
    while name not in found:
        step = _surest_step(found, relations)
        if step is None:
            return None
        found[step[0]] = step[1]
    return found[name]


def _surest_step(
    found: Mapping[str, Relation], relations: Mapping[tuple[str, str], Relation]
) -> tuple[str, Relation] | None:
    """Return the robot whose heading is known best by those whose maps lie in the team's already.

    Args:
        found: how local maps lie in the team's, by robot, and the covariance of that, map frame.
        relations: between local maps, see `MutualSightings.relations`.

    Returns:
        Its name, and how its local map lies in the team's; None if nobody found saw another.
    """
    best = None
    for (one, other), relation in relations.items():
        if one not in found or other in found:
            continue
        T_map_one, known = found[one].T_a_b, found[one].covariance
        T_map_other = T_map_one @ relation.T_a_b
        dx, dy = T_map_other.x - T_map_one.x, T_map_other.y - T_map_one.y
        covariance = carried_covariance(known, dx, dy)
        covariance += turned_covariance(relation.covariance, -T_map_one.theta)
        if best is None or covariance[2, 2] < best[1].covariance[2, 2]:
            best = other, Relation(T_map_other, covariance)
    return best


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
