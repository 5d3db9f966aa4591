"""Victims from sightings: what robots saw at many times and places, fused to people who lie there.

Every robot of a team may do this alone: the result depends on the sightings as a set, never on the
order in which they came, so all who hold the same sightings find the same victims. When poses are
corrected the sightings move with them, and the victims are found anew.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy.typing as npt

from mapping.geometry import Pose2

# Standard deviation of a sighting's place [m]: that of the pose it was seen from, and on top what
# grows with the distance from which it was seen [m per m]: errors of distance and bearing.
_SIGMA_NEAR = 0.1
_SIGMA_FAR = 0.05


@dataclass(frozen=True, slots=True)
class Sighting:
    """Somebody was made out once.

    Attributes:
        robot: by whom.
        stamp: when [s].
        x: where [m], map frame.
        y: where [m], map frame.
        distance: from how far away [m]; the farther, the less it counts.
    """

    robot: str
    stamp: float
    x: float
    y: float
    distance: float = 0.0


@dataclass(frozen=True, slots=True)
class Victim:
    """Somebody who lies in the building.

    Attributes:
        x: where [m], map frame.
        y: where [m], map frame.
        seen_by: the robot that saw it first.
        first_seen: when that was [s].
        sightings: how often it was seen in all.
    """

    x: float
    y: float
    seen_by: str
    first_seen: float
    sightings: int


def sighting_at(robot: str, stamp: float, T_map_base: Pose2, point_base: npt.ArrayLike) -> Sighting:
    """Return the sighting of somebody at (2,) [m], base frame, from a robot's pose at `stamp` [s].

    Args:
        robot: who saw.
        stamp: of the scan that it belongs to.
        T_map_base: where that scan was taken, as the team estimates it now.
        point_base: where somebody was made out.
    """
    x, y = T_map_base.apply(point_base).tolist()
    return Sighting(robot, stamp, x, y, math.hypot(x - T_map_base.x, y - T_map_base.y))


def find_victims(sightings: Sequence[Sighting], gate: float) -> tuple[Victim, ...]:
    """Return the victims that a set of sightings shows, in order of when they were first seen.

    In order of time each sighting joins the nearest victim within `gate`, or is a new one; a
    victim's place is the mean of its sightings, weighted by their variances. Victims that end up
    within the gate of each other become one, the nearest two first.

    Args:
        sightings: in any order; the same one twice counts once.
        gate: sightings of one victim lie within this distance [m] of its place.

    Source: sequential leader clustering (Hartigan 1975, section 3.2), with weighted means.
    """
    victims: list[Victim] = []
    weights: list[float] = []
    for seen in sorted(set(sightings), key=lambda s: (s.stamp, s.robot, s.x, s.y, s.distance)):
        one = Victim(seen.x, seen.y, seen.robot, seen.stamp, 1)
        weight = 1.0 / (_SIGMA_NEAR**2 + (_SIGMA_FAR * seen.distance) ** 2)
        nearest = min(range(len(victims)), key=lambda k: _apart(victims[k], one), default=-1)
        if nearest >= 0 and _apart(victims[nearest], one) <= gate:
            victims[nearest] = _fused(victims[nearest], weights[nearest], one, weight)
            weights[nearest] += weight
        else:
            victims.append(one)
            weights.append(weight)
    _join_near(victims, weights, gate)
    return tuple(sorted(victims, key=lambda v: (v.first_seen, v.seen_by, v.x, v.y)))


def _join_near(victims: list[Victim], weights: list[float], gate: float) -> None:
    """Join, in place, victims within `gate` [m] of each other, the nearest two first."""
    while True:
        pairs = [
            (_apart(victims[i], victims[j]), i, j) for j in range(len(victims)) for i in range(j)
        ]
        distance, i, j = min(pairs, default=(math.inf, 0, 0))
        if distance > gate:
            return
        victims[i] = _fused(victims[i], weights[i], victims[j], weights[j])
        weights[i] += weights[j]
        del victims[j], weights[j]


def _apart(one: Victim, other: Victim) -> float:
    """Return the distance between two victims [m]."""
    return math.hypot(one.x - other.x, one.y - other.y)


def _fused(earlier: Victim, weight: float, later: Victim, more: float) -> Victim:
    """Return two victims as one; `earlier` was seen first."""
    share = more / (weight + more)
    return Victim(
        earlier.x + share * (later.x - earlier.x),
        earlier.y + share * (later.y - earlier.y),
        earlier.seen_by,
        earlier.first_seen,
        earlier.sightings + later.sightings,
    )
