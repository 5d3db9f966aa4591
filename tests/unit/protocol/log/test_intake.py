"""Whose word counts, rule by rule."""

from __future__ import annotations

import numpy as np
import pytest

from protocol.log.author_log import Author, Entry
from protocol.log.intake import LIAR, Intake
from protocol.log.messages import Observations, PoseSet, observations
from protocol.log.observation_log import ObservationLog
from protocol.log.peers import Claim, Peers
from protocol.log.pose_coding import pack_poses
from protocol.log.settings import LogSyncSettings

ANN, BEN, ME = Author("ann", 0), Author("ben", 0), Author("me", 1)


class Desk:
    """An intake and what stands around it."""

    def __init__(self, team: tuple[str, ...] = (), **settings: float) -> None:
        self.log = ObservationLog("me", 1)
        self.peers = Peers(10.0, 60.0)
        limits = LogSyncSettings.model_validate(settings)
        self.intake = Intake(self.log, self.peers, limits, team)

    def tell(self, peer: str, message: Observations | PoseSet, now: float = 0.0) -> list[object]:
        self.peers.hear(peer, now)
        if isinstance(message, Observations):
            return list(self.intake.entries(peer, message, now))
        return list(self.intake.revision(peer, message, now))

    def entry(self, author: Author, number: int) -> tuple[bytes, str]:
        told = self.log.of(author).entries[number]
        return told.what.payload, told.by


def says(author: Author, text: bytes, *numbers: int, version: int = 0) -> Observations:
    told = [(n, Entry(text, (1, 2, 3), version)) for n in numbers or (1,)]
    return observations(author, told, "", version)


def moves(author: Author, version: int, x: int, count: int = 2) -> PoseSet:
    poses = np.full((count, 3), x, dtype=np.int32)
    robot, life = author
    return PoseSet(author=robot, life=life, version=version, count=count, data=pack_poses(poses))


def test_first_hand_beats_relayed_whichever_comes_first() -> None:
    desk = Desk()
    assert desk.tell("eve", says(ANN, b"lie")) == []
    assert desk.tell("ann", says(ANN, b"true")) == [("eve", LIAR)]
    assert desk.tell("eve", says(ANN, b"lie")) == [("eve", LIAR)]
    assert desk.entry(ANN, 1) == (b"true", "ann")


def test_an_author_vouches_for_what_was_relayed() -> None:
    desk = Desk()
    desk.tell("ben", says(ANN, b"true"))
    assert desk.entry(ANN, 1) == (b"true", "ben")
    assert desk.tell("ann", says(ANN, b"true")) == []
    assert desk.entry(ANN, 1) == (b"true", "ann")
    assert desk.tell("ben", says(ANN, b"true")) == []
    assert desk.entry(ANN, 1) == (b"true", "ann")


def test_a_robot_that_contradicts_itself_keeps_its_first_word() -> None:
    desk = Desk()
    desk.tell("ann", says(ANN, b"first"))
    assert desk.tell("ann", says(ANN, b"second")) == [("ann", "contradicts itself")]
    assert desk.entry(ANN, 1) == (b"first", "ann")


def test_of_two_relayed_words_the_first_stays() -> None:
    desk = Desk()
    desk.tell("eve", says(ANN, b"lie"))
    assert desk.tell("ben", says(ANN, b"true")) == []
    assert desk.entry(ANN, 1) == (b"lie", "eve")


def test_a_word_on_an_older_life_is_relayed() -> None:
    desk = Desk()
    desk.tell("ann", says(Author("ann", 4), b"now"))
    desk.tell("ann", says(Author("ann", 3), b"then"))
    assert desk.tell("ben", says(Author("ann", 3), b"other")) != []
    desk = Desk()
    desk.tell("ann", says(Author("ann", 4), b"now"))
    desk.tell("ben", says(Author("ann", 3), b"then"))
    assert desk.tell("ann", says(Author("ann", 3), b"other")) == []
    assert desk.entry(Author("ann", 3), 1) == (b"then", "ben")


