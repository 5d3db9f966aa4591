"""One member's part, by the messages that go in and come out; teams are in the next tests."""

from __future__ import annotations

import numpy as np
import pytest

from protocol.log.author_log import Author, Entry
from protocol.log.messages import LogHave, LogWant, Observations, PoseSet, observations
from protocol.log.observation_log import ObservationLog
from protocol.log.settings import LogSyncSettings
from protocol.log.sync import LogSync, Outgoing
from tests.unit.protocol.log.invariants import check

ANN = Author("ann", 0)


def member(**settings: float) -> LogSync:
    limits = LogSyncSettings.model_validate(settings)
    return LogSync(ObservationLog("me"), limits, np.random.default_rng(0))


def run(sync: LogSync, until: float) -> list[Outgoing]:
    """Tick whenever something is due; return what was sent."""
    sent = []
    while sync.next_deadline() <= until:
        now = sync.next_deadline()
        sent += sync.tick(now)
        check(sync, now)
    return sent


def says(
    *numbers: int, text: bytes = b"x", author: Author = ANN, sender: str = "ann"
) -> Observations:
    told = [(n, Entry(text, (1, 2, 3), 0)) for n in numbers]
    return observations(author, told, sender, 0)


def has(count: int, version: int = 0, robot: str = "ann", **more: object) -> LogHave:
    have = LogHave(authors=(robot,), lives=(0,), counts=(count,), versions=(version,), sums=(0,))
    return have.model_copy(update=more)


def test_an_observation_is_broadcast_with_its_batch() -> None:
    sync = member(batch_period_s=2.0, announce_period_s=30.0)
    assert sync.append(b"one", (1, 2, 3), 1.0) == 1
    assert sync.append(b"two", (4, 5, 6), 2.0) == 2
    assert sync.next_deadline() == 3.0
    sync.hear("ann", 2.9)
    ((to, message),) = run(sync, 3.0)
    assert to == "*"
    assert isinstance(message, Observations) and message.numbers == (1, 2)


def test_what_nobody_would_take_is_refused_at_home() -> None:
    sync = member(payload_bytes_most=10, reach_m=5.0)
    with pytest.raises(ValueError, match="payload"):
        sync.append(bytes(11), (0, 0, 0), 0.0)
    with pytest.raises(ValueError, match="beyond"):
        sync.append(b"", (5001, 0, 0), 0.0)
    sync.append(b"", (5000, 0, 0), 0.0)
    with pytest.raises(ValueError, match="wrapped"):
        sync.revise(np.array([[0, 0, 40_000]], dtype=np.int32), 0.0)
    assert sync.log.own.version == 0


def test_what_it_announces_was_told() -> None:
    sync = member(announce_period_s=4.0, batch_period_s=100.0)
    sync.append(b"one", (1, 2, 3), 0.0)
    sync.handle("ann", says(1, 4, 5), 0.0)
    (announced,) = [m for _, m in run(sync, 4.0) if isinstance(m, LogHave)]
    assert announced.authors == ("ann", "me")
    assert (announced.counts, announced.beyond) == ((1, 0), ((0, 4, 5),))
    assert announced.sums[1] == 0


def told_once() -> LogSync:
    """A member that told an entry, and its newer pose."""
    sync = member(announce_period_s=4.0, batch_period_s=100.0)
    sync.append(b"one", (1, 2, 3), 0.0)
    sync.telling.tell()
    sync.revise(np.ones((1, 3), dtype=np.int32), 0.0)
    sync.telling.tell()
    return sync


def test_poses_that_nobody_heard_yet_are_not_announced() -> None:
    sync = told_once()
    for _ in range(2):
        sync.revise(np.full((1, 3), 7, dtype=np.int32), 1.0)
    ((_, announced),) = run(sync, 4.0)
    assert isinstance(announced, LogHave)
    assert (announced.counts, announced.versions) == ((1,), (1,))
    assert announced.sums == (sync.log.own.checksum_of(1, sync.log.own_revision(1)),)


def test_poses_too_old_to_be_told_from_are_not_announced_but_told_anew() -> None:
    sync = told_once()
    for _ in range(40):
        sync.revise(np.full((1, 3), 7, dtype=np.int32), 1.0)
    kinds = [type(message) for _, message in run(sync, 4.0)]
    assert kinds == [PoseSet, LogHave]


def test_a_new_life_is_told_from_its_beginning() -> None:
    sync = member(batch_period_s=1.0)
    sync.append(b"one", (1, 2, 3), 0.0)
    sync.hear("ann", 1.0)
    run(sync, 1.0)
    sync.begin_life(1, 2.0)
    sync.hear("ann", 3.0)
    (told,) = [message for _, message in run(sync, 3.0) if isinstance(message, Observations)]
    assert (told.life, told.numbers) == (1, (1,))


def test_a_gap_is_asked_for_and_its_filling_is_the_maps_news() -> None:
    sync = member()
    sync.handle("ann", says(1), 0.0)
    sync.handle("ann", says(4), 1.0)
    ((to, want),) = [(to, m) for to, m in run(sync, 5.0) if isinstance(m, LogWant)]
    assert (to, want.ranges) == ("ann", ((0, 2, 3),))
    assert sync.log.take_changes().entries == ((ANN, 1), (ANN, 4))
    sync.handle("ann", says(2, 3), 5.0)
    assert not sync.asking.lacking
    assert sync.log.take_changes().entries == ((ANN, 2), (ANN, 3))


