"""Readings that a log holds twice."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

from expedition.recordings.recording import Reading

REMEMBERED = 100
"""A copy comes at most so many readings after the original."""


def repeated(readings: Iterable[Reading]) -> list[bool]:
    """Return which readings have the ranges and the odometry of one not long before.

    Stamps are not compared: a copy may have a new one. Real lasers are noisy enough that two
    sweeps from the same place differ (in both logs of the tests, all of them do).
    """
    recent: deque[tuple[bytes, tuple[float, float, float]]] = deque()
    known: set[tuple[bytes, tuple[float, float, float]]] = set()
    copies = []
    for reading in readings:
        key = (reading.scan.ranges.tobytes(), reading.T_wheel_base.as_tuple())
        copies.append(key in known)
        if key not in known:
            known.add(key)
            recent.append(key)
            if len(recent) > REMEMBERED:
                known.remove(recent.popleft())
    return copies
