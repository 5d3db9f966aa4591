from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.log.author_log import Author, Entry, PoseRevision
from protocol.log.observation_log import Changes, ObservationLog

ANN = Author("ann", 0)
BEN = Author("ben", 2)


def entry(number: int, version: int = 0) -> Entry:
    return Entry(b"scan %d" % number, (number, 2 * number, 3 * number), version)


def revision(version: int, count: int) -> PoseRevision:
    rows = [[version * 1000 + k, version, k] for k in range(1, count + 1)]
    return PoseRevision(version, np.array(rows, dtype=np.int32).reshape(-1, 3))


def test_own_entries_are_numbered_from_one_and_told_in_the_newest_version() -> None:
    log = ObservationLog("ann")
    assert log.append(b"one", (1, 2, 3)) == 1
    log.revise(np.array([[4, 5, 6]], dtype=np.int32), told=1)
    assert log.own.version == 1
    assert log.append(b"two", (7, 8, 9)) == 2
    assert log.own.entries[2].what == Entry(b"two", (7, 8, 9), 1)
    assert (log.own.pose(1), log.own.pose(2)) == ((4, 5, 6), (7, 8, 9))
    assert log.own.bytes == 6


def test_entries_that_nobody_heard_of_get_the_new_pose_as_their_first() -> None:
    log = ObservationLog("ann")
    for x in (1, 2, 3):
        log.append(b"%d" % x, (x, 0, 0))
    log.take_changes()
    log.revise(np.array([[7, 0, 0], [8, 0, 0], [9, 0, 0]], dtype=np.int32), told=1)
    assert log.own.poses.tolist() == [[7, 0, 0]]
    assert log.own.entries[3].what == Entry(b"3", (9, 0, 0), 1)
    assert [log.own.pose(number)[0] for number in (1, 2, 3)] == [7, 8, 9]
    changes = log.take_changes()
    assert (changes.entries, changes.replaced, changes.repositioned) == ((), (), (ANN,))
    other = ObservationLog("ben")
    for number, told in log.own.entries.items():
        other.put(ANN, number, told.what, "ann")
    other.put_revision(ANN, log.own.revision, "ann")
    assert other.digest() == log.digest()
    assert other.of(ANN).checksum(3) == log.own.checksum(3)


def test_without_anything_told_there_is_no_revision() -> None:
    log = ObservationLog("ann")
    log.append(b"one", (1, 0, 0))
    log.revise(np.array([[7, 0, 0]], dtype=np.int32), told=0)
    assert (log.own.version, log.own.pose(1)) == (0, (7, 0, 0))


def test_a_revision_has_a_pose_for_every_entry() -> None:
    log = ObservationLog("ann")
    with pytest.raises(ValueError, match="0 entries"):
        log.revise(np.zeros((1, 3), dtype=np.int32), log.own.count)


def test_gaps_are_known_and_filled() -> None:
    log = ObservationLog("ben", 2)
    for number in (2, 5, 6, 1):
        log.put(ANN, number, entry(number), "ann")
    held = log.of(ANN)
    assert (held.count, held.top, held.beyond()) == (2, 6, [(5, 6)])
    assert list(held.missing(8)) == [3, 4, 7, 8]
    for number in (4, 3):
        log.put(ANN, number, entry(number), "ann")
    assert (held.count, held.top, held.beyond()) == (6, 6, [])
    assert log.authors() == [ANN, BEN]


def test_what_changed_is_told_once() -> None:
    log = ObservationLog("ben", 2)
    log.put(ANN, 3, entry(3), "eve")
    log.put_revision(ANN, revision(1, 2), "ann")
    assert log.take_changes() == Changes(((ANN, 3),), (), (ANN,))
    assert log.take_changes() == Changes((), (), ())
    log.put(ANN, 3, entry(4), "ann")
    log.put(ANN, 1, entry(1), "eve")
    log.put(ANN, 1, entry(2), "ann")
    assert log.take_changes() == Changes(((ANN, 1),), ((ANN, 3),), ())


