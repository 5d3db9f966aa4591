"""Every robot to the frontier that the fewest others are nearer to.

A robot's rank at a frontier is how many of the others have a shorter way to it. Robots that all
stand in one corridor so spread over the frontiers instead of all heading for the nearest one. What
a robot chooses depends on the bids alone, not on what the others choose: robots that know the same
bids can each decide for themselves and need not agree on anything.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field

from coordination.bid import RobotBid, near
from coordination.strategy import Choice, Region, choice_of
from mapping.geometry import Floats

Ints = npt.NDArray[np.int64]


class MinPosSettings(BaseModel):
    """Settings of the strategy of lowest ranks.

    Attributes:
        min_gain_m2: the least gain worth a trip.
        frontier_m: bids tell places, ranks are for frontiers: places within this of each other
            count as one frontier, and a robot's way there is that to its nearest place on it.
        keep_radius_m: a robot goes on to its goal while a frontier is left within this of it and
            its rank is as good there as anywhere.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    min_gain_m2: Annotated[float, Field(ge=0.0)] = 0.5
    frontier_m: Annotated[float, Field(ge=0.0)] = 1.0
    keep_radius_m: Annotated[float, Field(ge=0.0)] = 0.5


@dataclass(frozen=True, slots=True)
class _Worthwhile:
    """The part of one robot's bid that is worth a trip; (k,) arrays, one entry for each place."""

    bid: RobotBid
    rows: Ints  # of the bid
    places: Floats  # (k, 2) [m]
    ways: Floats  # path lengths, those of a slow robot count more [m]

    @property
    def robot(self) -> str:
        return self.bid.robot


class MinPos:
    """Each robot heads for the frontier it has the lowest rank at; of several, for the nearest.

    With fewer frontiers than robots some go to the same frontier, as in the paper, and maybe to the
    same place on it: the strategy does not keep robots apart, it only makes meeting rare.

    Source: Bautin, Simonin & Charpillet 2012, "MinPos: a novel frontier allocation algorithm for
    multi-robot exploration".
    """

    coordinated = False

    def __init__(self, settings: MinPosSettings | None = None) -> None:
        self.settings = settings or MinPosSettings()

    @classmethod
    def from_settings(cls, settings: Mapping[str, object]) -> MinPos:
        """Return the strategy with these settings."""
        return cls(MinPosSettings.model_validate(dict(settings)))

    @property
    def min_gain(self) -> float:
        """The least gain [m2] worth a trip."""
        return self.settings.min_gain_m2

    def assign(
        self,
        bids: tuple[RobotBid, ...],
        current: tuple[Region, ...],
        running: tuple[Region, ...],
    ) -> tuple[Choice, ...]:
        """Choose places for the bidding robots; see `Strategy.assign`."""
        heading = {region.robot: region for region in current}
        everyone = [self._worthwhile(bid) for bid in sorted(bids, key=lambda bid: bid.robot)]
        choices = (self._choose(one, everyone, heading.get(one.robot), running) for one in everyone)
        return tuple(choice for choice in choices if choice is not None)

    def choose(
        self,
        own: RobotBid,
        others: Sequence[RobotBid],
        heading: Region | None,
        running: tuple[Region, ...],
    ) -> Choice | None:
        """Choose for one robot alone: what `assign` says of it, without the work for the others.

        Args:
            own: the robot's bid.
            others: the bids of the robots it knows of, in any order, at most one of each.
            heading: what it is heading for now, if anything.
            running: what robots without a bid are heading for.

        Returns:
            None if nothing is worth a trip.
        """
        everyone = [self._worthwhile(bid) for bid in others]
        return self._choose(self._worthwhile(own), everyone, heading, running)

    def _worthwhile(self, bid: RobotBid) -> _Worthwhile:
        worth = (bid.gains >= self.settings.min_gain_m2) & (bid.gains > 0.0)
        rows = np.flatnonzero(worth)
        return _Worthwhile(bid, rows, bid.places[rows], bid.cost_weight * bid.costs[rows])

    def _choose(
        self,
        own: _Worthwhile,
        everyone: Sequence[_Worthwhile],
        heading: Region | None,
        running: tuple[Region, ...],
    ) -> Choice | None:
        """Return one robot's choice; its own entry in `everyone` does not count as another's."""
        if len(own.rows) == 0:
            return None
        ranks = self._ranks(own, everyone, running)
        best = ranks == ranks.min()
        if heading is not None:
            kept = best & near(own.places, heading.goal, self.settings.keep_radius_m)
            best = kept if kept.any() else best
        rows = own.rows[best]
        row = int(rows[np.argmin(own.bid.costs[rows])])
        return choice_of(own.bid, row, float(own.bid.gains[row]), -float(ranks.min()))

    def _ranks(
        self, own: _Worthwhile, everyone: Sequence[_Worthwhile], running: tuple[Region, ...]
    ) -> Ints:
        """Return for each place how many other robots are nearer to its frontier, (k,).

        At equal ways the smaller name is nearer. A robot that goes on with what it is at did not
        bid, but it is nearer to the frontier at its goal than anybody.
        """
        radius = self.settings.frontier_m
        ways = _ways_to_frontiers(own.places, own, radius)
        goals = np.array([region.goal for region in running], dtype=np.float64).reshape(-1, 2)
        ranks: Ints = _within(own.places, goals, radius).sum(axis=1, dtype=np.int64)
        for other in everyone:
            if other.robot != own.robot:
                theirs = _ways_to_frontiers(own.places, other, radius)
                ranks += (theirs <= ways) if other.robot < own.robot else (theirs < ways)
        return ranks


def _ways_to_frontiers(places: Floats, robot: _Worthwhile, radius: float) -> Floats:
    """Return a robot's way [m] to the frontier around each of `places` (n, 2), (n,).

    That is the shortest of its ways to places within `radius` [m]; infinite if there is none.
    """
    close = _within(places, robot.places, radius)
    ways: Floats = np.where(close, robot.ways, np.inf).min(axis=1, initial=np.inf)
    return ways


def _within(places: Floats, points: Floats, radius: float) -> npt.NDArray[np.bool_]:
    """Return which of `points` (m, 2) are within `radius` [m] of each of `places`, (n, m)."""
    dx = places[:, 0, np.newaxis] - points[:, 0]
    dy = places[:, 1, np.newaxis] - points[:, 1]
    result: npt.NDArray[np.bool_] = dx * dx + dy * dy <= radius * radius
    return result