def test_only_a_robot_begins_its_lives_while_it_is_here() -> None:
    desk = Desk()
    next_life = Author("ann", 1)
    desk.tell("ann", says(ANN, b"x"))
    assert desk.tell("eve", says(next_life, b"x"), 5.0) == []
    assert next_life not in desk.log.logs
    assert desk.tell("ann", says(ANN, b"x", 2), 8.0) == []
    fault = ("eve", "a life that its robot did not tell")
    assert desk.tell("ann", says(ANN, b"x", 3), 11.0) == [fault]
    assert desk.tell("ann", says(ANN, b"x", 4), 12.0) == []
    desk.tell("ben", says(next_life, b"x"), 13.0)
    assert desk.tell("ann", says(next_life, b"x"), 19.0) == []
    assert desk.tell("eve", says(Author("ann", 2), b"x"), 30.0) == []
    assert Author("ann", 2) in desk.log.logs  # ann is away, and may have begun it
    assert desk.tell("ann", says(next_life, b"x", 2), 31.0) == []
    assert Author("ann", 2) not in desk.log.logs  # but did not


def test_of_its_own_life_a_robot_believes_nobody() -> None:
    desk = Desk()
    desk.log.append(b"mine", (1, 2, 3))
    assert desk.tell("ben", says(ME, b"mine")) == []
    assert desk.tell("eve", says(ME, b"next", 2), 1.0) == []  # it may have been lied to
    assert desk.tell("eve", says(ME, b"next", 2), 5.0) == []
    with pytest.raises(ValueError, match="mouth"):  # this life began with this start
        desk.tell("eve", says(ME, b"next", 2), 6.0)
    assert not desk.intake.overtaken and desk.log.own.count == 1
    desk.intake.restored = True
    with pytest.raises(ValueError, match="mouth"):
        desk.tell("eve", says(ME, b"never"), 7.0)
    assert desk.tell("cid", says(ME, b"never"), 8.0) == []
    assert desk.tell("cid", says(ME, b"never"), 30.0) == []  # what it said long ago is forgiven
    assert not desk.intake.overtaken
    assert desk.tell("ben", says(ME, b"next", 2)) == []
    assert desk.intake.overtaken and desk.log.own.count == 1
    with pytest.raises(ValueError, match="do not live"):
        desk.tell("eve", says(Author("me", 2), b"x"))
    desk.tell("ben", says(Author("me", 0), b"before"))
    assert desk.entry(Author("me", 0), 1) == (b"before", "ben")


def test_of_its_own_revisions_too() -> None:
    desk = Desk()
    desk.intake.restored = True
    desk.tell("ben", moves(ME, 1, 5))
    assert desk.intake.overtaken and desk.log.own.version == 0


def test_strangers_have_no_log_where_the_team_is_known() -> None:
    desk = Desk(team=("ann", "me"))
    with pytest.raises(ValueError, match="stranger"):
        desk.tell("eve", says(Author("eve", 0), b"x"))
    desk.tell("eve", says(ANN, b"x"))
    assert desk.log.authors() == [ANN, ME]
    assert not desk.intake.admits(Author("eve", 0), "eve", 0.0, strict=False)


def test_limits() -> None:
    desk = Desk(
        payload_bytes_most=10, author_entries_most=500, author_bytes_most=25, window_entries=100
    )
    with pytest.raises(ValueError, match="payload"):
        desk.tell("ann", says(ANN, bytes(11)))
    with pytest.raises(ValueError, match="beyond all reason"):
        desk.tell("ann", says(ANN, b"", 501))
    far = says(ANN, b"", 1).model_copy(update={"poses": np.array([[0, 0, 40_000]], np.int32)})
    with pytest.raises(ValueError, match="impossible"):
        desk.tell("ann", far)
    with pytest.raises(ValueError, match="impossible"):
        desk.tell("ann", moves(ANN, 1, 10**8))
    with pytest.raises(ValueError, match="too many poses"):
        desk.tell("ann", moves(ANN, 1, 1, count=501))
    assert desk.tell("ann", says(ANN, bytes(10), 1, 2, 3)) == [("ann", "a log that is too large")]
    assert desk.log.of(ANN).count == 2


