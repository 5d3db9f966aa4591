from __future__ import annotations

import numpy as np
import pytest

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


def test_what_waited_for_long_goes_in_several_frames() -> None:
    """More than one frame can hold, as nobody was in reach."""
    log = ObservationLog("ann")
    telling = Telling(log, LogSyncSettings(frame_bytes=1000), Peers(10.0, 70.0))
    sizes = [1500] + 20 * [185] + 600 * [0]
    for size in sizes:
        log.append(bytes(size), (1, 2, 3))
        telling.news(5.0)
    told = telling.tell()
    frames = [message for message in told if isinstance(message, Observations)]
    assert len(frames) == len(told)
    numbers = [number for frame in frames for number in frame.numbers]
    assert numbers == list(range(1, len(sizes) + 1))
    assert max(len(frame.numbers) for frame in frames) <= 256
    assert [len(frame.data) for frame in frames[:3]] == [1500, 740, 740]
    assert telling.due is None


def test_new_poses_go_last_and_are_of_what_was_told_before() -> None:
    log = ObservationLog("ann")
    telling = Telling(log, LogSyncSettings(), Peers(10.0, 70.0))
    log.append(b"one", (1, 2, 3))
    telling.news(0.0)
    telling.tell()
    log.append(b"two", (1, 2, 3))
    log.revise(np.ones((2, 3), dtype=np.int32), telling.count)
    telling.news(0.0)
    two, poses = telling.tell()
    assert isinstance(two, Observations) and isinstance(poses, PoseSet)
    assert (two.numbers, two.version, two.poses.tolist()) == ((2,), 1, [[1, 1, 1]])
    assert (poses.version, poses.count, telling.version) == (1, 1, 1)


def test_what_was_restored_counts_as_told() -> None:
    log = ObservationLog("ann")
    log.append(b"one", (1, 2, 3))
    log.revise(np.ones((1, 3), dtype=np.int32), log.own.count)
    telling = Telling(log, LogSyncSettings(), Peers(10.0, 70.0))
    assert (telling.count, telling.version, telling.tell()) == (1, 1, [])


def waiting(now: float = 0.0) -> tuple[Telling, Peers, ObservationLog]:
    """Return one that told an entry, and has had one more since `now` [s], to be told 4 s later."""
    log, peers = ObservationLog("ann"), Peers(10.0, 70.0)
    telling = Telling(log, LogSyncSettings(batch_period_s=4.0), peers)
    log.append(b"one", (1, 2, 3))
    telling.news(now)
    telling.tell()
    log.append(b"two", (1, 2, 3))
    telling.news(now)
    return telling, peers, log


def test_news_wait_for_somebody_in_reach_but_not_for_ever() -> None:
    telling, peers, _ = waiting()
    assert telling.tell_due(4.0) == []
    assert telling.due == 4.1
    assert telling.tell_due(303.0) == []
    peers.hear("ben", 300.0)
    assert telling.tell_due(303.5) == []
    assert len(telling.tell_due(304.0)) == 1
    telling, peers, _ = waiting()
    peers.hear("ben", 50.0)
    assert len(telling.tell_due(51.5)) == 1


def test_news_wait_a_while_for_one_that_was_just_in_reach() -> None:
    telling, peers, _ = waiting(10.0)
    peers.hear("cat", 12.0)
    peers.hear("ben", 14.0)
    assert telling.tell_due(14.0) == []
    peers.hear("cat", 30.0)
    peers.hear("ben", 33.9)
    assert telling.tell_due(33.9) == []
    assert telling.due == 34.0
    assert telling.tell_due(34.0) != []  # 20 s were a while


def test_news_go_as_soon_as_all_are_back_and_do_not_wait_for_who_is_gone() -> None:
    telling, peers, _ = waiting(10.0)
    peers.hear("cat", 12.0)
    peers.hear("ben", 14.0)
    assert telling.tell_due(14.0) == []
    peers.hear("ben", 14.4)
    peers.hear("cat", 14.5)
    assert telling.tell_due(14.5) != []
    telling, peers, _ = waiting(40.0)
    peers.hear("cat", 12.0)
    peers.hear("ben", 44.0)
    assert telling.tell_due(44.0) != []


def test_the_longer_news_have_waited_the_longer_ago_somebody_may_have_been_heard() -> None:
    """Two that say every two seconds that they are there, one second apart: never both just now."""
    telling, peers, _ = waiting(10.0)
    told = None
    for now in np.arange(9.0, 20.0, 0.1).round(1).tolist():
        if now % 1.0 == 0.0:
            peers.hear("ben" if now % 2.0 else "cat", now)
        if now >= 14.0 and told is None and telling.tell_due(now):
            told = now
    assert told == 17.0  # 0.3 s and 0.3 times as long as they waited, three seconds


def test_news_that_stop_coming_wait_for_no_more() -> None:
    log = ObservationLog("ann")
    settings = LogSyncSettings(batch_period_s=15.0, quiet_s=5.0)
    telling = Telling(log, settings, Peers(10.0, 70.0))
    for now, due in ((1.0, 6.0), (4.0, 9.0), (12.0, 16.0)):
        log.append(b"one", (1, 2, 3))
        telling.news(now)
        assert telling.due == due


def test_news_that_somebody_needs_wait_for_little_more() -> None:
    log = ObservationLog("ann")
    telling = Telling(log, LogSyncSettings(batch_period_s=20.0, hurried_s=2.0), Peers(10.0, 70.0))
    telling.hurry(0.0)
    assert telling.due is None
    log.append(b"one", (1, 2, 3))
    telling.news(1.0)
    assert telling.due == 6.0  # quiet for so long
    for now in (1.5, 2.5):
        telling.hurry(now)
        assert telling.due == 3.5
    telling.news(3.4)
    assert telling.due == 3.5


def test_a_large_correction_waits_for_nobody_but_the_first_in_reach() -> None:
    telling, peers, log = waiting(10.0)
    log.revise(np.full((2, 3), 80, dtype=np.int32), telling.count)
    telling.revised(10.0)
    telling.revised(10.1)
    assert telling.due == 10.2
    assert telling.tell_due(10.2) == []
    assert telling.due == pytest.approx(10.3)
    peers.hear("cat", 5.0)
    peers.hear("ben", 10.3)
    (poses,) = telling.tell_due(10.7)
    assert isinstance(poses, PoseSet) and poses.count == 1
    assert telling.due == 14.0  # the second entry has time
    peers.hear("ben", 13.9)
    assert telling.tell_due(14.0) == []


def test_new_poses_of_what_nobody_heard_of_are_no_news() -> None:
    log = ObservationLog("ann")
    telling = Telling(log, LogSyncSettings(), Peers(10.0, 70.0))
    log.append(b"one", (1, 2, 3))
    log.revise(np.full((1, 3), 80, dtype=np.int32), telling.count)
    telling.revised(1.0)
    assert telling.due is None


def test_it_knows_when_the_poses_it_told_are_not_kept_any_more() -> None:
    telling, _, log = waiting()
    telling.tell()
    assert not telling.forgotten
    poses = np.ones((2, 3), dtype=np.int32)
    log.revise(poses, telling.count)
    telling.tell()
    for _ in range(32):
        log.revise(poses, telling.count)
    assert not telling.forgotten
    log.revise(poses, telling.count)
    assert telling.forgotten
