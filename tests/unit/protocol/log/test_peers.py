from __future__ import annotations

import pytest

from protocol.log.author_log import Author
from protocol.log.peers import Claim, Peers

ANN = Author("ann", 0)


def test_a_claim() -> None:
    claim = Claim(4, 0, ((7, 8),))
    assert claim.top == 8
    assert [n for n in range(1, 10) if claim.holds(n)] == [1, 2, 3, 4, 7, 8]
    assert Claim(4).top == 4


def test_who_is_here_away_or_gone() -> None:
    peers = Peers(10.0, 60.0)
    assert peers.hear("ann", 0.0)
    assert not peers.hear("ann", 5.0)
    assert peers.here("ann", 15.0) and not peers.here("ann", 15.1)
    assert not peers.here("ben", 0.0)
    assert peers.present(65.0) == ["ann"] and peers.present(65.1) == []
    peers.introduce("ann", {})
    assert peers.known["ann"].introduced
    assert peers.hear("ann", 16.0)
    assert not peers.known["ann"].introduced
    peers.forget("ann")
    assert peers.known == {}


def test_an_author_lives_while_its_robot_is_here_in_that_life() -> None:
    peers = Peers(10.0, 60.0)
    peers.hear("ann", 0.0)
    assert not peers.lives(ANN, 1.0)
    peers.known["ann"].life = 0
    assert peers.lives(ANN, 1.0) and not peers.lives(Author("ann", 1), 1.0)
    assert not peers.lives(ANN, 11.0)
    assert (peers.life("ann", 1.0), peers.life("ann", 11.0), peers.life("ben", 1.0)) == (0, -1, -1)


def test_of_itself_a_peer_never_holds_less_than_it_told() -> None:
    peers = Peers(10.0, 60.0)
    peers.hear("ann", 0.0)
    peers.introduce("ann", {ANN: Claim(9, 3), Author("ben", 0): Claim(9, 3)})
    peers.introduce("ann", {ANN: Claim(7, 4), Author("ben", 0): Claim(7, 4)})
    assert peers.claim("ann", ANN) == Claim(9, 4)
    assert peers.claim("ann", Author("ben", 0)) == Claim(7, 4)
    peers.introduce("ann", {})
    assert peers.authors() == []


def test_claims_are_those_of_peers_that_are_not_gone() -> None:
    peers = Peers(10.0, 60.0)
    for name, heard in (("ben", 0.0), ("cid", 50.0), ("dan", 50.0)):
        peers.hear(name, heard)
        if name != "dan":
            peers.claim(name, ANN).count = 5
    assert sorted(peers.claims(ANN, 55.0)) == ["ben", "cid"]
    assert sorted(peers.claims(ANN, 61.0)) == ["cid"]
    assert peers.authors() == [ANN]


def test_the_books_stay_small() -> None:
    peers = Peers(10.0, 60.0)
    for k in range(1000):
        peers.hear(f"name{k}", float(k))
    assert len(peers.known) == 256
    assert "name999" in peers.known and "name0" not in peers.known
    with pytest.raises(ValueError, match="too many"):
        for k in range(1000):
            peers.claim("name999", Author("ann", k))
