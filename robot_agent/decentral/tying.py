"""A robot that does not know yet where its own map lies in the team's: what it saw, and tries.

It stands somewhere about a place that it was told, or where it was when its software ended. What it
sees there is kept until it fits what the others saw around there.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from mapping.geometry import Pose2
from mapping.scan import LaserScan
from protocol.log.pose_coding import pose_of
from protocol.log.sync import LogSync
from protocol.messages import ScanReport
from protocol.reported_scan import scan_of
from protocol.world_messages import Joined
from robot_agent.decentral.alignment import align, map_around
from robot_agent.decentral.settings import PeerSettings

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
_HELD_MOST = 200  # observations


@dataclass(frozen=True, slots=True)
class Whereabouts:
    """Where a robot is thought to be, map frame, and how well that is known [m], [rad]."""

    T_map_own: Pose2
    sigma: tuple[float, float]


def told_at_start(joined: Joined) -> Whereabouts:
    """Return where a robot was told that it starts."""
    sigma = _BOTH * joined.start_sigma_m, _BOTH * math.radians(joined.start_sigma_deg)
    return Whereabouts(joined.start or Pose2(0.0, 0.0, 0.0), sigma)


def left_at(sync: LogSync, kept: Pose2 | None, told: Whereabouts) -> Whereabouts:
    """Return where a robot was before its software was started anew.

    Args:
        sync: what is held of its earlier lives shows where it was seen last.
        kept: where it wrote down itself that it was, or None.
        told: where it was told that it started, if nothing else is known.
    """
    if kept is not None:
        return Whereabouts(kept, _KEPT_SIGMA)
    me = sync.log.me
    for author in sorted(sync.log.authors(), reverse=True):
        log = sync.log.of(author)
        if author.robot == me.robot and author != me and log.entries:
            return Whereabouts(pose_of(log.pose(log.top)), _LEFT_SIGMA)
    sigma = max(told.sigma[0], _LEFT_SIGMA[0]), max(told.sigma[1], _LEFT_SIGMA[1])
    return Whereabouts(told.T_map_own, sigma)


class Tying:
    """What a robot saw before it knows where, and what it tries to find that out.

    Args:
        settings: what a good fit is, and how often to try.

    Attributes:
        waiting: reports of what it saw.
    """

    def __init__(self, settings: PeerSettings) -> None:
        self.waiting: list[ScanReport] = []
        self._settings = settings
        self._tried = 0  # the number of the newest report at the last try
        self._next = 0.0
        self._found: Pose2 | None = None  # by the last try

    def add(self, report: ScanReport) -> None:
        """Keep what the robot saw."""
        self.waiting = [*self.waiting, report][-_HELD_MOST:]

    def due(self, now: float) -> bool:
        """Whether there is something new to try with, and the last try is some time ago."""
        seen = len(self.waiting) >= self._settings.align_scans
        news = seen and self.waiting[-1].number > self._tried
        return news and now >= self._next - _EPSILON

    def attempt(
        self,
        scans: Iterable[tuple[LaserScan, Pose2]],
        about: Whereabouts,
        resolution: float,
        now: float,
    ) -> Pose2 | None:
        """Return where the robot's own map lies, None if what it saw does not fit well anywhere.

        Two tries must find the same place: a wrong one that fits the little that is known does not
        fit any more when there is more.

        Args:
            scans: what others saw, and where, map frame.
            about: where the robot's own map is thought to lie.
            resolution: edge of a cell to match with [m].
            now: mission time [s].
        """
        settings = self._settings
        self._tried, self._next = self.waiting[-1].number, now + settings.align_period_s
        own = [(scan_of(report), report.T_odom_base) for report in self.waiting]
        around = map_around(scans, about.T_map_own @ own[-1][1], resolution)
        fit = align(around, own, about.T_map_own, about.sigma)
        if (
            fit is None
            or fit.points < settings.align_points
            or fit.share < settings.align_fit
            or fit.known < settings.align_known
            or fit.sigma > settings.align_sigma_m
        ):
            self._found = None
            return None
        before, self._found = self._found, fit.T_map_own
        if before is None or before.moved(fit.T_map_own, _AGREED[0], _AGREED[1]):
            return None
        return fit.T_map_own

    def take(self) -> list[ScanReport]:
        """Return all that waited: the robot knows where that was."""
        waiting, self.waiting = self.waiting, []
        return waiting