def test_there_are_so_many_authors_and_no_more() -> None:
    desk = Desk(authors_most=4, lives_most=2)
    for life in (0, 1):
        desk.tell("ann", says(Author("ann", life), b"x"))
    for author in (Author("ann", 2), BEN, Author("cid", 0)):
        if author != BEN:
            with pytest.raises(ValueError, match="too many authors"):
                desk.tell(author.robot, says(author, b"x"))
        else:
            desk.tell("ben", says(BEN, b"x"))


def test_numbers_after_the_window_are_not_held_and_leaps_are_faults() -> None:
    desk = Desk(window_entries=100)
    assert desk.tell("ann", says(ANN, b"", 300)) == []
    assert desk.log.of(ANN).top == 0
    desk.peers.introduce("ann", {ANN: Claim(301)})
    assert desk.tell("ann", says(ANN, b"", 401)) == []
    with pytest.raises(ValueError, match="leap"):
        desk.tell("ann", says(ANN, b"", 502))
    assert desk.tell("ann", says(ANN, b"", 100)) == []
    assert desk.log.of(ANN).beyond() == [(100, 100)]


def test_newer_revisions_replace_older_ones() -> None:
    desk = Desk()
    desk.tell("ann", moves(ANN, 2, 7))
    desk.tell("ann", moves(ANN, 1, 5))
    assert desk.log.of(ANN).pose(1) == (7, 7, 7)
    desk.tell("ann", moves(ANN, 3, 9, count=1))
    assert (desk.log.of(ANN).pose(1), desk.log.of(ANN).version) == ((9, 9, 9), 3)
    assert desk.tell("ann", moves(ANN, 3, 8, count=1)) == [("ann", "contradicts itself")]
    assert desk.tell("ben", moves(ANN, 3, 9, count=1)) == []
    assert desk.tell("ben", moves(ANN, 3, 8, count=1)) == [("ben", LIAR)]


def test_a_relayed_revision_waits_for_its_author_to_name_it() -> None:
    desk = Desk()
    desk.tell("ann", says(ANN, b"x"))
    desk.tell("ben", moves(ANN, 1, 5), 1.0)
    assert desk.log.of(ANN).version == 0
    desk.tell("ann", says(ANN, b"y", 2, version=1), 2.0)
    desk.tell("ben", moves(ANN, 1, 5), 3.0)
    assert desk.log.of(ANN).version == 1
    assert desk.tell("ann", moves(ANN, 1, 5), 4.0) == []
    assert desk.log.of(ANN).revision_by == "ann"


def test_a_relayed_revision_of_one_that_is_away_is_taken_until_it_speaks() -> None:
    desk = Desk()
    desk.tell("eve", moves(ANN, 900, 5), 0.0)
    assert desk.log.of(ANN).version == 900
    assert desk.tell("ben", moves(ANN, 900, 6), 0.0) == []
    desk.tell("ann", says(ANN, b"x", version=2), 1.0)
    assert desk.log.of(ANN).version == 900  # may have been overtaken on its way
    desk.tell("ann", says(ANN, b"y", 2, version=2), 9.0)
    assert desk.log.of(ANN).version == 0
    desk.tell("ann", moves(ANN, 2, 7), 9.5)
    assert desk.log.of(ANN).pose(1) == (7, 7, 7)


def test_the_author_replaces_a_revision_forged_under_a_version_of_its_own() -> None:
    desk = Desk()
    desk.tell("eve", moves(ANN, 3, 5))
    assert desk.tell("ann", moves(ANN, 3, 7)) == [("eve", LIAR)]
    assert desk.log.of(ANN).pose(1) == (7, 7, 7)
