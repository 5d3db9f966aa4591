from __future__ import annotations

import numpy as np
import pytest

from protocol.log.asking import Asking
from protocol.log.author_log import Author, Entry, PoseRevision
from protocol.log.messages import LogWant
from protocol.log.observation_log import ObservationLog
from protocol.log.peers import Claim, Peers
from protocol.log.settings import LogSyncSettings

ANN, BEN = Author("ann", 0), Author("ben", 0)


class Desk:
    """One that asks, and what stands around it."""

    def __init__(self, seed: int = 0, **settings: float) -> None:
        self.log = ObservationLog("me")
        self.peers = Peers(10.0, 60.0)
        limits = LogSyncSettings.model_validate(settings)
        self.asking = Asking(self.log, self.peers, limits, np.random.default_rng(seed))

    def claim(self, peer: str, claims: dict[Author, Claim], now: float = 0.0) -> None:
        self.peers.hear(peer, now)
        self.peers.known[peer].life = 0
        self.peers.introduce(peer, claims)
        self.asking.schedule(now)

    def ask(self) -> dict[str, LogWant]:
        assert self.asking.due is not None
        return dict(self.asking.ask(self.asking.due))

    def hold(self, author: Author, *numbers: int, by: str = "ben") -> None:
        for number in numbers:
            self.log.put(author, number, Entry(b"", (0, 0, 0), 0), by)


def test_nothing_is_asked_when_nothing_is_lacking() -> None:
    desk = Desk()
    desk.claim("ann", {ANN: Claim(), Author("me", 0): Claim(9, 9)})
    assert desk.asking.due is None and not desk.asking.lacking


def test_a_little_is_asked_for_when_all_ask() -> None:
    desk = Desk(request_patience_s=4.0)
    desk.hold(ANN, 1, 2, 5)
    desk.claim("ann", {ANN: Claim(6)}, now=9.0)
    assert desk.asking.due is not None and 12.0 <= desk.asking.due <= 12.3
    want = desk.ask()["ann"]
    assert (want.authors, want.lives, want.versions) == (("ann",), (0,), (0,))
    assert want.ranges == ((0, 3, 4), (0, 6, 6))
    assert desk.asking.lacking


def test_a_lot_is_asked_for_soon_and_in_parts() -> None:
    desk = Desk(request_many=16, request_entries=100)
    desk.claim("ann", {ANN: Claim(1000)}, now=9.0)
    assert desk.asking.due is not None and 11.0 <= desk.asking.due <= 11.3
    assert desk.ask()["ann"].ranges == ((0, 1, 100),)
    desk.hold(ANN, *range(1, 61))
    desk.asking.arrived(ANN, tuple(range(1, 61)), "ann", 12.0)
    desk.asking.schedule(12.0)
    assert desk.ask()["ann"].ranges == ((0, 101, 160),)


def test_the_author_is_asked_if_it_is_there_and_else_all_ask_the_same() -> None:
    claims = {ANN: Claim(200), BEN: Claim(200)}
    chosen = []
    for seed in range(2):
        desk = Desk(seed)
        desk.hold(ANN, *range(1, 181), by="ann")
        for peer in ("ann", "cid", "dan", "eli"):
            desk.claim(peer, {author: Claim(200) for author in claims})
        wants = desk.ask()
        assert "ann" in wants["ann"].authors
        for peer in ("cid", "dan", "eli"):
            assert peer not in wants or wants[peer].authors == ("ben",)
        chosen.append({peer: want.ranges for peer, want in wants.items()})
    assert chosen[0] == chosen[1]
    assert len(chosen[0]) > 2


def test_after_a_time_out_another_is_asked_later_and_later() -> None:
    desk = Desk(request_timeout_s=3.0, request_patience_s=1.0, backoff_max_s=10.0)
    for peer in ("ben", "cid"):
        desk.claim(peer, {ANN: Claim(1)})
    asked, times = [], []
    for _ in range(6):
        for peer in ("ben", "cid"):
            desk.peers.hear(peer, desk.asking.due or 0.0)
        times.append(desk.asking.due or 0.0)
        asked += list(desk.ask())
    assert asked[:4] in (["ben", "cid"] * 2, ["cid", "ben"] * 2)
    waits = np.diff(times)
    assert 3.0 <= waits[0] < 6.0
    assert all(7.0 < wait < 15.0 for wait in waits[3:])


