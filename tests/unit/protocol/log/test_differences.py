"""New poses told as differences to those before: who lacks these asks."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.log.answering import Answering
from protocol.log.asking import _Asked
from protocol.log.author_log import Author
from protocol.log.messages import LogWant, PoseSet, pose_set
from protocol.log.observation_log import ObservationLog
from protocol.log.peers import Peers
from protocol.log.pose_coding import PoseTable
from protocol.log.settings import LogSyncSettings
from protocol.log.sync import LogSync
from protocol.log.telling import Telling

ANN = Author("ann", 0)


def table(*xs: int) -> PoseTable:
    return np.array([[x, 0, 0] for x in xs], dtype=np.int32)


def member(name: str, log: ObservationLog | None = None) -> LogSync:
    return LogSync(log or ObservationLog(name), LogSyncSettings(), np.random.default_rng(0))


def driven(entries: int = 2) -> LogSync:
    """A member that made some observations and told them."""
    ann = member("ann")
    for number in range(entries):
        ann.append(b"seen", (number, 0, 0), 0.0)
    return ann


def carry(source: LogSync, to: LogSync, now: float, most: int = 99) -> list[PoseSet]:
    """Let a member tell; return the poses among it. Only the first messages arrive."""
    sent = source.telling.tell()
    for message in sent[:most]:
        to.handle(source.log.me.robot, message, now)
    return [message for message in sent if isinstance(message, PoseSet)]


def test_who_has_the_poses_before_needs_only_the_differences() -> None:
    ann, ben = driven(), member("ben")
    carry(ann, ben, 0.0)
    ann.revise(table(5, 6), 0.0)
    (first,) = carry(ann, ben, 0.0)
    assert (first.version, first.back) == (1, 1)
    ann.append(b"more", (2, 0, 0), 1.0)
    carry(ann, ben, 1.0)
    ann.revise(table(5, 7, 9), 1.0)
    (second,) = carry(ann, ben, 1.0)
    assert (second.version, second.back) == (2, 1)
    assert ben.log.of(ANN).poses.tolist() == table(5, 7, 9).tolist()
    assert ben.log.of(ANN).revision_by == "ann"
    assert ben.log.digest() == ann.log.digest()


def test_who_lacks_what_differences_build_on_asks_and_holds_the_old() -> None:
    ann, ben = driven(), member("ben")
    carry(ann, ben, 0.0)
    ann.revise(table(5, 6), 0.0)
    carry(ann, ben, 0.0, most=0)
    ann.revise(table(5, 7), 1.0)
    carry(ann, ben, 1.0)
    assert ben.log.of(ANN).version == 0
    assert ben.asking.lacking and ben.standing.book.counts == {}
    assert ben.asking.due is not None
    sent = [out.message for out in ben.tick(ben.asking.due)]
    (request,) = [message for message in sent if isinstance(message, LogWant)]
    assert (request.versions, request.bases) == ((1,), (1,))
    ann.handle("ben", request, 8.0)
    ((_, answer),) = [out for out in ann.tick(9.0) if isinstance(out.message, PoseSet)]
    assert isinstance(answer, PoseSet) and (answer.version, answer.back) == (2, 2)
    ben.handle("ann", answer, 9.0)
    assert ben.log.digest() == ann.log.digest()


def test_what_was_forged_before_cannot_be_built_on() -> None:
    ann, ben = driven(), member("ben")
    carry(ann, ben, 0.0)
    ann.revise(table(5, 6), 0.0)
    ann.telling.tell()  # lost
    ben.handle("eve", pose_set(ANN, 1, table(90, 91), "eve"), 0.0)
    ann.revise(table(5, 7), 1.0)
    carry(ann, ben, 1.0)
    assert ben.log.of(ANN).version < 2
    ben.handle("ann", pose_set(ANN, 2, ann.log.own.poses, "ann"), 2.0)
    assert ben.log.digest() == ann.log.digest()


@pytest.mark.parametrize("teller", ["eve", "ann"])
def test_differences_that_nobody_can_tell_are_a_fault(teller: str) -> None:
    ben = member("ben")
    told = pose_set(ANN, 3, table(1), "", (2, table(0)))
    if teller == "ann":
        told = told.model_copy(update={"back": 4})
    ben.handle(teller, told, 0.0)
    assert list(ben.standing.book.counts) == [
        (teller, "a difference of poses that its sender cannot tell")
    ]


def test_too_many_poses_are_a_fault_before_anything_is_unpacked() -> None:
    ben = member("ben")
    ben.handle("ann", pose_set(ANN, 1, table(1), "").model_copy(update={"count": 10**9}), 0.0)
    assert list(ben.standing.book.counts) == [("ann", "too many poses")]


def want(base: int) -> LogWant:
    return LogWant(authors=("ann",), lives=(0,), versions=(1,), bases=(base,))


def test_all_that_ask_must_hold_the_same_for_differences() -> None:
    log = driven().log
    log.revise(table(5, 6), log.own.count)
    log.revise(table(5, 7), log.own.count)
    for bases, back in (((1, 1), 2), ((2, 2), 1), ((1, 2), 0), ((0, 0), 0), ((9, 9), 0)):
        answering = Answering(log, LogSyncSettings())
        for peer, base in zip(("ben", "cat"), bases, strict=True):
            answering.take(peer, want(base), 0.0)
        ((to, message),) = answering.answer(1.0)
        assert isinstance(message, PoseSet)
        assert (to, message.back) == ("*", back)


def test_large_corrections_do_not_wait() -> None:
    log = driven().log
    settings = LogSyncSettings(batch_period_s=4.0, revision_delay_s=0.2)
    telling = Telling(log, settings, Peers(10.0, 70.0))
    log.revise(table(0, 20), log.own.count)
    telling.revised(1.0)
    assert telling.due == 5.0
    log.revise(table(0, 80), log.own.count)
    telling.revised(2.0)
    assert telling.due == 2.2
    telling.tell()
    log.past.clear()
    log.revise(table(0, 81), log.own.count)
    log.past.clear()
    telling.revised(3.0)
    assert telling.due == 3.2
    (message,) = telling.tell()
    assert isinstance(message, PoseSet) and message.back == 0


@given(st.lists(st.tuples(st.booleans(), st.integers(-50, 50), st.booleans()), max_size=25))
@settings(deadline=None)
def test_what_is_held_is_always_some_revision_of_its_author(
    steps: list[tuple[bool, int, bool]],
) -> None:
    """Whatever is lost: the poses held are those of the version held, bit by bit."""
    ann, ben = driven(), member("ben")
    carry(ann, ben, 0.0)
    told: dict[int, list[list[int]]] = {0: []}
    for step, (observes, x, arrives) in enumerate(steps):
        if observes:
            ann.append(b"more", (x, x, 0), float(step))
        own = ann.log.own
        rows = [own.pose(number) for number in range(1, own.count + 1)]
        poses = np.array(rows, dtype=np.int32) + np.array([x, 0, 0], dtype=np.int32)
        ann.revise(poses, float(step))
        told[ann.log.own.version] = ann.log.own.poses.tolist()
        carry(ann, ben, float(step), most=99 if arrives else 0)
        held = ben.log.of(ANN)
        assert held.poses.tolist() == told[held.version]
        for number, (entry, _) in held.entries.items():
            assert entry == ann.log.own.entries[number].what  # once told, it never changes


def test_who_lacks_entries_too_gets_them_first_and_then_the_differences() -> None:
    ann, ben = driven(), member("ben")
    carry(ann, ben, 0.0)
    ann.append(b"more", (3, 0, 0), 1.0)
    ann.revise(table(5, 6, 7), 1.0)
    carry(ann, ben, 1.0, most=0)
    ann.append(b"more", (4, 0, 0), 2.0)
    ann.revise(table(5, 6, 7, 9), 2.0)
    carry(ann, ben, 2.0)
    assert ben.asking.due is not None
    asked = [out.message for out in ben.tick(ben.asking.due)]
    (request,) = [message for message in asked if isinstance(message, LogWant)]
    assert (request.ranges, request.bases) == (((0, 3, 3),), (1,))
    ann.handle("ben", request, 8.0)
    for _, answer in ann.tick(9.0):
        ben.handle("ann", answer, 9.0)
    assert ben.log.digest() == ann.log.digest()
    # Entries that somebody else was asked for may come later than the answer: then all is wanted.
    other = member("cat")
    carry(ann, other, 3.0)
    other.asking.asked[ANN, 2] = _Asked(1, 99.0)
    other.asking.asked[ANN, 0] = _Asked(1, 99.0)
    assert other.asking._base(ANN, [(ANN, 0)]) == 0
