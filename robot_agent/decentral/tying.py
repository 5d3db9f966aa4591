"""A robot that does not know yet where its own map lies in the team's: what it saw, and tries.

It stands somewhere about a place that it was told, or where others saw it, or where it was when its
software ended. What it sees there is kept until it fits what the others saw around there.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from mapping.geometry import Pose2
from mapping.placed_by_sight import Guess
from protocol.log.pose_coding import pose_of
from protocol.log.sync import LogSync
from protocol.messages import ScanReport
from protocol.reported_scan import scan_of
from protocol.world_messages import Joined
from robot_agent.decentral.alignment import Fit, Placed, align, map_around
from robot_agent.decentral.settings import TyingSettings

_EPSILON = 1e-9
# A robot that was started anew stands about where it told last that it was [m], [rad]: it may have
# gone on for as long as it takes to tell, and turned to any side.
_LEFT_SIGMA = (0.7, math.radians(60.0))
# Where it wrote down itself that it was, it is [m], [rad].
_KEPT_SIGMA = (0.15, math.radians(10.0))
# Two tries that found the same place differ by no more than this [m], [rad].
_AGREED = (0.1, math.radians(2.0))
# Starts are off by no more than so much, that of the robot and that of the reference: both together
# are to be three standard deviations.
_BOTH = 2.0 / 3.0
_NO_NEWS = 10.0  # [s]; so long nothing new comes: then what there is must do
_HELD_MOST = 2000  # observations


@dataclass(frozen=True, slots=True)
class Whereabouts:
    """Where a robot is thought to be, map frame, and how well that is known [m], [rad]."""

    T_map_own: Pose2
    sigma: tuple[float, float]

    @property
    def guess(self) -> Guess:
        """The same as a guess to search around."""
        place, turn = self.sigma
        return Guess(self.T_map_own, np.diag([place**2, place**2, turn**2]), seen=False)


def told_at_start(joined: Joined) -> Whereabouts:
    """Return where a robot was told that it starts."""
    sigma = _BOTH * joined.start_sigma_m, _BOTH * math.radians(joined.start_sigma_deg)
    return Whereabouts(joined.start or Pose2(0.0, 0.0, 0.0), sigma)


def left_at(
    sync: LogSync, kept: Pose2 | None, heard: Pose2 | None, told: Whereabouts
) -> Whereabouts:
    """Return where a robot was before its software was started anew.

    Args:
        sync: what is held of its earlier lives shows where it was seen last.
        kept: where it wrote down itself that it was, or None.
        heard: where others last heard it say that it was, or None.
        told: where it was told that it started, if nothing else is known.
    """
    if kept is not None:
        return Whereabouts(kept, _KEPT_SIGMA)
    if heard is not None:
        return Whereabouts(heard, _LEFT_SIGMA)
    me = sync.log.me
    for author in sorted(sync.log.authors(), reverse=True):
        log = sync.log.of(author)
        if author.robot == me.robot and author != me and log.entries:
            return Whereabouts(pose_of(log.pose(log.top)), _LEFT_SIGMA)
    sigma = max(told.sigma[0], _LEFT_SIGMA[0]), max(told.sigma[1], _LEFT_SIGMA[1])
    return Whereabouts(told.T_map_own, sigma)


@dataclass(frozen=True, slots=True)
class Standing:
    """Where a teammate stands that knows its place, map frame, and its radius [m]."""

    x: float
    y: float
    radius: float


def doubts(
    fit: Fit, settings: TyingSettings, seen: bool = False, taken: bool = False
) -> tuple[str, ...]:
    """Return why a robot may not be where what it saw fits best; nothing if it surely is.

    Args:
        fit: how well that fits.
        settings: what is good enough.
        seen: whether others saw it about there: then walls need not say where along them it is.
        taken: whether a teammate stands there.
    """
    sigma_most = settings.sight_sigma_m if seen else settings.sigma_m
    rules = {
        "it saw too little": fit.points < settings.points,
        "walls are missing": fit.share < settings.fit,
        "too little is known there": not seen and fit.known < settings.known,
        "it may be elsewhere along the walls": fit.sigma > sigma_most,
        "it may be turned": fit.turn_sigma > math.radians(settings.sigma_deg),
        "another place fits about as well": fit.rival > settings.rival,
        "a teammate stands there": taken,
    }
    return tuple(why for why, holds in rules.items() if holds)


def is_taken(T_map_base: Pose2, teammates: Iterable[Standing]) -> bool:
    """Whether a teammate stands where a robot would be: no two are in one place."""
    return any(
        math.hypot(mate.x - T_map_base.x, mate.y - T_map_base.y) < mate.radius for mate in teammates
    )


def contradicts(fit: Fit, settings: TyingSettings) -> bool:
    """Whether what is known there shows that the robot is elsewhere."""
    enough = fit.share > 0.0 and fit.points / fit.share >= settings.points
    return (enough or fit.known >= settings.known) and fit.share < settings.wrong_fit


class Tying:
    """What a robot saw before it knows where, and what it tries to find that out.

    Args:
        settings: what a good fit is, and how often to try.

    Attributes:
        waiting: reports of what it saw.
        doubts: why the last try found nothing.
    """

    def __init__(self, settings: TyingSettings) -> None:
        self.waiting: list[ScanReport] = []
        self.doubts: tuple[str, ...] = ()
        self._settings = settings
        self._tried = (0, 0)  # number of the newest report, and what was held, at the last try
        self._next = 0.0
        self._found: Pose2 | None = None  # by the last try
        self._seen: Pose2 | None = None  # where others saw it, as of the last try
        self._unopposed = 0  # so many tries in a row spoke neither for nor against that

    def add(self, report: ScanReport) -> None:
        """Keep what the robot saw."""
        if len(self.waiting) < _HELD_MOST:
            self.waiting.append(report)

    def due(self, held: int, now: float) -> bool:
        """Whether there is something new to try with, and the last try is some time ago.

        A place that was found once is looked at again also if nothing new comes for long.

        Args:
            held: checksum of what others saw, as far as it is held.
            now: mission time [s].
        """
        if len(self.waiting) < self._settings.scans:
            return False
        if self._found is not None and now >= self._next + _NO_NEWS:
            return True
        news = (self.waiting[-1].number, held) != self._tried
        return news and now >= self._next - _EPSILON

    def attempt(
        self,
        scans: Sequence[Placed],
        guesses: Iterable[Guess],
        teammates: Sequence[Standing],
        resolution: float,
        held: int,
        now: float,
    ) -> Pose2 | None:
        """Return where the robot's own map lies, None if what it saw does not surely fit anywhere.

        Two tries must find the same place: a wrong one that fits the little that is known does not
        fit any more when there is more. Where others saw it, and walls neither agree nor
        contradict, as there are none in reach, it is after some tries.

        Args:
            scans: what others saw, and where, map frame.
            guesses: where the robot's own map may lie, the surest first.
            teammates: those who know where they are.
            resolution: edge of a cell to match with [m].
            held: checksum of what is held of others.
            now: mission time [s].
        """
        settings = self._settings
        self._tried, self._next = (self.waiting[-1].number, held), now + settings.period_s
        own = [(scan_of(report), report.T_odom_base) for report in self.waiting]
        T_own_first, T_own_base = own[0][1], own[-1][1]
        for guess in guesses:
            around = map_around(scans, guess.T_map_odom @ T_own_first, resolution)
            fit = align(around, own, guess)
            if fit is not None:
                taken = is_taken(fit.T_map_own @ T_own_base, teammates)
                self.doubts = doubts(fit, settings, guess.seen, taken)
                if not self.doubts:
                    return self._found_again(fit.T_map_own)
            if guess.seen and (fit is None or not contradicts(fit, settings)):
                return self._only_seen(guess.T_map_odom)
        self._found, self._unopposed = None, 0
        return None

    def _found_again(self, T_map_own: Pose2) -> Pose2 | None:
        """Return a place if the last try found it, too."""
        before, self._found = self._found, T_map_own
        agreed = before is not None and not before.moved(T_map_own, *_AGREED)
        return T_map_own if agreed else None

    def _only_seen(self, T_map_own: Pose2) -> Pose2 | None:
        """Return the place where others saw the robot, if walls have had their say for long."""
        again = self._seen is not None and not self._seen.moved(T_map_own, *_AGREED)
        self._found, self._seen = None, T_map_own
        self._unopposed = self._unopposed + 1 if again else 1
        return T_map_own if self._unopposed >= self._settings.sight_tries else None

    def take(self) -> list[ScanReport]:
        """Return all that waited: the robot knows where that was."""
        waiting, self.waiting = self.waiting, []
        return waiting