def test_what_arrives_gives_the_rest_more_time() -> None:
    desk = Desk(request_timeout_s=3.0, request_many=1)
    desk.claim("ann", {ANN: Claim(50)})
    desk.ask()
    before = desk.asking.asked[ANN, 50].deadline
    desk.asking.arrived(ANN, (1, 2), "ann", before - 0.5)
    assert desk.asking.asked[ANN, 50].deadline == before + 2.5
    assert (ANN, 1) not in desk.asking.asked
    desk.asking.arrived(ANN, (70,), "ann", before + 1.0)
    assert desk.asking.asked[ANN, 50].deadline == before + 2.5


def test_one_that_is_gone_is_not_asked_and_then_forgotten() -> None:
    desk = Desk()
    desk.claim("ann", {ANN: Claim(5)})
    desk.ask()
    assert desk.asking.ask(100.0) == []
    assert desk.asking.asked == {} and desk.asking.due is None


def test_what_nobody_holds_is_not_asked_for() -> None:
    desk = Desk()
    desk.claim("ben", {ANN: Claim(2, 0, ((5, 6),))})
    assert desk.ask()["ben"].ranges == ((0, 1, 2), (0, 5, 6))
    desk.hold(ANN, 1, 2, 5, 6)
    desk.asking.arrived(ANN, (1, 2, 5, 6), "ben", 5.0)
    desk.asking.schedule(5.0)
    assert not desk.asking.lacking and desk.asking.due is None


def test_the_window_is_not_left() -> None:
    desk = Desk(window_entries=10)
    desk.hold(ANN, 1)
    desk.claim("ann", {ANN: Claim(2**31 - 1)})
    assert desk.ask()["ann"].ranges == ((0, 2, 11),)


def test_revisions_are_asked_for_by_the_word_of_their_author() -> None:
    desk = Desk()
    desk.claim("ben", {ANN: Claim(0, 7), BEN: Claim()})
    assert desk.ask()["ben"].versions == (1,)
    desk = Desk()
    desk.claim("ann", {ANN: Claim(0, 3)})
    desk.claim("ben", {ANN: Claim(0, 99)})
    poses = np.zeros((0, 3), dtype=np.int32)
    desk.log.put_revision(ANN, PoseRevision(2, poses), "ann")
    assert desk.ask()["ann"].versions == (3,)
    desk.log.put_revision(ANN, PoseRevision(3, poses), "ann")
    desk.asking.arrived(ANN, (0,), "ann", 1.0)
    desk.asking.schedule(1.0)
    assert not desk.asking.lacking
    desk = Desk()
    desk.claim("ann", {})
    desk.claim("ben", {ANN: Claim(0, 99)})
    assert desk.asking.due is None


def test_an_author_is_asked_for_its_own_word_on_what_is_doubted() -> None:
    desk = Desk(request_patience_s=1.0)
    desk.hold(ANN, 1, 3, by="ben")
    desk.hold(ANN, 2, by="ann")
    desk.log.put_revision(ANN, PoseRevision(4, np.zeros((0, 3), dtype=np.int32)), "ben")
    desk.claim("ann", {ANN: Claim(3, 4)})
    desk.claim("ben", {ANN: Claim(3, 4)})
    assert desk.asking.doubt(ANN, 3, 0.0)
    assert not desk.asking.doubt(ANN, 3, 1.0)
    desk.asking.schedule(0.0)
    wants = desk.ask()
    assert list(wants) == ["ann"]
    assert (wants["ann"].versions, wants["ann"].ranges) == ((4,), ((0, 1, 1), (0, 3, 3)))
    desk.asking.arrived(ANN, (0, 1), "ann", 2.0)
    desk.asking.arrived(ANN, (3,), "ben", 2.0)
    desk.asking.schedule(2.0)
    assert desk.ask()["ann"].ranges == ((0, 3, 3),)


def test_a_doubt_that_is_not_answered_is_given_up() -> None:
    desk = Desk(request_patience_s=1.0)
    desk.hold(ANN, 1, by="ben")
    desk.claim("ann", {ANN: Claim(1)})
    desk.asking.doubt(ANN, 1, 0.0)
    desk.asking.schedule(0.0)
    asked = 0
    while desk.asking.due is not None and asked < 50:
        desk.peers.hear("ann", desk.asking.due)
        asked += len(desk.ask())
    assert asked == 8


@pytest.mark.parametrize("most", [10, 256])
def test_no_more_is_asked_for_than_the_limit(most: int) -> None:
    desk = Desk(request_entries=most)
    desk.hold(ANN, *range(2, 1200, 2))
    desk.claim("ann", {ANN: Claim(1200)})
    ranges = desk.ask()["ann"].ranges
    assert len(ranges) == most
