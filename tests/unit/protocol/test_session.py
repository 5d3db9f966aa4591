"""Every state with every event, and what a session counts."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.codec import Header
from protocol.session import TRANSITIONS, Session

SILENCE = 5.0
STATES = ("new", "open", "silent")
EXPECTED = {
    ("new", "hello"): "open",
    ("new", "traffic"): "new",
    ("new", "silence"): "new",
    ("new", "left"): "new",
    ("open", "hello"): "open",
    ("open", "traffic"): "open",
    ("open", "silence"): "silent",
    ("open", "left"): "silent",
    ("silent", "hello"): "open",
    ("silent", "traffic"): "open",
    ("silent", "silence"): "silent",
    ("silent", "left"): "silent",
}


def header(sequence: int) -> Header:
    return Header("heartbeat", "robot1", "server", sequence, 0.0)


def apply(session: Session, event: str, now: float = 1.0) -> None:
    if event == "hello":
        session.hello(0, now)
    elif event == "traffic":
        session.accept(header(session.received + 1), now)
    elif event == "silence":
        session.check(session.heard + 2.0 * SILENCE)
    else:
        session.left()


@pytest.mark.parametrize(("state", "event"), sorted(EXPECTED))
def test_every_event_in_every_state(state: str, event: str) -> None:
    session = Session("robot1", SILENCE, state=state)
    apply(session, event)
    assert session.state == EXPECTED[state, event]


def test_the_table_knows_no_other_states() -> None:
    assert {state for state, _ in TRANSITIONS} | set(TRANSITIONS.values()) == set(STATES)


def test_silence_is_noticed_once_and_any_traffic_ends_it() -> None:
    session = Session("robot1", SILENCE)
    assert session.deadline is None
    session.hello(0, 1.0)
    assert session.deadline == 1.0 + SILENCE
    assert not session.check(1.0 + SILENCE)
    assert session.check(1.1 + SILENCE)
    assert not session.check(9.0 + SILENCE)
    assert session.deadline is None
    session.accept(header(1), 20.0)
    assert session.state == "open"
    assert session.deadline == 20.0 + SILENCE


def test_duplicates_and_gaps_are_counted() -> None:
    session = Session("robot1", SILENCE)
    session.hello(0, 0.0)
    assert session.accept(header(1), 0.0)
    assert not session.accept(header(1), 0.0)
    assert session.accept(header(4), 0.0)
    assert not session.accept(header(3), 0.0)
    assert (session.missed, session.duplicates, session.received) == (2, 2, 4)


def test_a_new_life_counts_from_the_beginning() -> None:
    session = Session("robot1", SILENCE)
    assert session.hello(0, 0.0)
    session.accept(header(50), 0.0)
    assert not session.hello(0, 1.0)
    assert not session.accept(header(1), 1.0)
    assert session.hello(1, 2.0)
    assert session.accept(header(1), 2.0)


def test_leaving_is_news_only_for_one_that_was_there() -> None:
    session = Session("robot1", SILENCE)
    assert not session.left()
    session.hello(0, 0.0)
    assert session.left()
    assert not session.left()


@given(st.lists(st.sampled_from(["hello", "traffic", "silence", "left"]), max_size=20))
def test_any_sequence_keeps_the_books(events: list[str]) -> None:
    session = Session("robot1", SILENCE)
    for event in events:
        apply(session, event)
        assert session.state in STATES
        assert (session.deadline is not None) == (session.state == "open")
        assert session.missed == session.duplicates == 0
