"""Who makes way when two robots would meet.

Both compute the same order from what both know: who drives for a task goes before who does not,
then by name. The lower one makes way. If that leads nowhere (the lower one has no room), both see
that neither moves, and the roles are dealt anew by the common clock until they have passed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapping.compiled import compiled
from mapping.geometry import Floats, Pose2
from robot_agent.navigation_settings import RightOfWaySettings
from robot_agent.path_following import evenly_spaced

# How fast robots are taken to drive when asking when they meet [m/s].
_USUAL_SPEED = 0.45
# Paths whose directions differ by less than 60 degrees are ways of two that follow each other.
_SAME_WAY = 0.5
# Who is this far behind where two ways join lets the other one go first [m].
_FIRST_BY = 0.15
# Two that come to the joint of their ways this far apart in time do not touch [s].
_JOIN_APART = 1.5
# Points of a path in the meeting test are this far apart [m].
_SAMPLE = 0.15
# Only robots this near to each other can be jammed [m].
_JAMMED_WITHIN = 3.0


@dataclass(frozen=True, slots=True)
class Teammate:
    """What a teammate announced last.

    Attributes:
        name: its name, unique in the team.
        T_map_base: where it was at `stamp`.
        stamp: mission time of that [s].
        radius: of its body [m].
        path_map: (n, 2) [m], what it is about to drive, nearest first; empty if it means to stay.
        busy: whether it drives for a task.
    """

    name: str
    T_map_base: Pose2
    stamp: float
    radius: float
    path_map: Floats
    busy: bool


@dataclass(frozen=True, slots=True)
class Sighting:
    """A teammate and what was made of its announcements.

    Attributes:
        teammate: its last announcement.
        x: where it should be now [m], map frame.
        y: [m].
        vx: its velocity [m/s], map frame.
        vy: [m/s].
        path_map: (n, 2) [m], what it is still to drive, from where it should be now; one point
            if it stays.
        stands_since: since when it has not moved [s].
        silent: whether it has not been heard of for long: it is an obstacle.
    """

    teammate: Teammate
    x: float
    y: float
    vx: float
    vy: float
    path_map: Floats
    stands_since: float
    silent: bool

    @property
    def stays(self) -> bool:
        """Whether it does not mean to drive anywhere."""
        return self.silent or len(self.path_map) < 2


@dataclass(frozen=True, slots=True)
class Rival:
    """A teammate that this robot has to make way for.

    Attributes:
        sighting: the teammate.
        mine: how far along this robot's path the two would meet [m].
        theirs: how far along the other's path [m].
        joining: whether both go the same way, so that waiting a moment is enough.
        behind: how far this robot is behind the other where their ways join [m].
    """

    sighting: Sighting
    mine: float
    theirs: float
    joining: bool
    behind: float


@dataclass(slots=True)
class _Encounter:
    """Two robots in each other's way: since when, seen last when, and whether roles are swapped."""

    since: float
    last: float
    swapped: bool
    epoch: int


