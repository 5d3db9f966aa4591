"""A member's own news: collected for a while, then broadcast, entries before new poses.

New poses are told as differences to those that were told before; who lacks these asks.
"""

from __future__ import annotations

from itertools import groupby

import numpy as np

from protocol.log.earlier_poses import own_poses_at
from protocol.log.messages import ENTRIES_IN_FRAME, LogMessage, observations, pose_set
from protocol.log.observation_log import ObservationLog
from protocol.log.pose_coding import STEPS_PER_METRE, PoseTable
from protocol.log.settings import LogSyncSettings

FRAME_OVERHEAD = 60  # [bytes], about, of a frame of observations
ENTRY_OVERHEAD = 9  # [bytes], about, of an entry in it: pose, number, size


class Telling:
    """What waits to be told.

    Args:
        log: what is held; what is in the own log by now counts as told.
        settings: how long news are collected, and how large a frame may be.

    Attributes:
        due: when the news are to be told [s], or None when there are none.
        count: so many of the own entries were told.
        version: the newest own revision that was told.
    """

    def __init__(self, log: ObservationLog, settings: LogSyncSettings) -> None:
        self.due: float | None = None
        self.count = log.own.count
        self.version = log.own.version
        self._log = log
        self._settings = settings

    def news(self, now: float) -> None:
        """There is something new: tell it after a while, or at once if a frame is full."""
        if self.due is None:
            self.due = now + self._settings.batch_period_s
        own = self._log.own
        waiting = range(self.count + 1, own.count + 1)
        size = sum(len(own.entries[n].what.payload) + ENTRY_OVERHEAD for n in waiting)
        if size + FRAME_OVERHEAD >= self._settings.frame_bytes or len(waiting) >= ENTRIES_IN_FRAME:
            self.due = now

    def revised(self, now: float) -> None:
        """There are new poses: the others must not go by wrong ones for long."""
        own, wait = self._log.own, self._settings.batch_period_s
        before = own_poses_at(self._log, self.version, len(own.poses))
        if before is None or _farthest(before[1], own.poses) >= self._settings.revision_large_m:
            wait = min(wait, self._settings.revision_delay_s)
        self.due = now + wait if self.due is None else min(self.due, now + wait)

    def tell(self) -> list[LogMessage]:
        """Return the messages that tell all the news."""
        me, own = self._log.me, self._log.own
        told = [(n, own.entries[n].what) for n in range(self.count + 1, own.count + 1)]
        messages: list[LogMessage] = [
            observations(me, list(entries), me.robot, version)
            for version, entries in groupby(told, lambda each: each[1].version)
        ]
        if own.version > self.version:
            before = own_poses_at(self._log, self.version, len(own.poses))
            messages.append(pose_set(me, own.version, own.poses, me.robot, before))
        self.count, self.version, self.due = own.count, own.version, None
        return messages


def _farthest(before: PoseTable, after: PoseTable) -> float:
    """Return how far the pose that moved most has moved [m]; both (n, 3) in steps."""
    off = (after - before)[:, :2] / STEPS_PER_METRE
    return float(np.hypot(off[:, 0], off[:, 1]).max(initial=0.0))
