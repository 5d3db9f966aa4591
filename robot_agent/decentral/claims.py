"""Places that are left to teammates which said that they are on their way there.

Ranks (Bautin et al. 2012) tell who is nearer to a frontier, not who goes there: when frontiers get
fewer than robots, all head for the last one and stand in each other's way before its door. Here
what a teammate will have seen before oneself gets there is nothing to gain any more.

Source: the discount by what others will see is that of Simmons et al. 2000, section "Assigning
Tasks"; here each robot makes it for itself, from what it heard.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from coordination.bid import RobotBid, near, overlap_fractions
from coordination.task import Point
from mapping.geometry import Floats


@dataclass(frozen=True, slots=True)
class Claim:
    """Where a teammate said that it is heading.

    Attributes:
        robot: who.
        goal: (x, y) [m], map frame.
        way: how far it still has to there [m].
    """

    robot: str
    goal: Point
    way: float


@dataclass(frozen=True, slots=True)
class ClaimTerms:
    """When a place counts as claimed.

    Attributes:
        apart: from the claimed goal [m].
        overlap: share of the region one would see there that is seen from the claimed goal, too;
            counts only where somebody is nearer: regions are expected, and large while little is
            known, but what is next to a robot it may well look at.
        tie: ways that differ by less are equally long [m]; then the smaller name comes first.
    """

    apart: float
    overlap: float
    tie: float


def claimed(
    own: RobotBid, nearest: Floats, claims: Sequence[Claim], terms: ClaimTerms
) -> npt.NDArray[np.bool_]:
    """Return which places of a robot's bid are left to a teammate that comes there first.

    Args:
        own: the robot's bid.
        nearest: (n,) [m], the least way of any teammate to each place; infinite without any.
        claims: what teammates said, of each at most one.
        terms: what is near enough.

    Returns:
        (n,), one entry for each place.
    """
    taken = np.zeros(len(own), dtype=np.bool_)
    farther = own.costs >= nearest
    for claim in claims:
        # Each of two robots must come to the same: so the difference, and what if it is the tie.
        if claim.robot < own.robot:
            first = claim.way - own.costs <= terms.tie
        else:
            first = own.costs - claim.way > terms.tie
        close = near(own.places, claim.goal, terms.apart)
        taken |= first & close
        if close.any():
            taken |= first & farther & _seen_from(own, claim.goal, terms.overlap)
    return taken


def _seen_from(own: RobotBid, goal: Point, share: float) -> npt.NDArray[np.bool_]:
    """Return of which places' regions at least a share is as good as seen from `goal`, (n,)."""
    away = np.hypot(own.places[:, 0] - goal[0], own.places[:, 1] - goal[1])
    region = own.rectangles[int(np.argmin(away))].reshape(1, 4)
    seen: npt.NDArray[np.bool_] = overlap_fractions(own.rectangles, region) >= share
    return seen


def way_or_flight(way: float, a: Point, b: Point) -> float:
    """Return the length of a way [m]; as the crow flies if the map shows none (yet)."""
    return way if math.isfinite(way) else math.dist(a, b)
