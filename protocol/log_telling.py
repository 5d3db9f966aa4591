"""A member's own news: collected for a while, then broadcast, entries before new poses.

New poses are told as differences to those that were told before; who lacks these asks for all.
"""

from __future__ import annotations

from itertools import groupby

import numpy as np

from protocol.log_messages import ENTRIES_IN_FRAME, LogMessage, observations, pose_set
from protocol.log_settings import LogSyncSettings
from protocol.observation_log import ObservationLog
from protocol.pose_coding import PoseTable

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
        self._poses = log.own.poses  # of that version

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
        """There are new poses: others must not go by the old ones for long."""
        soon = now + self._settings.revision_delay_s
        self.due = soon if self.due is None else min(self.due, soon)

    def tell(self) -> list[LogMessage]:
        """Return the messages that tell all the news."""
        me, own = self._log.me, self._log.own
        told = [(n, own.entries[n].what) for n in range(self.count + 1, own.count + 1)]
        messages: list[LogMessage] = [
            observations(me, list(entries), me.robot, version)
            for version, entries in groupby(told, lambda each: each[1].version)
        ]
        if own.version > self.version:
            before = (self.version, self._before(len(own.poses)))
            messages.append(pose_set(me, own.version, own.poses, me.robot, before))
            self._poses = own.poses
        self.count, self.version, self.due = own.count, own.version, None
        return messages

    def _before(self, count: int) -> PoseTable:
        """Return the poses of the first entries, (count, 3), as they were told up to now."""
        entries = self._log.own.entries
        first = [entries[n].what.pose for n in range(len(self._poses) + 1, count + 1)]
        return np.concatenate((self._poses[:count], np.array(first, np.int32).reshape(-1, 3)))
