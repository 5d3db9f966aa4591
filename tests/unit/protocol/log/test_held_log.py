from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry import Pose2
from protocol.log.author_log import Author, Entry, PoseRevision
from protocol.log.held_log import HeldLog
from protocol.log.observation_log import ObservationLog

ANN, BOB = Author("ann", 0), Author("bob", 1)


def table(*rows: tuple[int, int, int]) -> np.ndarray:
    return np.array(rows, dtype=np.int32).reshape(-1, 3)


def test_entries_are_told_as_bytes_and_poses() -> None:
    log = ObservationLog("me")
    log.put(ANN, 1, Entry(b"one", (1000, 0, 0), 0), "bob")
    log.put(ANN, 3, Entry(b"three", (3000, 0, 0), 0), "ann")
    held = HeldLog(log)
    assert held.payload(("ann", 0), 3) == b"three"
    assert held.told_by(("ann", 0), 1) == "bob"
    assert held.poses(("ann", 0)) == {1: Pose2(1.0, 0.0, 0.0), 3: Pose2(3.0, 0.0, 0.0)}
    assert held.poses(("nobody", 0)) == {}


def test_the_newest_poses_count_but_where_it_was_told_first_is_remembered() -> None:
    log = ObservationLog("me")
    log.put(ANN, 1, Entry(b"one", (1000, 0, 0), 0), "ann")
    log.put_revision(ANN, PoseRevision(1, table((1500, -500, 10_000))), "ann")
    held = HeldLog(log)
    assert held.told_at(("ann", 0), 1) == Pose2(1.0, 0.0, 0.0)
    assert held.poses(("ann", 0)) == {1: Pose2(1.5, -0.5, 1.0)}
    assert held.pose(("ann", 0), 1) == Pose2(1.5, -0.5, 1.0)


STEPS = st.lists(st.tuples(st.sampled_from([ANN, BOB]), st.integers(1, 5)), unique=True, max_size=8)


@given(STEPS, st.randoms())
def test_the_checksum_hangs_on_what_is_held_and_on_nothing_else(
    steps: list[tuple[Author, int]], random: object
) -> None:
    mixed = list(steps)
    random.shuffle(mixed)  # type: ignore[attr-defined]
    logs = [ObservationLog("me"), ObservationLog("you", 3)]
    for log, order in zip(logs, (steps, mixed), strict=True):
        for author, number in order:
            log.put(author, number, Entry(bytes([number]), (number, 0, 0), 0), author.robot)
    mine, yours = (HeldLog(log) for log in logs)
    assert mine.checksum() == yours.checksum()
    before = mine.checksum()
    logs[0].put(ANN, 9, Entry(b"more", (0, 0, 0), 0), "ann")
    assert mine.checksum() != before
    logs[1].put(ANN, 9, Entry(b"more", (0, 0, 0), 0), "bob")
    assert mine.checksum() == yours.checksum()
    logs[1].put_revision(ANN, PoseRevision(1, table((7, 7, 7))), "ann")
    assert mine.checksum() != yours.checksum()


def test_who_holds_nothing_has_the_checksum_of_nothing() -> None:
    assert (
        HeldLog(ObservationLog("me")).checksum() == HeldLog(ObservationLog("you")).checksum() == 0
    )
