from __future__ import annotations

import numpy as np
import pytest

from protocol.log.answering import Answering
from protocol.log.author_log import Author
from protocol.log.messages import LogWant, Observations, PoseSet
from protocol.log.observation_log import ObservationLog
from protocol.log.settings import LogSyncSettings

ME = Author("me", 0)


def filled(count: int, size: int = 130) -> ObservationLog:
    log = ObservationLog("me")
    for _ in range(count):
        log.append(bytes(size), (1, 2, 3))
    return log


def want(*ranges: tuple[int, int], version: int = 0) -> LogWant:
    asked = tuple((0, first, last) for first, last in ranges)
    return LogWant(authors=("me",), lives=(0,), versions=(version,), ranges=asked)


def drain(answering: Answering) -> list[tuple[float, str, list[int]]]:
    """Answer until nothing is due; return when and to whom which numbers went."""
    sent = []
    while answering.due is not None:
        now = answering.due
        for to, message in answering.answer(now):
            numbers = list(message.numbers) if isinstance(message, Observations) else [0]
            sent.append((now, to, numbers))
    return sent


def test_one_is_answered_alone_and_several_at_once() -> None:
    answering = Answering(filled(20), LogSyncSettings(answer_delay_s=0.5))
    answering.take("ann", want((1, 4), (9, 9)), 1.0)
    answering.take("ben", want((3, 5)), 1.4)
    assert answering.due == 1.5
    sent = drain(answering)
    assert [(to, numbers) for _, to, numbers in sent] == [
        ("ann", [1, 2, 9]),
        ("*", [3, 4]),
        ("ben", [5]),
    ]
    assert [at for at, _, _ in sent] == pytest.approx([1.5, 1.5, 1.9], abs=0.02)
    assert answering.wanted == {}


def test_only_what_is_held_is_answered() -> None:
    answering = Answering(filled(3), LogSyncSettings())
    answering.take("ann", want((7, 9), version=1), 1.0)
    assert (answering.wanted, answering.due) == ({}, None)
    answering.take("ann", LogWant(authors=("x",), lives=(0,), versions=(0,), ranges=()), 1.0)
    assert answering.due is None


def test_frames_are_limited_and_so_is_the_rate() -> None:
    settings = LogSyncSettings(frame_bytes=1000, answer_bytes_s=2000.0, request_entries=100)
    answering = Answering(filled(100), settings)
    answering.take("ann", want((1, 100)), 0.0)
    sent = drain(answering)
    assert [n for _, _, numbers in sent for n in numbers] == list(range(1, 101))
    assert all(len(numbers) <= 6 for _, _, numbers in sent)
    assert sent[-1][0] > (100 * 147 + len(sent) * 110 - 3000) / 2000.0


def test_peers_take_turns() -> None:
    answering = Answering(filled(60), LogSyncSettings(frame_bytes=1000))
    answering.take("ann", want((1, 30)), 0.0)
    answering.take("ben", want((31, 60)), 0.0)
    order = [to for _, to, _ in drain(answering)]
    assert order == ["ann", "ben"] * 5


def test_what_another_told_all_need_not_be_told_again() -> None:
    answering = Answering(filled(9), LogSyncSettings())
    answering.take("ann", want((1, 3)), 0.0)
    answering.take("ben", want((2, 2)), 0.0)
    answering.overheard(ME, (1, 2))
    assert [(to, n) for _, to, n in drain(answering)] == [("ann", [3])]


def test_versions_go_in_frames_of_their_own() -> None:
    log = filled(2)
    log.revise(np.ones((2, 3), dtype=np.int32), log.own.count)
    log.append(b"", (0, 0, 0))
    answering = Answering(log, LogSyncSettings())
    answering.take("ann", want((1, 3), version=1), 0.0)
    assert answering.due is not None
    messages = [message for _, message in answering.answer(answering.due)]
    assert isinstance(messages[-1], PoseSet) and messages[-1].count == 2
    assert [m.version for m in messages[:-1] if isinstance(m, Observations)] == [0, 1]


def test_poses_that_were_dropped_are_not_told() -> None:
    log = filled(1)
    log.revise(np.ones((1, 3), dtype=np.int32), log.own.count)
    answering = Answering(log, LogSyncSettings())
    answering.take("ann", want((1, 1), version=1), 0.0)
    log.put_revision(ME, None, "")
    assert [n for _, _, n in drain(answering)] == [[1]]


def test_the_books_stay_small() -> None:
    answering = Answering(filled(2000, size=1), LogSyncSettings(request_entries=10))
    for _ in range(50):
        answering.take("ann", want(*[(1, 2**31 - 1)] * 256), 0.0)
        answering.take("ann", want(*[(k, k) for k in range(1, 257)]), 0.0)
    assert len(answering.wanted["ann"]) <= 21
    answering.forget("ann")
    assert answering.wanted == {}
