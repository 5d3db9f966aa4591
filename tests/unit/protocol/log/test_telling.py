from __future__ import annotations

import numpy as np

from protocol.log.messages import Observations, PoseSet
from protocol.log.observation_log import ObservationLog
from protocol.log.settings import LogSyncSettings
from protocol.log.telling import Telling


def test_news_are_collected_for_a_while() -> None:
    log = ObservationLog("ann")
    telling = Telling(log, LogSyncSettings(batch_period_s=2.0))
    assert telling.due is None
    log.append(b"one", (1, 2, 3))
    telling.news(5.0)
    log.append(b"two", (1, 2, 3))
    telling.news(6.0)
    assert telling.due == 7.0
    (message,) = telling.tell()
    assert isinstance(message, Observations)
    assert message.numbers == (1, 2)
    assert (telling.due, telling.count) == (None, 2)
    assert telling.tell() == []


def test_a_full_frame_does_not_wait() -> None:
    log = ObservationLog("ann")
    telling = Telling(log, LogSyncSettings(frame_bytes=1000))
    for _ in range(5):
        log.append(bytes(185), (1, 2, 3))
        telling.news(5.0)
    assert telling.due == 5.0
    telling.tell()
    for _ in range(256):
        log.append(b"", (1, 2, 3))
    telling.news(9.0)
    assert telling.due == 9.0


def test_versions_are_told_apart_and_new_poses_last() -> None:
    log = ObservationLog("ann")
    telling = Telling(log, LogSyncSettings())
    log.append(b"one", (1, 2, 3))
    log.revise(np.ones((1, 3), dtype=np.int32))
    log.append(b"two", (1, 2, 3))
    log.revise(np.ones((2, 3), dtype=np.int32))
    telling.news(0.0)
    one, two, poses = telling.tell()
    assert isinstance(one, Observations) and isinstance(two, Observations)
    assert (one.numbers, one.version, two.numbers, two.version) == ((1,), 0, (2,), 1)
    assert isinstance(poses, PoseSet)
    assert (poses.version, poses.count, telling.version) == (2, 2, 2)


def test_what_was_restored_counts_as_told() -> None:
    log = ObservationLog("ann")
    log.append(b"one", (1, 2, 3))
    log.revise(np.ones((1, 3), dtype=np.int32))
    telling = Telling(log, LogSyncSettings())
    assert (telling.count, telling.version, telling.tell()) == (1, 1, [])