class RightOfWay:
    """Remembers encounters and decides who makes way."""

    def __init__(self, name: str, settings: RightOfWaySettings) -> None:
        """Decide for the robot `name`."""
        self._name = name
        self._settings = settings
        self._encounters: dict[str, _Encounter] = {}

    def rivals(
        self,
        now: float,
        path_map: Floats,
        radius: float,
        busy: bool,
        stands_since: float,
        others: Sequence[Sighting],
    ) -> list[Rival]:
        """Return the teammates to make way for.

        Args:
            now: mission time [s].
            path_map: (n, 2) [m], where this robot is and is about to drive; one point if it stays.
            radius: of this robot [m].
            busy: whether this robot drives for a task.
            stands_since: since when this robot has not moved [s].
            others: the teammates.
        """
        found = []
        mine = _sampled(path_map, self._settings.horizon_m)
        for other in others:
            rival = None if other.stays else self._meeting(mine, radius, other)
            if rival is None:
                continue
            name = other.teammate.name
            swapped = False
            if not rival.joining and len(path_map) > 1:
                here = (float(path_map[0, 0]), float(path_map[0, 1]))
                swapped = self._swapped(now, here, stands_since, other)
            lower = (not busy, self._name) > (not other.teammate.busy, name)
            if self._after(rival) if rival.joining else lower != swapped:
                found.append(rival)
        self._forget(now)
        return found

    def _meeting(self, mine: Floats, radius: float, other: Sighting) -> Rival | None:
        """Return where and how this robot and another would meet, None if they would not."""
        settings = self._settings
        theirs = _sampled(other.path_map, settings.horizon_m)
        reach = radius + other.teammate.radius + settings.gap_m
        i, j, joining, lead = _first_meeting(
            mine, theirs, reach, settings.time_apart_s * _USUAL_SPEED, _JOIN_APART * _USUAL_SPEED
        )
        if i < 0:
            return None
        behind = (i - j) * _SAMPLE + lead
        return Rival(other, i * _SAMPLE, j * _SAMPLE, bool(joining), behind)

    def _after(self, rival: Rival) -> bool:
        """Whether this robot comes later where two ways join; by name if they come together."""
        if abs(rival.behind) > _FIRST_BY:
            return rival.behind > 0.0
        return self._name > rival.sighting.teammate.name

    def _swapped(
        self, now: float, here: tuple[float, float], stands_since: float, other: Sighting
    ) -> bool:
        """Whether the usual roles of this robot and another are swapped for this encounter."""
        name = other.teammate.name
        epoch = math.floor(now / self._settings.jammed_after_s)
        encounter = self._encounters.get(name)
        if encounter is None:
            encounter = self._encounters[name] = _Encounter(now, now, False, epoch)
        encounter.last = now
        still_since = max(stands_since, other.stands_since, encounter.since)
        near = math.hypot(here[0] - other.x, here[1] - other.y) < _JAMMED_WITHIN
        if epoch != encounter.epoch:
            encounter.epoch = epoch
            if near and now - still_since > self._settings.jammed_after_s:
                # The clock is common, so both robots set the same role at the same time.
                encounter.swapped = epoch % 2 == 1
        return encounter.swapped

    def _forget(self, now: float) -> None:
        """Drop encounters that are over."""
        over = self._settings.forget_after_s
        self._encounters = {
            name: encounter
            for name, encounter in self._encounters.items()
            if now - encounter.last <= over
        }


def _sampled(path_map: Floats, horizon: float) -> Floats:
    """Return the first `horizon` [m] of a path as points `_SAMPLE` apart (n, 2); n may be 1."""
    if len(path_map) < 2:
        return np.ascontiguousarray(path_map, dtype=np.float64)
    points = np.ascontiguousarray(path_map, dtype=np.float64)
    return evenly_spaced(points, _SAMPLE)[: math.ceil(horizon / _SAMPLE) + 1]


@compiled
def _first_meeting(
    mine: Floats, theirs: Floats, reach: float, apart: float, join_apart: float
) -> tuple[int, int, bool, float]:
    """Return the first points of two sampled paths at which two robots would be too near.

    Args:
        mine: (n, 2) [m]; a single point stands for a robot that stays there.
        theirs: (m, 2) [m].
        reach: the least distance between centres [m].
        apart: robots are in each other's way if they come to a place within as much driving of
            each other [m].
        join_apart: the same where both go in one direction [m].

    Returns:
        The indices of the points, (-1, -1) if they do not meet; whether the ways join there; and
        if so, how far the other's point is ahead of this robot's [m].
    """
    count, other = len(mine), len(theirs)
    for i in range(count):
        for j in range(other):
            dx, dy = theirs[j, 0] - mine[i, 0], theirs[j, 1] - mine[i, 1]
            if dx * dx + dy * dy >= reach * reach:
                continue
            if count == 1:
                return i, j, False, 0.0
            a, b = min(i, count - 2), min(j, other - 2)
            ax, ay = mine[a + 1, 0] - mine[a, 0], mine[a + 1, 1] - mine[a, 1]
            bx, by = theirs[b + 1, 0] - theirs[b, 0], theirs[b + 1, 1] - theirs[b, 1]
            norm = math.hypot(ax, ay) * math.hypot(bx, by)
            same_way = ax * bx + ay * by > _SAME_WAY * norm
            # At its end a robot stays: who comes later still meets it.
            ended = (i == count - 1 and j > i) or (j == other - 1 and i > j)
            difference = abs(i - j) * _SAMPLE
            if same_way and not ended:
                if difference <= join_apart:
                    return i, j, True, (dx * ax + dy * ay) / max(math.hypot(ax, ay), 1e-9)
            elif difference <= apart or (ended and difference <= 3.0 * apart):
                return i, j, False, 0.0
    return -1, -1, False, 0.0
