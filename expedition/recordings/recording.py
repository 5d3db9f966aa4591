"""What a recorded log holds, whatever format it came in."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mapping.geometry import Floats, Pose2
from mapping.scan import LaserScan


class RecordingError(Exception):
    """A file that is no recording, with what to do about it in one line."""


@dataclass(frozen=True, slots=True)
class Reading:
    """One sweep, and where the wheels alone put the robot when it was taken.

    Attributes:
        scan: the sweep; its stamp [s] is the log's own.
        T_wheel_base: raw odometry, in a frame of its own.
    """

    scan: LaserScan
    T_wheel_base: Pose2


@dataclass(frozen=True, slots=True)
class Skipped:
    """A part of a log that could not be used.

    Attributes:
        line: its number, from 1; for formats without lines, of the message.
        reason: why, in a few words.
    """

    line: int
    reason: str


@dataclass(frozen=True, slots=True)
class Recording:
    """A robot's log.

    Attributes:
        readings: in the order of the file, which is the order in which things happened even where
            stamps jitter.
        skipped: what could not be used.
    """

    readings: list[Reading]
    skipped: list[Skipped] = field(default_factory=list)

    @property
    def stamps(self) -> Floats:
        """The readings' stamps, (n,) [s]."""
        return np.array([reading.scan.stamp for reading in self.readings])
