"""A member's own news: collected for a while, then broadcast, entries before new poses.

A broadcast that somebody misses is asked for later and takes the air twice. So news wait while
nobody is in reach, and for a moment while somebody is not that was just there: there are holes in
any radio's field, and a robot that drives is through one within a second. So the best time to tell
is when all were heard just now. News do not wait for ever: who hears nobody may still be heard.

New poses are told as differences to those that were told before; who lacks these asks.
"""

from __future__ import annotations

import numpy as np

from protocol.log.earlier_poses import own_poses_at
from protocol.log.framing import ENTRY_OVERHEAD, FRAME_OVERHEAD, fill_frame
from protocol.log.messages import ENTRIES_IN_FRAME, LogMessage, observations, pose_set
from protocol.log.observation_log import ObservationLog
from protocol.log.peers import Peers
from protocol.log.pose_coding import STEPS_PER_METRE, PoseTable
from protocol.log.settings import LogSyncSettings

_AGAIN = 0.1  # [s]; so soon it is looked again whether all are in reach
_LENIENT = 0.3  # [s]; so much longer ago all may have been heard with every second of waiting


class Telling:
    """What waits to be told.

    Args:
        log: what is held; what is in the own log by now counts as told.
        settings: how long news are collected, and how large a frame may be.
        peers: who is in reach.

    Attributes:
        count: so many of the own entries were told.
        version: the newest own revision that was told.
    """

    def __init__(self, log: ObservationLog, settings: LogSyncSettings, peers: Peers) -> None:
        self.count = log.own.count
        self.version = log.own.version
        self._log = log
        self._settings = settings
        self._peers = peers
        self._full = 0.0  # when the news have waited long enough for more [s]
        self._batch: float | None = None  # when all news may be told [s]
        self._pressing: float | None = None  # when new poses may be, without new entries [s]

    @property
    def due(self) -> float | None:
        """When something may be told next [s], None if there are no news."""
        return min((at for at in (self._batch, self._pressing) if at is not None), default=None)

    @property
    def forgotten(self) -> bool:
        """Whether the newest poses that were told are not kept any more."""
        return self.version not in (0, self._log.own.version, *self._log.past)

    def news(self, now: float) -> None:
        """There is something new: tell it after a while, or at once if a frame is full."""
        self._collect(now)
        own = self._log.own
        waiting = range(self.count + 1, own.count + 1)
        size = sum(len(own.entries[n].what.payload) + ENTRY_OVERHEAD for n in waiting)
        if size + FRAME_OVERHEAD >= self._settings.frame_bytes or len(waiting) >= ENTRIES_IN_FRAME:
            self._batch = now

    def hurry(self, now: float) -> None:
        """Somebody cannot go on without what this member saw: let what waits wait for little more.

        Args:
            now: mission time [s].
        """
        if self._batch is not None:
            self._full = min(self._full, now + self._settings.hurried_s)
            self._batch = min(self._batch, self._full)

    def revised(self, now: float) -> None:
        """There may be new poses: the others must not go by wrong ones for long."""
        own, settings = self._log.own, self._settings
        if own.version == self.version:
            return
        self._collect(now)
        before = own_poses_at(self._log, self.version, len(own.poses))
        if before is None or _farthest(before[1], own.poses) >= settings.revision_large_m:
            soon = now + settings.revision_delay_s
            self._pressing = soon if self._pressing is None else min(self._pressing, soon)

    def tell_due(self, now: float) -> list[LogMessage]:
        """Return the messages for which it is time, if those who should hear them can.

        Args:
            now: mission time [s].
        """
        settings, waited = self._settings, now - self._full
        recent = min(settings.fresh_s + _LENIENT * max(0.0, waited), settings.reached_s)
        reached = self._peers.heard_within(settings.reached_s, now)
        fresh = set(self._peers.heard_within(recent, now))
        missed = not fresh.issuperset(self._peers.heard_within(settings.missed_s, now))
        patient = missed and waited < settings.missed_s
        if self._batch is not None and now >= self._batch:
            if (reached and not patient) or waited >= settings.unheard_s:
                return self.tell()
            self._batch = now + _AGAIN
        if self._pressing is not None and now >= self._pressing:
            if reached:
                return self._new_poses()
            self._pressing = now + _AGAIN
        return []

    def tell(self) -> list[LogMessage]:
        """Return the messages that tell all the news."""
        me, own = self._log.me, self._log.own
        told = [(n, own.entries[n].what) for n in range(self.count + 1, own.count + 1)]
        messages: list[LogMessage] = []
        while told:
            frame, _ = fill_frame(told, self._settings.frame_bytes)
            messages.append(observations(me, frame, me.robot, own.version))
            told = told[len(frame) :]
        self.count, self._batch = own.count, None
        return messages + self._new_poses()

    def _new_poses(self) -> list[LogMessage]:
        """Return the message that tells the new poses, if there are any."""
        me, own, self._pressing = self._log.me, self._log.own, None
        if own.version == self.version:
            return []
        before = own_poses_at(self._log, self.version, len(own.poses))
        self.version = own.version
        return [pose_set(me, own.version, own.poses, me.robot, before)]

    def _collect(self, now: float) -> None:
        """There are news: let all news wait for more, but for no longer than a batch may."""
        settings = self._settings
        if self._batch is None:
            self._full = now + settings.batch_period_s
        self._batch = max(now, min(self._full, now + settings.quiet_s))


def _farthest(before: PoseTable, after: PoseTable) -> float:
    """Return how far the pose that moved most has moved [m]; both (n, 3) in steps."""
    off = (after - before)[:, :2] / STEPS_PER_METRE
    return float(np.hypot(off[:, 0], off[:, 1]).max(initial=0.0))
