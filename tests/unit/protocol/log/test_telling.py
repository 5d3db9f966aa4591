from __future__ import annotations

import numpy as np

from protocol.log.messages import Observations, PoseSet
from protocol.log.observation_log import ObservationLog
from protocol.log.peers import Peers
from protocol.log.settings import LogSyncSettings
from protocol.log.telling import Telling


def test_news_are_collected_for_a_while() -> None:
    log = ObservationLog("ann")
    telling = Telling(log, LogSyncSettings(batch_period_s=2.0), Peers(10.0, 70.0))
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
    telling = Telling(log, LogSyncSettings(frame_bytes=1000), Peers(10.0, 70.0))
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
    telling = Telling(log, LogSyncSettings(), Peers(10.0, 70.0))
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
    telling = Telling(log, LogSyncSettings(), Peers(10.0, 70.0))
    assert (telling.count, telling.version, telling.tell()) == (1, 1, [])


def waiting(now: float = 0.0) -> tuple[Telling, Peers, ObservationLog]:
    """Return one with news since `now` [s] that may be told 4 s later."""
    log, peers = ObservationLog("ann"), Peers(10.0, 70.0)
    telling = Telling(log, LogSyncSettings(batch_period_s=4.0), peers)
    log.append(b"one", (1, 2, 3))
    telling.news(now)
    return telling, peers, log


def test_news_wait_for_somebody_in_reach_but_not_for_ever() -> None:
    telling, peers, _ = waiting()
    assert not telling.ready(4.0)
    assert telling.due == 4.5
    assert not telling.ready(303.0)
    assert telling.ready(304.0)
    peers.hear("ben", 50.0)
    assert telling.ready(51.5)
    assert not telling.ready(51.6)


def test_news_wait_a_while_for_one_that_was_just_in_reach() -> None:
    telling, peers, _ = waiting(10.0)
    peers.hear("cat", 12.0)
    peers.hear("ben", 14.0)
    assert not telling.ready(14.0)
    peers.hear("cat", 14.5)
    assert telling.ready(14.5)
    peers.hear("ben", 33.9)
    assert not telling.ready(33.9)
    assert telling.ready(34.0)  # 20 s were a while
    peers.hear("ben", 40.0)
    assert telling.ready(40.0)  # cat is not waited for any more


def test_news_that_are_complete_wait_for_no_more() -> None:
    telling, peers, _ = waiting()
    telling.complete(1.0)
    assert telling.due == 1.0
    assert not telling.ready(1.0)
    telling.complete(1.2)
    assert telling.due == 1.5
    peers.hear("ben", 1.4)
    assert telling.ready(1.5)
    telling.tell()
    telling.complete(2.0)
    assert telling.due is None


def test_a_large_correction_waits_for_nobody_but_the_first_in_reach() -> None:
    telling, peers, log = waiting(10.0)
    log.revise(np.full((1, 3), 80, dtype=np.int32))
    telling.revised(10.0)
    assert telling.due == 10.2
    assert not telling.ready(10.2)
    peers.hear("cat", 5.0)
    peers.hear("ben", 10.3)
    assert telling.ready(10.3)
    telling.tell()
    log.append(b"two", (1, 2, 3))
    telling.news(11.0)
    peers.hear("ben", 15.0)
    assert not telling.ready(15.0)


def test_it_knows_when_the_poses_it_told_are_not_kept_any_more() -> None:
    telling, _, log = waiting()
    telling.tell()
    assert not telling.forgotten
    log.revise(np.ones((1, 3), dtype=np.int32))
    telling.tell()
    for _ in range(32):
        log.revise(np.ones((1, 3), dtype=np.int32))
    assert not telling.forgotten
    log.revise(np.ones((1, 3), dtype=np.int32))
    assert telling.forgotten