def test_what_is_forgotten_was_never_there() -> None:
    log = ObservationLog("ben", 2)
    log.put(ANN, 1, entry(1), "eve")
    log.take_changes()
    log.put(ANN, 1, entry(2), "cid")
    log.put(ANN, 2, entry(2), "eve")
    log.put_revision(ANN, revision(1, 2), "eve")
    log.forget(ANN)
    assert log.take_changes() == Changes((), (), (), (ANN,))
    assert log.authors() == [BEN]


def test_an_entry_told_too_late_in_an_old_version_has_its_own_pose() -> None:
    log = ObservationLog("ben", 2)
    log.put_revision(ANN, revision(4, 2), "ann")
    log.put(ANN, 3, entry(3, version=1), "ann")
    assert log.of(ANN).pose(3) == (3, 6, 9)


def test_checksums_tell_logs_apart_and_follow_replacements() -> None:
    one, other = ObservationLog("x"), ObservationLog("y")
    for number in range(1, 6):
        one.put(ANN, number, entry(number), "ann")
        other.put(ANN, number, entry(9 if number == 3 else number), "eve")
    equal = [one.of(ANN).checksum(k) == other.of(ANN).checksum(k) for k in range(6)]
    assert equal == [True, True, True, False, False, False]
    other.put(ANN, 3, entry(3), "ann")
    assert other.of(ANN).count == 5
    assert one.of(ANN).checksum(5) == other.of(ANN).checksum(5)
    other.put_revision(ANN, revision(1, 5), "ann")
    assert one.of(ANN).checksum(5) != other.of(ANN).checksum(5)


def test_an_author_may_be_vouched_for() -> None:
    log = ObservationLog("x")
    log.put(ANN, 1, entry(1), "eve")
    log.of(ANN).vouch(1, "ann")
    assert log.of(ANN).entries[1].by == "ann"
    assert log.of(ANN).compare(1, entry(1)) == "same"
    assert log.of(ANN).compare(1, entry(2)) == "different"
    assert log.of(ANN).compare(2, entry(2)) == "new"


def test_nothing_is_held_of_a_stranger() -> None:
    log = ObservationLog("x")
    assert log.of(BEN).count == 0
    assert log.authors() == [Author("x", 0)]


TOLD = [(ANN, n) for n in range(1, 8)] + [(BEN, n) for n in range(1, 5)]


@given(st.permutations(TOLD), st.permutations([1, 2, 3]), st.data())
@settings(deadline=None, max_examples=50)
def test_the_map_depends_on_no_order(
    order: list[tuple[Author, int]], versions: list[int], data: st.DataObject
) -> None:
    """Any order, any doubling, revisions anywhere between: newest ones stay."""
    plain, mixed = ObservationLog("x"), ObservationLog("x")
    for author, number in TOLD:
        plain.put(author, number, entry(number), author.robot)
    plain.put_revision(ANN, revision(3, 5), "ann")
    for author, number in order + order[: data.draw(st.integers(0, 5))]:
        mixed.put(author, number, entry(number), "anyone")
    for version in versions:
        if version > mixed.of(ANN).version:
            mixed.put_revision(ANN, revision(version, version + 2), "ann")
    assert mixed.digest() == plain.digest()
    assert mixed.digest([BEN]) == plain.digest([BEN]) != plain.digest()
    mixed.put(BEN, 2, entry(5), "ben")
    assert mixed.digest() != plain.digest()
    assert mixed.digest([ANN]) == plain.digest([ANN])


def test_the_digest_counts_poses_lives_and_nothing_that_is_empty() -> None:
    one, other = ObservationLog("x"), ObservationLog("y", 7)
    assert one.digest() == other.digest()
    one.put(ANN, 1, entry(1), "ann")
    other.put(Author("ann", 1), 1, entry(1), "ann")
    assert one.digest() != other.digest()
    before = one.digest()
    one.put_revision(ANN, revision(1, 1), "ann")
    assert one.digest() != before
