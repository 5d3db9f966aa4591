"""Places that robots were sent to in vain, and what follows from that.

A place one robot could not get to is kept from that robot, another may have more luck. A place
visited without its frontier going away rests until the map has caught up. Too many tries in all,
and it is given up for everybody, with the reasons on record.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from coordination.task import Point
from mapping.geometry import Floats


@dataclass(slots=True)
class TriedPlace:
    """One place and what was tried there.

    Attributes:
        place: (x, y) [m], map frame.
        reasons: why each try was in vain, oldest first.
        rests_until: nobody is sent there before [s].
        barred: robots that are not sent there again.
    """

    place: Point
    reasons: list[str] = field(default_factory=list)
    rests_until: float = -math.inf
    barred: list[str] = field(default_factory=list)

    @property
    def tries(self) -> int:
        """How often robots were sent there in vain."""
        return len(self.reasons)


class TriedPlaces:
    """All places tried in vain.

    Attributes:
        radius: places within this of each other are one [m].
        max_tries: so many tries, and a place is given up.
    """

    def __init__(self, radius: float, max_tries: int) -> None:
        self.radius = radius
        self.max_tries = max_tries
        self._places: list[TriedPlace] = []

    def failed(self, place: Point, robot: str, reason: str) -> bool:
        """Note a failure; return whether this was the last try the place gets."""
        tried = self._record(place)
        if robot not in tried.barred:
            tried.barred.append(robot)
        return self._count(tried, f"{robot}: {reason}")

    def visited(self, place: Point, robot: str, rests_until: float) -> bool:
        """Note that a robot was there; return whether this was the last try the place gets.

        If the frontier is gone with the next map, nothing comes of it. If not, its tries are
        counted: something that no sensor of ours can see keeps it unknown.
        """
        return self.rested(place, robot, "visited, and the frontier was left", rests_until)

    def rested(self, place: Point, robot: str, reason: str, rests_until: float) -> bool:
        """Note a try in vain that may do better in a while; return whether it was the last one."""
        tried = self._record(place)
        tried.rests_until = max(tried.rests_until, rests_until)
        return self._count(tried, f"{robot}: {reason}")

    def kept_from(self, robot: str, now: float, bars: bool = True) -> Floats:
        """Return the places (k, 2) [m] that a robot must not be sent to at `now` [s].

        With `now` infinite no place rests any more; without `bars` only what was given up, or
        rests, is kept from the robot.
        """
        return _points(
            tried
            for tried in self._places
            if self._given_up(tried) or (bars and robot in tried.barred) or now < tried.rests_until
        )

    def resting(self, now: float) -> Floats:
        """Return the places (k, 2) [m] that rest at `now` [s] and are not given up."""
        return _points(
            tried for tried in self._places if now < tried.rests_until and not self._given_up(tried)
        )

    def given_up(self) -> Floats:
        """Return the places (k, 2) [m] given up for everybody."""
        return _points(tried for tried in self._places if self._given_up(tried))

    def given_up_at(self, place: Point) -> TriedPlace | None:
        """Return what is on record of a place if it was given up, else None."""
        return self._nearest(place, given_up_only=True)

    def lift_bars(self) -> list[Point]:
        """Let every robot try again what is not given up yet; return the places this concerns.

        A robot may have failed because a teammate stood in its way. Tries go on counting.
        """
        lifted = []
        for tried in self._places:
            if tried.barred and not self._given_up(tried):
                tried.barred.clear()
                lifted.append(tried.place)
        return lifted

    def next_awake(self, now: float) -> float | None:
        """Return when the next resting place may be visited again [s], None if none rests."""
        times = [tried.rests_until for tried in self._places if tried.rests_until > now]
        return min(times, default=None)

    def _given_up(self, tried: TriedPlace) -> bool:
        return tried.tries >= self.max_tries

    def _count(self, tried: TriedPlace, reason: str) -> bool:
        tried.reasons.append(reason)
        return tried.tries == self.max_tries

    def _record(self, place: Point) -> TriedPlace:
        tried = self._nearest(place)
        if tried is None:
            tried = TriedPlace(place)
            self._places.append(tried)
        return tried

    def _nearest(self, place: Point, given_up_only: bool = False) -> TriedPlace | None:
        near = [
            (math.dist(tried.place, place), row)
            for row, tried in enumerate(self._places)
            if self._given_up(tried) or not given_up_only
        ]
        away, row = min(near, default=(math.inf, -1))
        return self._places[row] if away <= self.radius else None


def _points(places: Iterable[TriedPlace]) -> Floats:
    return np.array([tried.place for tried in places], dtype=np.float64).reshape(-1, 2)