def test_it_answers_for_others() -> None:
    sync = member()
    sync.handle("ann", says(1, 2), 0.0)
    want = LogWant(authors=("ann",), lives=(0,), versions=(0,), ranges=((0, 2, 2),))
    sync.handle("ben", want, 50.0)
    ((_, answer),) = [(to, m) for to, m in run(sync, 51.0) if to == "ben"]
    assert isinstance(answer, Observations)
    assert (answer.author, answer.numbers) == ("ann", (2,))


def test_its_own_echo_is_not_heard() -> None:
    sync = member()
    sync.handle("me", says(1, sender="me", author=Author("me", 0)), 0.0)
    assert sync.log.own.count == 0 and sync.peers.known == {}


def test_faults_isolate_and_are_said() -> None:
    sync = member(faults_to_isolate=2)
    sync.handle("ann", says(1), 0.0)
    sync.handle("eve", says(1, text=b"lie", sender="eve"), 1.0)
    sync.fault("eve", "a frame that cannot be read", 2.0)
    lines = [note.text for note in sync.take_notes()]
    assert len(lines) == 3 and "eve is isolated" in lines[2]
    assert sync.take_notes() == []
    sync.handle("eve", says(1, author=Author("eve", 0), sender="eve"), 3.0)
    assert sync.log.authors() == [ANN, Author("me", 0)]
    assert "eve" not in sync.peers.known


def test_others_that_know_more_of_its_life_are_noticed() -> None:
    sync = member()
    sync.intake.restored = True
    sync.handle("ann", has(3, robot="me"), 0.0)
    assert sync.overtaken
    assert not [m for _, m in run(sync, 60.0) if isinstance(m, LogWant)]


def test_one_that_lacks_news_is_told_soon() -> None:
    sync = member(announce_period_s=5.0, announce_period_max_s=40.0)
    sync.append(b"one", (1, 2, 3), 0.0)
    sync.hear("ben", 1.9)
    run(sync, 100.0)
    sync.handle("ben", has(0, robot="ben"), 100.0)
    assert [type(message) for _, message in run(sync, 100.8)] == [LogHave]


def test_one_that_was_away_is_told_soon_whatever_it_says() -> None:
    sync = member()
    run(sync, 100.0)
    sync.handle("ann", says(1), 100.0)
    assert [type(message) for _, message in run(sync, 100.8)] == [LogHave]


def test_any_traffic_shows_that_a_peer_is_here() -> None:
    sync = member()
    run(sync, 100.0)
    sync.hear("me", 100.0)
    assert run(sync, 100.8) == []
    sync.hear("ann", 101.0)
    assert [type(message) for _, message in run(sync, 101.8)] == [LogHave]
    sync.hear("ann", 102.0)
    assert run(sync, 103.0) == []


def test_it_speaks_for_an_author_that_cannot_be_heard_by_all() -> None:
    """Ann is here, but ben has not heard of what she told a while ago."""
    sync = member(announce_period_s=5.0)
    sync.handle("ann", says(1), 0.0)
    sync.handle("ben", has(0, robot="ben"), 0.0)
    run(sync, 11.0)
    for now in (11.0, 11.1):
        sync.handle("ann", says(1), now)
        sync.handle("ben", has(0, robot="ben"), now)
    sync.handle(
        "cid",
        LogHave(
            authors=("ann", "ben", "me"),
            lives=(0, 0, 0),
            counts=(1, 0, 0),
            versions=(0, 0, 0),
            sums=(0, 0, 0),
        ),
        11.2,
    )
    assert LogHave in [type(message) for _, message in run(sync, 16.3)]


@pytest.mark.parametrize("seed", range(3))
def test_any_messages_keep_the_invariants(seed: int) -> None:
    """Claims, gaps, wants and poses at random, from three peers of doubtful honesty."""
    rng = np.random.default_rng(seed)
    sync = member(window_entries=50, request_entries=20, faults_to_isolate=40)
    now = 0.0
    for _ in range(400):
        now += float(rng.exponential(0.3))
        peer = str(rng.choice(["ann", "ben", "eve"]))
        author = Author(str(rng.choice(["ann", "ben", "eve", "me"])), int(rng.integers(0, 2)))
        numbers = sorted({int(n) for n in rng.integers(1, 80, 4)})
        kind = int(rng.integers(0, 4))
        if kind == 0:
            sync.handle(peer, says(*numbers, author=author, sender=peer), now)
        elif kind == 1:
            claims = has(int(rng.integers(0, 90)), int(rng.integers(0, 3)), robot=author.robot)
            sync.handle(peer, claims, now)
        elif kind == 2:
            ranges = tuple((0, n, n + 5) for n in numbers)
            want = LogWant(authors=(author.robot,), lives=(0,), versions=(1,), ranges=ranges)
            sync.handle(peer, want, now)
        else:
            sync.append(b"own", (0, 0, 0), now)
        run(sync, now)
        check(sync, now)
